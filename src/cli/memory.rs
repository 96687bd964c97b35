//! How much memory a command may take: what is said, else most of what is free.

use std::num::NonZeroUsize;

use clap::Args;

use super::parse;

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
    /// Threads; one a processor by default. The image does not depend on it
    #[arg(long, value_name = "N", value_parser = parse::threads, help_heading = RUN)]
    pub(super) threads: Option<NonZeroUsize>,
}

impl MemoryArguments {
    /// In bytes. Ask before anything is loaded, for what is loaded counts as taken.
    pub(super) fn limit(&self) -> Option<u64> {
        limit(self.memory_limit)
    }
}

/// The limit that is given, else 90 % of what is free.
pub(super) fn limit(given: Option<u64>) -> Option<u64> {
    given.or_else(|| available().map(|free| free / 10 * 9))
}

/// Bytes that programs can still take without swapping; known on Linux only.
fn available() -> Option<u64> {
    parse(&std::fs::read_to_string("/proc/meminfo").ok()?)
}

fn parse(meminfo: &str) -> Option<u64> {
    let line = meminfo
        .lines()
        .find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kibibytes.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_available_is_read_and_what_is_odd_is_not_believed() {
        let text = "MemTotal:       16 kB\nMemAvailable:    3 kB\n";
        assert_eq!(parse(text), Some(3072));
        for odd in [
            "",
            "MemAvailable: kB",
            "MemAvailable: 99999999999999999999 kB",
        ] {
            assert_eq!(parse(odd), None, "{odd}");
        }
    }
}
