//! `etendue mesh`: a command for each thing that is done to meshes without rendering them.

mod convert;
mod generate;
mod report;

use clap::{Args, Subcommand};
use etendue::error::Result;

use super::status;

/// Convert, generate and examine meshes
#[derive(Args, Debug)]
#[command(after_help = status::HELP)]
pub(super) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Convert(convert::Arguments),
    Generate(generate::Arguments),
    Report(report::Arguments),
}

/// Runs the command; the answer is the exit status.
pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    match &arguments.command {
        Command::Convert(arguments) => convert::run(arguments),
        Command::Generate(arguments) => generate::run(arguments),
        Command::Report(arguments) => report::run(arguments),
    }
}
