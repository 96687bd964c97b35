//! How much memory a command may take: what is said, else most of what is free.

use std::num::NonZeroUsize;

use clap::Args;
use etendue::budget::Budget;

use super::stop::Stop;
use super::{available, parse};

pub(super) const RUN: &str = "The run";

/// The most memory to take.
#[derive(Args, Clone, Copy, Debug)]
pub(super) struct MemoryArguments {
    /// Refuse to take more memory, such as 8G; "none" for no limit. By default 90 % of what is free
    #[arg(long, value_name = "SIZE", value_parser = parse::bytes, help_heading = RUN)]
    memory_limit: Option<u64>,
}

/// What a run may take of the machine.
#[derive(Args, Clone, Copy, Debug)]
pub(super) struct RunArguments {
    #[command(flatten)]
    pub(super) memory: MemoryArguments,
    /// Threads; 0, the default, is one a processor. The image does not depend on it
    #[arg(long, value_name = "N", value_parser = parse::threads, allow_negative_numbers = true, help_heading = RUN)]
    pub(super) threads: Option<NonZeroUsize>,
}

impl MemoryArguments {
    /// The option as it was given, for another call of the command.
    pub(super) fn words(&self) -> Option<String> {
        self.memory_limit.map(|limit| match limit {
            u64::MAX => "--memory-limit=none".to_owned(),
            bytes => format!("--memory-limit={bytes}"),
        })
    }

    /// What may be taken. Ask before anything is loaded, for what is loaded counts as taken.
    pub(super) fn budget(&self) -> Budget {
        Budget::new(limit(self.memory_limit))
    }

    /// The same; a signal ends reading.
    pub(super) fn budget_until(&self, stop: &Stop) -> Budget {
        Budget::until(limit(self.memory_limit), stop.flag())
    }
}

/// The limit that is given, else 90 % of what is free to this process.
pub(super) fn limit(given: Option<u64>) -> Option<u64> {
    given.or_else(|| available::bytes().map(|free| free / 10 * 9))
}
