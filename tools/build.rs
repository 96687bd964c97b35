//! Tells the program which target it is built for and, where it is built to be installed (the profile `dist`) or
//! ETENDUE_COMMIT says so, of which commit: other builds would be made anew after each commit.

use std::env;
use std::io::{self, Write};
use std::path::Path;
use std::process::Command;

fn main() -> io::Result<()> {
    let mut out = io::stdout();
    writeln!(out, "cargo::rerun-if-changed=tools/build.rs")?;
    writeln!(out, "cargo::rerun-if-env-changed=ETENDUE_COMMIT")?;
    let target = env::var("TARGET").unwrap_or_default();
    writeln!(out, "cargo::rustc-env=ETENDUE_TARGET={target}")?;
    let mut commit = env::var("ETENDUE_COMMIT").ok();
    if commit.is_none() && is_dist() {
        if let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"]) {
            writeln!(out, "cargo::rerun-if-changed={log}")?;
        }
        commit = git(&["describe", "--always", "--dirty", "--abbrev=12"]);
    }
    let commit = commit.unwrap_or_else(|| "unknown".to_owned());
    writeln!(out, "cargo::rustc-env=ETENDUE_BUILT_OF={commit}")
}

/// Whether this is the profile `dist`, which only the folder tells.
fn is_dist() -> bool {
    let folder = env::var_os("OUT_DIR").unwrap_or_default();
    Path::new(&folder).iter().any(|part| part == "dist")
}

/// What git answers, where there is one and a repository.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}
