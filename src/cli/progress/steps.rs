//! Lines of text now and then, where standard error is no terminal: for commands whose steps are whole renders.

use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::cli::output;

/// The time between two lines.
const EVERY: Duration = Duration::from_secs(10);

/// Writes lines, not too many.
#[derive(Debug)]
pub(in super::super) struct StepLines {
    /// When the last line came; `None`: nobody wants any.
    last: Option<Mutex<Instant>>,
}

impl StepLines {
    /// None at all where `quiet`, and on a terminal, which has a bar.
    pub(in super::super) fn new(quiet: bool) -> Self {
        let wanted = !quiet && !std::io::stderr().is_terminal();
        Self {
            last: wanted.then(|| Mutex::new(Instant::now())),
        }
    }

    /// Writes the line if it is time.
    pub(in super::super) fn say(&self, line: impl FnOnce() -> String) {
        let Some(last) = &self.last else { return };
        let mut last = last.lock().expect("no thread panics while it looks");
        if last.elapsed() >= EVERY {
            *last = Instant::now();
            output::note(&line());
        }
    }
}
