//! Signs of life on standard error: a bar, lines of text or events for programs. And the way by which a signal, a time
//! limit or the wish to see the image as it stands reaches the render.

mod bar;
mod events;
mod plain;
mod steps;

use std::io::IsTerminal;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use clap::ValueEnum;
use etendue::render::{Phase, Picture, Progress};

use super::output;
use super::stop::Stop;

pub(super) use events::emit;
pub(super) use steps::{Count, Steps, Voice, done, fail};

/// How progress is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Told {
    /// A bar on a terminal, else plain lines
    Auto,
    /// A bar, where standard error is a terminal
    Bar,
    /// A line after ten seconds; more as they pass and five per cent more are done, one a minute at least
    Plain,
    /// An event a line, as JSON: see docs/progress.md
    Json,
    /// Not at all
    None,
}

impl Told {
    /// Nothing where nobody said how and `quiet` is asked for.
    pub(super) fn unless(self, quiet: bool) -> Self {
        match self {
            Self::Auto if quiet => Self::None,
            told => told,
        }
    }
}

#[derive(Debug)]
enum Show {
    Bar(bar::Bar),
    Plain(plain::Lines),
    Json,
    Nothing,
}

impl Show {
    fn new(told: Told) -> Self {
        match told {
            Told::Auto if std::io::stderr().is_terminal() => Self::Bar(bar::Bar::new()),
            Told::Auto | Told::Plain => Self::Plain(plain::Lines::new()),
            Told::Bar => Self::Bar(bar::Bar::new()),
            Told::Json => Self::Json,
            Told::None => Self::Nothing,
        }
    }

    /// The time between two looks at where a render is.
    fn refresh(&self) -> Duration {
        Duration::from_millis(match self {
            Self::Bar(_) => 200,
            _ => 1000,
        })
    }
}

/// Where a phase is.
#[derive(Clone, Copy, Debug)]
struct State<'a> {
    /// Of the render.
    name: &'a str,
    phase: Phase,
    /// Steps.
    done: u64,
    total: u64,
    /// Steps of an earlier run, which went on from there.
    kept: u64,
    rays: u64,
    /// Since the phase began.
    elapsed: Duration,
}

impl State<'_> {
    /// What is done, in [0, 1].
    fn share(&self) -> f64 {
        (self.done as f64 / self.total.max(1) as f64).min(1.0)
    }

    /// Steps and rays a second.
    fn rates(&self) -> [f64; 2] {
        let seconds = self.elapsed.as_secs_f64().max(1e-9);
        [self.done.saturating_sub(self.kept), self.rays].map(|count| count as f64 / seconds)
    }

    /// The time that the rest will take, as it goes.
    fn left(&self) -> Option<Duration> {
        let [rate, _] = self.rates();
        let left = self.total.saturating_sub(self.done) as f64 / rate;
        Duration::try_from_secs_f64(left).ok()
    }
}

/// When the phase began, and when it was last shown.
#[derive(Debug)]
struct Clock {
    phase: Option<Phase>,
    total: u64,
    began: Instant,
    shown: Instant,
}

/// Takes the image as it stands.
pub(super) type Take<'a> = Box<dyn Fn(&Picture) + Sync + 'a>;

/// Who takes the image as it stands.
#[derive(Default)]
pub(super) struct Takers<'a> {
    /// Writes it, every so often and where a signal asks for it.
    pub(super) write: Option<Take<'a>>,
    /// The time between two that are written; without it only the signal asks.
    pub(super) every: Option<Duration>,
    /// Shows it, as often as that takes little of the time.
    pub(super) show: Option<Take<'a>>,
}

/// When the image as it stands was last taken, and by whom it is to be taken next.
#[derive(Debug)]
struct Pictured {
    written: Instant,
    shown: Instant,
    /// How long it took to make and show the last.
    cost: Duration,
    /// Since when the next is being made, where somebody asked for one.
    asked: Option<Asked>,
}

#[derive(Clone, Copy, Debug)]
struct Asked {
    since: Instant,
    write: bool,
    show: bool,
}

impl Pictured {
    /// The shortest time between two that are shown.
    const PAUSE: Duration = Duration::from_millis(250);
    /// A picture takes one part of so many of the time.
    const SHARE: u32 = 20;

    /// Whether another is to be shown.
    fn is_stale(&self) -> bool {
        self.shown.elapsed() >= Self::PAUSE.max(Self::SHARE * self.cost)
    }
}

/// Watches one render.
pub(super) struct Watch<'a> {
    show: Show,
    name: String,
    done: AtomicU64,
    kept: AtomicU64,
    rays: AtomicU64,
    clock: Mutex<Clock>,
    stop: Stop,
    /// Whether it was said that the render is coming to an end.
    said: AtomicBool,
    takers: Takers<'a>,
    pictured: Mutex<Pictured>,
}

impl<'a> Watch<'a> {
    /// For the render called `name`.
    pub(super) fn new(name: &str, told: Told, stop: Stop, takers: Takers<'a>) -> Self {
        let now = Instant::now();
        Self {
            show: Show::new(told),
            name: name.to_owned(),
            done: AtomicU64::new(0),
            kept: AtomicU64::new(0),
            rays: AtomicU64::new(0),
            clock: Mutex::new(Clock {
                phase: None,
                total: 0,
                began: now,
                shown: now,
            }),
            stop,
            said: AtomicBool::new(false),
            takers,
            pictured: Mutex::new(Pictured {
                written: now,
                shown: now,
                cost: Duration::ZERO,
                asked: None,
            }),
        }
    }

    fn state(&self, clock: &Clock) -> Option<State<'_>> {
        Some(State {
            name: &self.name,
            phase: clock.phase?,
            done: self.done.load(Ordering::Relaxed),
            total: clock.total,
            kept: self.kept.load(Ordering::Relaxed),
            rays: self.rays.load(Ordering::Relaxed),
            elapsed: clock.began.elapsed(),
        })
    }

    /// Nothing more is shown.
    pub(super) fn finish(&self) {
        if let Show::Bar(bar) = &self.show {
            bar.finish();
        }
    }
}

const CALM: &str = "no thread panics while it looks at the clock";

impl Progress for Watch<'_> {
    fn begin(&self, phase: Phase, total: u64) {
        let mut clock = self.clock.lock().expect(CALM);
        if let (Show::Json, Some(before)) = (&self.show, self.state(&clock)) {
            events::over(before.name, before.phase, before.elapsed, before.done);
        }
        for counter in [&self.done, &self.kept, &self.rays] {
            counter.store(0, Ordering::Relaxed);
        }
        let now = Instant::now();
        *clock = Clock {
            phase: Some(phase),
            total,
            began: now,
            shown: now,
        };
        match (&self.show, self.state(&clock)) {
            (Show::Bar(bar), Some(state)) => bar.begin(&state),
            (Show::Plain(lines), _) => lines.begin(),
            _ => {}
        }
    }

    fn advance(&self, steps: u64, rays: u64) {
        self.done.fetch_add(steps, Ordering::Relaxed);
        self.rays.fetch_add(rays, Ordering::Relaxed);
        if rays == 0 {
            self.kept.fetch_add(steps, Ordering::Relaxed);
        }
        let Ok(mut clock) = self.clock.try_lock() else {
            return;
        };
        if clock.shown.elapsed() < self.show.refresh() {
            return;
        }
        clock.shown = Instant::now();
        let Some(state) = self.state(&clock) else {
            return;
        };
        match &self.show {
            Show::Bar(bar) => bar.advance(&state),
            Show::Plain(lines) => lines.advance(&state),
            Show::Json => events::advance(&state),
            Show::Nothing => {}
        }
    }

    fn stop(&self) -> bool {
        let asked = self.stop.asked();
        if asked && self.stop.signalled() && !self.said.swap(true, Ordering::Relaxed) {
            let text = "finishing the tiles under way; a second signal ends at once";
            match &self.show {
                Show::Bar(bar) => bar.say(text),
                Show::Plain(_) => output::note(text),
                Show::Json | Show::Nothing => {}
            }
        }
        asked
    }

    fn wants_picture(&self) -> bool {
        let wished = self.takers.write.is_some() && self.stop.take_wish();
        let mut pictured = self.pictured.lock().expect(CALM);
        let every = self.takers.every;
        let due = every.is_some_and(|every| pictured.written.elapsed() >= every);
        let asked = Asked {
            since: Instant::now(),
            write: wished || due,
            show: self.takers.show.is_some() && pictured.is_stale(),
        };
        pictured.asked = (asked.write || asked.show).then_some(asked);
        pictured.asked.is_some()
    }

    fn picture(&self, picture: &Picture) {
        // One that nobody asked for, by the z-buffer, is for all.
        let unasked = Asked {
            since: Instant::now(),
            write: true,
            show: true,
        };
        let asked = self.pictured.lock().expect(CALM).asked.take();
        let asked = asked.unwrap_or(unasked);
        if let Some(write) = self.takers.write.as_ref().filter(|_| asked.write) {
            write(picture);
            self.pictured.lock().expect(CALM).written = Instant::now();
        }
        if let Some(show) = self.takers.show.as_ref().filter(|_| asked.show) {
            show(picture);
            let mut pictured = self.pictured.lock().expect(CALM);
            pictured.shown = Instant::now();
            pictured.cost = asked.since.elapsed();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_an_earlier_run_did_is_no_part_of_the_rate_and_what_is_left_follows_from_it() {
        let state = State {
            name: "a",
            phase: Phase::Render,
            done: 600,
            total: 1000,
            kept: 500,
            rays: 50,
            elapsed: Duration::from_secs(10),
        };
        assert_eq!(state.rates(), [10.0, 5.0]);
        assert_eq!(state.left(), Some(Duration::from_secs(40)));
        assert_eq!(state.share(), 0.6);
        let begun = State { done: 500, ..state };
        assert_eq!(begun.left(), None);
    }

    #[test]
    fn what_is_shown_takes_a_twentieth_of_the_time() {
        let now = Instant::now();
        let pictured = |milliseconds, cost| Pictured {
            written: now,
            shown: now - Duration::from_millis(milliseconds),
            cost: Duration::from_millis(cost),
            asked: None,
        };
        assert!(pictured(2100, 100).is_stale());
        assert!(!pictured(1500, 100).is_stale());
        assert!(!pictured(100, 0).is_stale());
        assert!(pictured(300, 0).is_stale());
    }
}
