//! Signals: the first of Ctrl-C, SIGTERM (as batch systems send it) and SIGHUP asks the render to come to
//! an end, a second one ends the process at once.

use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Instant;

use etendue::error::{Error, Result};
use etendue::file;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use signal_hook::iterator::Signals;

use super::status;

/// Whether a render should come to an end.
#[derive(Clone, Debug, Default)]
pub(super) struct Stop {
    signalled: Arc<AtomicBool>,
    /// Set by SIGUSR1: the image is to be seen as it stands.
    wish: Arc<AtomicBool>,
    deadline: Option<Instant>,
}

impl Stop {
    /// Listens to the signals from now on.
    pub(super) fn on_signals() -> Result<Self> {
        let signalled = Arc::new(AtomicBool::new(false));
        for signal in wanted() {
            // In this order: the flag is not set yet when the first signal asks for it.
            flag::register_conditional_shutdown(
                signal,
                status::INTERRUPTED.into(),
                signalled.clone(),
            )
            .and_then(|_| flag::register(signal, signalled.clone()))
            .map_err(refused)?;
        }
        Ok(Self {
            signalled,
            wish: Arc::default(),
            deadline: None,
        })
    }

    /// Ends the process with the system's status where memory cannot be had: Rust says so and aborts.
    pub(super) fn instead_of_aborts() {
        #[cfg(unix)]
        {
            let always = Arc::new(AtomicBool::new(true));
            let abort = signal_hook::consts::SIGABRT;
            // Where that cannot be arranged the process aborts.
            flag::register_conditional_shutdown(abort, status::SYSTEM.into(), always).ok();
        }
    }

    /// Ends the process at the first signal, without what it has begun to write as one of `outputs`: for what
    /// cannot be finished early.
    pub(super) fn without_a_trace(outputs: Vec<PathBuf>) -> Result<()> {
        let mut signals = Signals::new(wanted()).map_err(refused)?;
        thread::spawn(move || {
            if signals.forever().next().is_some() {
                outputs
                    .iter()
                    .for_each(|path| file::remove_unfinished(path));
                std::process::exit(status::INTERRUPTED.into());
            }
        });
        Ok(())
    }

    /// The same, and asks to stop at `deadline` too.
    pub(super) fn by(&self, deadline: Option<Instant>) -> Self {
        Self {
            signalled: self.signalled.clone(),
            wish: self.wish.clone(),
            deadline,
        }
    }

    /// Listens to SIGUSR1, where there is such a signal.
    pub(super) fn hear_wishes(&self) -> Result<()> {
        #[cfg(unix)]
        flag::register(signal_hook::consts::SIGUSR1, self.wish.clone()).map_err(refused)?;
        Ok(())
    }

    /// Whether there was a wish to see the image as it stands, which is none any more.
    pub(super) fn take_wish(&self) -> bool {
        self.wish.load(Ordering::Relaxed) && self.wish.swap(false, Ordering::Relaxed)
    }

    /// Set once a signal came.
    pub(super) fn flag(&self) -> Arc<AtomicBool> {
        self.signalled.clone()
    }

    /// Whether a signal came.
    pub(super) fn signalled(&self) -> bool {
        self.signalled.load(Ordering::Relaxed)
    }

    /// Whether to stop, for whatever reason.
    pub(super) fn asked(&self) -> bool {
        self.signalled() || self.deadline.is_some_and(|d| Instant::now() >= d)
    }
}

/// The signals that ask for an end.
fn wanted() -> Vec<i32> {
    let mut signals = vec![SIGINT, SIGTERM];
    #[cfg(unix)]
    signals.push(signal_hook::consts::SIGHUP);
    signals.retain(|signal| !is_ignored(*signal));
    signals
}

fn refused(error: io::Error) -> Error {
    Error::input(format!("cannot listen to signals: {error}"))
}

/// Whether the caller arranged for a signal to be ignored, as `nohup` does with SIGHUP: then it stays so.
/// Known on Linux only.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status
        .lines()
        .find_map(|line| line.strip_prefix("SigIgn:"))
        .and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}
