//! Where results go: patterns for the names of output files, and lines on standard output.

use std::io::Write;
use std::path::{Path, PathBuf};

use etendue::error::{Error, Result};

/// The output file for an input: `{name}` stands for the input's name without folder and extension.
pub(super) fn expand(pattern: &str, input: &Path) -> PathBuf {
    let name = input.file_stem().unwrap_or_default().to_string_lossy();
    PathBuf::from(pattern.replace("{name}", &name))
}

/// The output file of each input; several inputs need names of their own.
pub(super) fn expand_all(pattern: &str, inputs: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let outputs: Vec<PathBuf> = inputs.iter().map(|input| expand(pattern, input)).collect();
    for (i, output) in outputs.iter().enumerate() {
        if let Some(j) = outputs[..i].iter().position(|other| other == output) {
            return Err(Error::input(format!(
                "{} and {} would both be written to {}",
                inputs[j].display(),
                inputs[i].display(),
                output.display()
            ))
            .help("give each an output of its own, such as -o out/{name}.exr"));
        }
    }
    Ok(outputs)
}

/// A line on standard output. A reader that has gone away is no error of ours.
pub(super) fn line(text: &str) {
    let _ = writeln!(std::io::stdout(), "{text}");
}
