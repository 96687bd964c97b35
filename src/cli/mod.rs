//! The command line: one file a command, and a table of them. Nothing below this layer prints.
//!
//! Exit status: 0 done; 1 the input is wrong or asks for what Étendue lacks; 2 the command line is wrong;
//! 3 the system refused (a file that cannot be read or written); 130 stopped by a signal, after writing
//! what was complete. Of several images the gravest counts. `compare` and `crosscheck` answer with
//! 0 agree, 1 differ, 2 cannot compare.

mod batch;
mod check;
mod color;
mod compare;
mod convert;
mod crosscheck;
mod denoise;
mod info;
mod merge;
mod mesh;
mod plugins;
mod profile;
mod relight;
mod render;
mod spectrum;

mod available;
mod display;
mod folders;
mod growth;
mod hints;
mod images;
mod memory;
mod oracle;
mod output;
mod overrides;
mod page;
mod parse;
mod progress;
mod report;
mod scene;
mod staging;
mod status;
mod stereo;
mod stop;
mod summary;
mod tev;
mod turntable;
mod verdicts;
mod version;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches as _, Parser, Subcommand};

/// Étendue: a CPU ray tracer for Mitsuba 3 scenes and bare meshes.
#[derive(Debug, Parser)]
#[command(version = version::text(), about, after_help = status::HELP, max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
enum Command {
    Render(Box<render::Arguments>),
    Batch(batch::Arguments),
    Check(check::Arguments),
    Color(color::Arguments),
    Compare(Box<compare::Arguments>),
    Convert(convert::Arguments),
    Crosscheck(Box<crosscheck::Arguments>),
    Denoise(denoise::Arguments),
    Info(info::Arguments),
    Merge(merge::Arguments),
    Mesh(mesh::Arguments),
    Plugins(plugins::Arguments),
    Profile(Box<profile::Arguments>),
    Relight(relight::Arguments),
    Spectrum(spectrum::Arguments),
    /// Étendue's side of a crosscheck, which starts it: answers orders on standard input
    #[command(hide = true)]
    CrosscheckWorker,
}

/// The name of the hidden command that serves [`Command::Crosscheck`].
const CROSSCHECK_WORKER: &str = "crosscheck-worker";

impl Arguments {
    /// What the words of a command line say, its own name first.
    fn of(words: &[OsString]) -> Result<Self, clap::Error> {
        let command = with_negative_numbers(Self::command());
        let parsed = command.clone().try_get_matches_from(words);
        parsed
            .and_then(|matches| Self::from_arg_matches(&matches))
            .map_err(|error| hints::better(error, &command, words))
    }
}

/// A number below 0 is an option's value, so that it is the option that says what it takes.
fn with_negative_numbers(command: clap::Command) -> clap::Command {
    let command = command.mut_args(|argument| match argument.get_action().takes_values() {
        true => argument.allow_negative_numbers(true),
        false => argument,
    });
    command.mut_subcommands(with_negative_numbers)
}

/// Runs the command that the arguments name.
pub(crate) fn run() -> ExitCode {
    stop::Stop::instead_of_aborts();
    let words: Vec<_> = std::env::args_os().collect();
    let arguments = Arguments::of(&words).unwrap_or_else(|error| error.exit());
    let result = match arguments.command {
        Command::Render(arguments) => render::run(&arguments),
        Command::Batch(arguments) => batch::run(&arguments),
        Command::Check(arguments) => check::run(&arguments),
        Command::Color(arguments) => color::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Convert(arguments) => convert::run(&arguments),
        Command::Crosscheck(arguments) => crosscheck::run(&arguments),
        Command::Denoise(arguments) => denoise::run(&arguments),
        Command::Info(arguments) => info::run(&arguments),
        Command::Merge(arguments) => merge::run(&arguments),
        Command::Mesh(arguments) => mesh::run(&arguments),
        Command::Plugins(arguments) => plugins::run(&arguments),
        Command::Profile(arguments) => profile::run(&arguments),
        Command::Relight(arguments) => relight::run(&arguments),
        Command::Spectrum(arguments) => spectrum::run(&arguments),
        Command::CrosscheckWorker => crosscheck::serve(),
    };
    let status = result.unwrap_or_else(|error| {
        report::error(&error);
        status::of(&error)
    });
    ExitCode::from(match output::failure() {
        Some(error) => {
            report::error(&error);
            status.max(status::SYSTEM)
        }
        None => status,
    })
}
