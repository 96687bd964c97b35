//! How much memory may be taken, asked before it is taken. Whoever reads a file opens an [`Account`] for it, asks there
//! for what the file promises to need, and keeps in the end what stands in memory. A budget also hears of a signal, so
//! that reading can be ended wherever it asks.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use crate::error::{Error, Result};

/// What may be taken in all; clones share it. By default there is no limit.
#[derive(Clone, Debug, Default)]
pub struct Budget(Arc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    /// In bytes; `None`: no limit.
    limit: Option<u64>,
    taken: AtomicU64,
    /// Whether to stop.
    stop: Arc<AtomicBool>,
}

impl Budget {
    /// So many bytes, or any number.
    pub fn new(limit: Option<u64>) -> Self {
        Self::until(limit, Arc::default())
    }

    /// The same; nothing more is given once `stop` is set.
    pub fn until(limit: Option<u64>, stop: Arc<AtomicBool>) -> Self {
        Self(Arc::new(Shared {
            limit,
            taken: AtomicU64::new(0),
            stop,
        }))
    }

    /// The limit in bytes, if there is one.
    pub fn limit(&self) -> Option<u64> {
        self.0.limit
    }

    /// Bytes that are left, if there is a limit.
    pub fn left(&self) -> Option<u64> {
        let taken = self.0.taken.load(Ordering::Relaxed);
        self.0.limit.map(|limit| limit.saturating_sub(taken))
    }

    /// Begins anew: `bytes` are taken and nothing else is.
    pub fn begin(&self, bytes: u64) {
        self.0.taken.store(bytes, Ordering::Relaxed);
    }

    /// Takes `bytes`.
    ///
    /// # Errors
    /// Where so many are not left, or a signal has asked to stop.
    pub fn take(&self, bytes: u64) -> Result<()> {
        self.take_for(bytes, "this")
    }

    /// Takes `bytes` for something, `what` in an error.
    fn take_for(&self, bytes: u64, what: &str) -> Result<()> {
        self.check_stop()?;
        let limit = self.0.limit.unwrap_or(u64::MAX);
        let more = |taken: u64| taken.checked_add(bytes).filter(|sum| *sum <= limit);
        let taken = self
            .0
            .taken
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, more);
        taken.map(drop).map_err(|taken| {
            let (bytes, left) = (human_bytes(bytes), human_bytes(limit.saturating_sub(taken)));
            let limit = human_bytes(limit);
            Error::input(format!(
                "{what} takes {bytes} of memory, and {left} are left of the limit of {limit}"
            ))
            .help("make it smaller, or raise the limit (--memory-limit)")
        })
    }

    /// Gives `bytes` back.
    fn give_back(&self, bytes: u64) {
        let less = |taken: u64| Some(taken.saturating_sub(bytes));
        let update = (self.0.taken).fetch_update(Ordering::Relaxed, Ordering::Relaxed, less);
        update.expect("there is always less");
    }

    /// An error where a signal has asked to stop.
    fn check_stop(&self) -> Result<()> {
        match self.0.stop.load(Ordering::Relaxed) {
            true => Err(Error::input("stopped by a signal")),
            false => Ok(()),
        }
    }

    /// Opens an account.
    pub fn open(&self) -> Account {
        Account {
            budget: self.clone(),
            taken: AtomicU64::new(0),
        }
    }
}

/// What one file takes of a [`Budget`], by default of one without a limit; what is not kept goes back.
#[derive(Debug, Default)]
pub struct Account {
    budget: Budget,
    taken: AtomicU64,
}

impl Account {
    /// Takes `bytes`.
    ///
    /// # Errors
    /// As [`Budget::take`].
    pub fn take(&self, bytes: u64) -> Result<()> {
        self.take_for(bytes, "this")
    }

    /// Takes `bytes` for something, `what` in an error.
    ///
    /// # Errors
    /// As [`Budget::take`].
    pub fn take_for(&self, bytes: u64, what: &str) -> Result<()> {
        self.budget.take_for(bytes, what)?;
        self.taken.fetch_add(bytes, Ordering::Relaxed);
        Ok(())
    }

    /// Takes `count` times `size` bytes.
    ///
    /// # Errors
    /// As [`Budget::take`].
    pub fn take_rows(&self, count: impl TryInto<u64>, size: usize) -> Result<()> {
        let count = count.try_into().unwrap_or(u64::MAX);
        self.take(count.saturating_mul(size as u64))
    }

    /// Takes what `bytes`, a number that grows, is more than `covered`.
    ///
    /// # Errors
    /// As [`Budget::take`].
    pub fn cover(&self, covered: &mut u64, bytes: u64) -> Result<()> {
        if bytes > *covered {
            self.take(bytes - *covered)?;
            *covered = bytes;
        }
        Ok(())
    }

    /// Bytes that are left, if there is a limit.
    pub fn left(&self) -> Option<u64> {
        self.budget.left()
    }

    /// Goes on with nothing taken.
    pub fn clear(&self) {
        self.budget.give_back(self.taken.swap(0, Ordering::Relaxed));
    }

    /// Keeps `bytes`, however many were taken.
    pub fn keep(self, bytes: u64) {
        self.clear();
        self.budget.0.taken.fetch_add(bytes, Ordering::Relaxed);
    }
}

impl Drop for Account {
    fn drop(&mut self) {
        self.clear();
    }
}

/// A number of bytes as people say it: `3.2 GB`.
pub fn human_bytes(bytes: u64) -> String {
    let mut value = bytes as f64;
    for unit in ["B", "kB", "MB", "GB"] {
        if value < 999.5 {
            let digits = usize::from(unit != "B" && value < 99.95);
            return format!("{value:.digits$} {unit}");
        }
        value /= 1000.0;
    }
    format!("{value:.1} TB")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_more_than_is_left_is_refused_and_what_is_not_kept_goes_back() {
        let budget = Budget::new(Some(1000));
        let account = budget.open();
        account.take(600).unwrap();
        let said = account.take_rows(101_usize, 4).unwrap_err().to_string();
        assert!(
            said.contains("takes 404 B of memory, and 400 B are left of the limit of 1.0 kB"),
            "{said}"
        );
        assert!(account.take(u64::MAX).is_err());
        let mut covered = 100;
        account.cover(&mut covered, 500).unwrap();
        account.cover(&mut covered, 300).unwrap();
        assert_eq!((covered, budget.left()), (500, Some(0)));
        account.keep(70);
        assert_eq!(budget.left(), Some(930));
        drop(budget.open());
        budget.open().take(930).unwrap();
        assert_eq!(budget.clone().left(), Some(930));
        budget.begin(0);
        assert_eq!(budget.left(), Some(1000));
    }

    #[test]
    fn without_a_limit_only_a_signal_ends_it() {
        let stop = Arc::new(AtomicBool::new(false));
        let budget = Budget::until(None, stop.clone());
        budget.open().take(1 << 60).unwrap();
        stop.store(true, Ordering::Relaxed);
        let said = budget.take(0).unwrap_err().to_string();
        assert_eq!(said, "stopped by a signal");
    }

    #[test]
    fn bytes_are_said_in_three_digits() {
        for (bytes, said) in [
            (0, "0 B"),
            (999, "999 B"),
            (1000, "1.0 kB"),
            (123_456_789, "123 MB"),
            (8_000_000_000, "8.0 GB"),
        ] {
            assert_eq!(human_bytes(bytes), said);
        }
    }
}
