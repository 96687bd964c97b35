//! A progress bar on standard error, where that is a terminal; and the way by which a signal or a time
//! limit reaches the render.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use etendue::render::{Phase, Progress};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::stop::Stop;

/// Shows the phases of one render after another.
pub(super) struct Bar {
    bar: ProgressBar,
    name: String,
    rays: AtomicU64,
    samples: AtomicU64,
    /// When the phase began, and when its rates were last shown.
    clock: Mutex<(Instant, Instant)>,
    stop: Stop,
    /// Whether it was said that the render is coming to an end.
    said: AtomicBool,
}

impl Bar {
    /// For the render called `name`; hidden where `quiet`, and where standard error is no terminal.
    pub(super) fn new(name: &str, quiet: bool, stop: Stop) -> Self {
        let target = if quiet {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr_with_hz(5)
        };
        Self {
            bar: ProgressBar::with_draw_target(Some(0), target),
            name: name.to_owned(),
            rays: AtomicU64::new(0),
            samples: AtomicU64::new(0),
            clock: Mutex::new((Instant::now(), Instant::now())),
            stop,
            said: AtomicBool::new(false),
        }
    }

    /// Takes the bar away.
    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// How often the rates are computed.
const REFRESH: Duration = Duration::from_millis(200);

impl Progress for Bar {
    fn begin(&self, phase: Phase, total: u64) {
        let (verb, template) = match phase {
            Phase::Load => ("loading", "{prefix} [{bar:30}] {pos}/{len} shapes"),
            Phase::Build => ("building", "{prefix} {elapsed}"),
            Phase::Render => (
                "rendering",
                "{prefix} [{bar:30}] {percent:>3} % {msg}, {eta} left",
            ),
        };
        self.bar.reset();
        self.bar.set_length(total);
        self.bar.set_prefix(format!("{verb} {}", self.name));
        self.bar
            .set_style(ProgressStyle::with_template(template).expect("the template is right"));
        *self
            .clock
            .lock()
            .expect("no thread panics while it reads the clock") = (Instant::now(), Instant::now());
    }

    fn advance(&self, steps: u64, rays: u64) {
        self.bar.inc(steps);
        let rays = self.rays.fetch_add(rays, Ordering::Relaxed) + rays;
        let samples = self.samples.fetch_add(steps, Ordering::Relaxed) + steps;
        let Ok(mut clock) = self.clock.try_lock() else {
            return;
        };
        if clock.1.elapsed() > REFRESH {
            clock.1 = Instant::now();
            let rate = |n: u64| n as f64 / clock.0.elapsed().as_secs_f64() * 1e-6;
            self.bar.set_message(format!(
                "{:.2} M samples/s, {:.2} M rays/s",
                rate(samples),
                rate(rays)
            ));
        }
    }

    fn stop(&self) -> bool {
        let asked = self.stop.asked();
        if asked && self.stop.signalled() && !self.said.swap(true, Ordering::Relaxed) {
            self.bar
                .println("finishing the tiles under way; a second signal ends at once");
        }
        asked
    }
}
