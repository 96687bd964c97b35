//! The problems of one scene, up to as many as a user can make use of: a broken generator makes millions,
//! and finding a suggestion for each takes time.

use crate::error::{Error, Problems, Result};

/// Problems that are listed.
const MOST: usize = 100;
/// Names that a misspelt one is compared with.
pub(super) const CANDIDATES: usize = 5000;

#[derive(Debug, Default)]
pub(super) struct Report {
    problems: Problems,
    count: usize,
}

impl Report {
    /// Notes the problem; the last for which there is room is followed by a word that there may be more.
    pub(super) fn push(&mut self, error: Error) {
        if self.is_full() {
            return;
        }
        self.count += error.problems().len();
        self.problems.push(error);
        if self.is_full() {
            self.problems.push(Error::input(
                "too many problems: the rest was not looked at",
            ));
        }
    }

    /// Leaves no room for more, as after `error` there is no use in going on.
    pub(super) fn close(&mut self, error: Error) {
        if !self.is_full() {
            self.problems.push(error);
            self.count = MOST;
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.problems.is_empty()
    }

    pub(super) fn is_full(&self) -> bool {
        self.count >= MOST
    }

    pub(super) fn finish(self) -> Result<()> {
        self.problems.finish()
    }
}
