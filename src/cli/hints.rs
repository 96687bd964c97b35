//! What is wrong with a command line, told by clap, with better hints where clap guesses by letters: options by the names
//! that they have elsewhere, the commands that there are, whole numbers.

use std::ffi::OsString;
use std::path::Path;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Command, Error};

/// What options are called elsewhere, and here.
const ELSEWHERE: &[(&str, &str)] = &[
    ("--angle", "--azimuth"),
    ("--angles", "--azimuth"),
    ("--bounces", "--max-depth"),
    ("--camera", "--sensor"),
    ("--cores", "--threads"),
    ("--define", "-D"),
    ("--depth", "--max-depth"),
    ("--height", "--size"),
    ("--jobs", "--threads"),
    ("--memory", "--memory-limit"),
    ("--noise", "--noise-threshold"),
    ("--region", "--crop"),
    ("--resolution", "--size"),
    ("--rotate", "--azimuth"),
    ("--sample-count", "--spp"),
    ("--samples", "--spp"),
    ("--samples-per-pixel", "--spp"),
    ("--time", "--time-limit"),
    ("--timeout", "--time-limit"),
    ("--tonemap", "--view"),
    ("--verbose", "--stats"),
    ("--width", "--size"),
    ("--window", "--crop"),
];

/// `error`, which `command` has with these words of a command line, its own name first, with better hints.
pub(super) fn better(mut error: Error, command: &Command, words: &[OsString]) -> Error {
    let text = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.clone()),
        _ => None,
    };
    let reached = reached(command, words);
    match error.kind() {
        ErrorKind::UnknownArgument => {
            let Some(option) = text(ContextKind::InvalidArg).filter(|arg| arg.starts_with('-'))
            else {
                return error;
            };
            // Nobody means an option for a value.
            error.remove(ContextKind::Suggested);
            let here = ELSEWHERE.iter().find(|(elsewhere, _)| *elsewhere == option);
            if let Some((_, here)) = here.filter(|(_, here)| has(reached, here)) {
                error.insert(ContextKind::SuggestedArg, string(here));
                error.remove(ContextKind::Usage);
            }
        }
        ErrorKind::InvalidSubcommand => {
            if error.get(ContextKind::SuggestedSubcommand).is_some() {
                return error;
            }
            let word = text(ContextKind::InvalidSubcommand).unwrap_or_default();
            let is_file = Path::new(&word).extension().is_some() || Path::new(&word).exists();
            let tip = if is_file && std::ptr::eq(reached, command) {
                format!(
                    "to render it, write: {} render {word} -o out.png",
                    command.get_name()
                )
            } else {
                let names = reached.get_subcommands().filter(|c| !c.is_hide_set());
                let names: Vec<&str> = names.map(Command::get_name).collect();
                format!("there are {}", names.join(", "))
            };
            error.insert(ContextKind::Suggested, tips(tip));
        }
        ErrorKind::ValueValidation => {
            let source = std::error::Error::source(&error).map(ToString::to_string);
            if source.as_deref() != Some("invalid digit found in string") {
                return error;
            }
            // The words of Rust's library, which cannot be taken out.
            let mut plain = Error::new(ErrorKind::ValueValidation).with_cmd(command);
            for kind in [ContextKind::InvalidArg, ContextKind::InvalidValue] {
                if let Some(value) = error.get(kind) {
                    plain.insert(kind, value.clone());
                }
            }
            let tip = "write a whole number in digits, such as 64";
            plain.insert(ContextKind::Suggested, tips(tip.to_owned()));
            return plain;
        }
        _ => {}
    }
    error
}

fn string(text: &str) -> ContextValue {
    ContextValue::String(text.to_owned())
}

fn tips(text: String) -> ContextValue {
    ContextValue::StyledStrs(vec![text.into()])
}

/// The command that the words lead to.
fn reached<'c>(command: &'c Command, words: &[OsString]) -> &'c Command {
    let mut reached = command;
    for word in words.iter().skip(1) {
        match word.to_str().and_then(|word| reached.find_subcommand(word)) {
            Some(below) => reached = below,
            None if reached.has_subcommands() && word.to_string_lossy().starts_with('-') => {}
            None => break,
        }
    }
    reached
}

/// Whether the command has the option, `--long` or `-s`.
fn has(command: &Command, option: &str) -> bool {
    command.get_arguments().any(|argument| {
        let long = argument.get_long().map(|long| format!("--{long}"));
        let short = argument.get_short().map(|short| format!("-{short}"));
        [long, short].iter().flatten().any(|name| name == option)
    })
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;
    use crate::cli::Arguments;

    fn said(line: &str) -> String {
        let words: Vec<OsString> = line.split(' ').map(OsString::from).collect();
        Arguments::of(&words).expect_err("it is wrong").to_string()
    }

    #[test]
    fn names_from_elsewhere_lead_to_those_of_here() {
        let told = said("etendue render a.xml -o a.png --samples 16");
        assert!(
            told.contains("'--spp'") && !told.contains("sampler"),
            "{told}"
        );
        // Only to what the command has.
        let told = said("etendue mesh report a.ply --samples 16");
        assert!(
            !told.contains("--spp") && told.contains("'--samples'"),
            "{told}"
        );
        for (_, here) in ELSEWHERE {
            let command = Arguments::command();
            let render = command.find_subcommand("render").expect("it is there");
            assert!(has(render, here), "{here}");
        }
    }

    #[test]
    fn an_option_that_is_not_known_is_not_taken_for_a_value() {
        let told = said("etendue render a.xml -o a.png --xyzzy");
        assert!(told.contains("--xyzzy") && !told.contains("tip"), "{told}");
    }

    #[test]
    fn a_file_in_a_commands_place_and_kinds_that_are_not_there_are_answered() {
        assert!(said("etendue a.xml").contains("etendue render a.xml -o out.png"));
        assert!(said("etendue mesh generate teapot a.ply").contains("there are terrain, hair"));
        assert!(said("etendue rendr a.xml").contains("'render'"));
        assert!(said("etendue paint").contains("render, batch"));
    }

    #[test]
    fn whole_numbers_are_asked_for_in_words() {
        for line in [
            "etendue render a.xml -o a.png --spp 1e6",
            "etendue spectrum a.exr 5,5 1",
        ] {
            let told = said(line);
            assert!(
                told.contains("a whole number") && !told.contains("invalid digit"),
                "{told}"
            );
        }
    }
}
