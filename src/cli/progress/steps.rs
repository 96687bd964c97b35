//! Progress of commands whose steps are whole renders: a bar, lines of text or events.

use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use etendue::error::{Error, Problem};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::json;

use super::{Told, events, plain};
use crate::cli::{output, report};

/// The time between two events.
const EVERY: Duration = Duration::from_secs(1);

/// How steps are counted before people.
#[derive(Clone, Copy, Debug)]
pub(in super::super) enum Count {
    /// `3 of 16 images`
    Images,
    /// `35 %`
    Percent,
}

/// Tells how far a command is.
#[derive(Debug)]
pub(in super::super) struct Steps {
    show: Show,
    name: String,
    count: Count,
    began: Instant,
}

#[derive(Debug)]
enum Show {
    Bar(ProgressBar),
    Plain(plain::Lines),
    /// When the last event came, if one has.
    Json(Mutex<Option<Instant>>),
    Nothing,
}

impl Steps {
    /// For the work called `name`, which begins.
    pub(in super::super) fn new(told: Told, name: &str, count: Count) -> Self {
        let bar = || {
            let target = ProgressDrawTarget::stderr_with_hz(5);
            let bar = ProgressBar::with_draw_target(Some(0), target);
            let template = match count {
                Count::Images => "{prefix} [{bar:30}] {pos}/{len} images, {msg}",
                Count::Percent => "{prefix} [{bar:30}] {percent:>3} % {msg}, {eta} left",
            };
            bar.set_style(ProgressStyle::with_template(template).expect("the template is right"));
            bar.set_prefix(name.to_owned());
            Show::Bar(bar)
        };
        let began = Instant::now();
        let show = match told {
            Told::Auto if std::io::stderr().is_terminal() => bar(),
            Told::Bar => bar(),
            Told::Auto | Told::Plain => Show::Plain(plain::Lines::new()),
            Told::Json => {
                events::emit("started", json!({ "name": name }));
                Show::Json(Mutex::new(None))
            }
            Told::None => Show::Nothing,
        };
        let name = name.to_owned();
        Self {
            show,
            name,
            count,
            began,
        }
    }

    /// `done` of `total` steps are; `what` is at work.
    pub(in super::super) fn at(&self, done: u64, total: u64, what: &str) {
        let share = (done as f64 / total.max(1) as f64).min(1.0);
        match &self.show {
            Show::Bar(bar) => {
                bar.set_length(total);
                bar.set_position(done);
                bar.set_message(what.to_owned());
            }
            Show::Plain(lines) if lines.due(share) => {
                let name = &self.name;
                output::note(&match self.count {
                    Count::Images => format!("{name}: {done} of {total} images, {what}"),
                    Count::Percent => format!("{name}: {:.0} %, {what}", 100.0 * share),
                });
            }
            Show::Json(last) => {
                let mut last = last.lock().expect("no thread panics while it looks");
                if last.is_none_or(|last| last.elapsed() >= EVERY) {
                    *last = Some(Instant::now());
                    self.event(done, total, share, what);
                }
            }
            Show::Plain(_) | Show::Nothing => {}
        }
    }

    fn event(&self, done: u64, total: u64, share: f64, what: &str) {
        let seconds = self.began.elapsed().as_secs_f64();
        let left = (share > 0.0).then(|| seconds * (1.0 - share) / share);
        events::emit(
            "progress",
            json!({
                "name": self.name,
                "what": what,
                "done": done,
                "total": total,
                "percent": 100.0 * share,
                "seconds": seconds,
                "seconds_left": left,
            }),
        );
    }

    /// Nothing more is shown.
    pub(in super::super) fn finish(&self) {
        if let Show::Bar(bar) = &self.show {
            bar.finish_and_clear();
        }
    }
}

/// Says why nothing came of a command.
pub(in super::super) fn fail(told: Told, error: &Error) {
    if told != Told::Json {
        return report::error(error);
    }
    for problem in error.problems() {
        event("error", problem);
    }
}

fn event(severity: &str, problem: &Problem) {
    let mut object = report::object(problem);
    object["severity"] = severity.into();
    events::emit("problem", object);
}

/// How warnings are told.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Voice {
    /// How progress is.
    pub(in super::super) told: Told,
    /// Not at all, but to programs.
    pub(in super::super) quiet: bool,
}

impl Voice {
    /// Tells what to be warned of.
    pub(in super::super) fn warn(self, error: &Error) {
        for problem in error.problems() {
            self.warn_of(problem);
        }
    }

    /// Tells something to be warned of.
    pub(in super::super) fn warn_of(self, problem: &Problem) {
        match self.told {
            Told::Json => event("warning", problem),
            _ if self.quiet => {}
            _ => report::warnings(std::slice::from_ref(problem)),
        }
    }
}

/// Says that a command ends, with what it says of itself.
pub(in super::super) fn done(told: Told, status: u8) {
    if told == Told::Json {
        events::emit("done", json!({ "status": status }));
    }
}
