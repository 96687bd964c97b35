//! Progress as lines of text on standard error, for logs: the first after ten seconds; then one when ten more have passed
//! and five per cent more are done, and one a minute at least.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use etendue::render::{Phase, human_duration};

use super::State;
use crate::cli::output;

/// The shortest and the longest time between two lines.
const SHORTEST: Duration = Duration::from_secs(10);
const LONGEST: Duration = Duration::from_secs(60);
/// What is done between two lines within that.
const SHARE: f64 = 0.05;
/// So little was told of a phase before its first line that this is due after the shortest time.
const NOTHING: f64 = -1.0;

/// When the last line was written, and what was done then.
#[derive(Debug)]
pub(super) struct Lines(Mutex<(Instant, f64)>);

impl Lines {
    pub(super) fn new() -> Self {
        Self(Mutex::new((Instant::now(), NOTHING)))
    }

    pub(super) fn begin(&self) {
        self.0.lock().expect("no thread panics while it looks").1 = NOTHING;
    }

    pub(super) fn advance(&self, state: &State<'_>) {
        if self.due(state.share()) {
            output::note(&line(state));
        }
    }

    /// Whether it is time for a line, which then counts as written; `share` is what is done, in [0, 1].
    pub(super) fn due(&self, share: f64) -> bool {
        let mut last = self.0.lock().expect("no thread panics while it looks");
        let silent = last.0.elapsed();
        let due = silent >= SHORTEST && (silent >= LONGEST || share - last.1 >= SHARE);
        if due {
            *last = (Instant::now(), share);
        }
        due
    }
}

/// `scene.xml: rendering, 35 %, 1.20 M samples/s, 8.10 M rays/s, 2 min 5 s left`
fn line(state: &State<'_>) -> String {
    let percent = 100.0 * state.share();
    let name = state.name;
    match state.phase {
        Phase::Load => format!("{name}: loading, {} of {} shapes", state.done, state.total),
        Phase::Build => format!("{name}: building, {}", human_duration(state.elapsed)),
        Phase::Render => {
            let [samples, rays] = state.rates().map(|rate| rate * 1e-6);
            let left = match state.left() {
                Some(left) => format!(", {} left", human_duration(left)),
                None => String::new(),
            };
            format!(
                "{name}: rendering, {percent:.0} %, {samples:.2} M samples/s, {rays:.2} M rays/s{left}"
            )
        }
    }
}
