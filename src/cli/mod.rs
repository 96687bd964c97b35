//! The command line: one file a command, and a table of them. Nothing below this layer prints.
//!
//! Exit status: 0 done; 1 the input is wrong or asks for what Étendue lacks; 2 the command line is wrong;
//! 3 the system refused (a file that cannot be read or written).

mod output;
mod progress;
mod render;
mod report;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use etendue::error::{Error, Kind};

/// Étendue: a CPU ray tracer for Mitsuba 3 scenes and bare meshes.
#[derive(Debug, Parser)]
#[command(version, about, after_help = EXIT_STATUS, max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

const EXIT_STATUS: &str = "\
Exit status: 0 done; 1 the input is wrong or asks for what Étendue lacks; 2 the command line is wrong; \
3 the system refused, such as a file that cannot be written.";

/// The commands.
#[derive(Debug, Subcommand)]
enum Command {
    Render(render::Arguments),
}

/// Runs the command that the arguments name.
pub(crate) fn run() -> ExitCode {
    let result = match Arguments::parse().command {
        Command::Render(arguments) => render::run(&arguments),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            report::error(&error);
            ExitCode::from(status(&error))
        }
    }
}

/// The exit status for an error: the gravest of its problems'.
fn status(error: &Error) -> u8 {
    match error.problems().iter().map(|p| p.kind).max() {
        Some(Kind::System) => 3,
        _ => 1,
    }
}
