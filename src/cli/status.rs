//! Exit statuses.

use etendue::error::{Error, Kind};

/// All is well.
pub(super) const DONE: u8 = 0;
/// The input is wrong or asks for what Étendue lacks.
pub(super) const INPUT: u8 = 1;
/// The command line is wrong: clap's own.
pub(super) const USAGE: u8 = 2;
/// Compared images differ.
pub(super) const DIFFERS: u8 = 1;
/// Images cannot be compared.
pub(super) const CANNOT_COMPARE: u8 = 2;
/// The system refused.
pub(super) const SYSTEM: u8 = 3;
/// A signal asked to stop; what was complete is written.
pub(super) const INTERRUPTED: u8 = 130;

/// As `--help` says it; clap itself answers a wrong command line with 2.
pub(super) const HELP: &str = "\
Exit status: 0 done; 1 the input is wrong or asks for what Étendue lacks; 2 the command line is wrong; \
3 the system refused, such as a file that cannot be written; 130 stopped by Ctrl-C, SIGTERM or SIGHUP \
after writing what was complete. Of several images the gravest counts.";

/// The exit status for an error: the gravest of its problems'.
pub(super) fn of(error: &Error) -> u8 {
    match error.problems().iter().map(|p| p.kind).max() {
        Some(Kind::System) => SYSTEM,
        _ => INPUT,
    }
}
