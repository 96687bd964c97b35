//! The Python that drives Mitsuba: the one that is named, else that of the environment that `tools/venv`
//! makes, else the system's.

use std::env;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// The environment variable that names a Python.
pub const VARIABLE: &str = "ETENDUE_PYTHON";
/// How to get one that has Mitsuba.
pub(super) const HELP: &str = "tools/venv makes an environment with Mitsuba in target/venv, where it is found; \
    or name a Python that has it by --python or ETENDUE_PYTHON";

/// Finds the Python to use. `named` goes first; then the variable `ETENDUE_PYTHON`; then the environment
/// beside the folder of `executable` (`target/venv` for `target/release/etendue`) or below the current
/// folder; then `python3` on the path. Whether it has Mitsuba turns out when it is started.
///
/// # Errors
/// Where there is none, or the one that is named is not there.
pub fn find_python(named: Option<&Path>, executable: &Path) -> Result<PathBuf> {
    let variable = env::var_os(VARIABLE).filter(|v| !v.is_empty());
    let named = named.map(Path::to_owned).or(variable.map(PathBuf::from));
    if let Some(python) = named {
        return on_path(&python).ok_or_else(|| {
            Error::input(format!("there is no Python {}", python.display())).help(HELP)
        });
    }
    let beside = executable.parent().and_then(Path::parent);
    let environments = [beside, Some(Path::new("target"))];
    let inside = if cfg!(windows) {
        "venv/Scripts/python.exe"
    } else {
        "venv/bin/python"
    };
    environments
        .into_iter()
        .flatten()
        .map(|folder| folder.join(inside))
        .find(|python| python.is_file())
        .or_else(|| on_path(Path::new("python3")))
        .ok_or_else(|| Error::input("there is no Python to run Mitsuba with").help(HELP))
}

/// The file, which is sought on the path where it is a bare name.
fn on_path(program: &Path) -> Option<PathBuf> {
    if program.components().count() > 1 {
        return program.is_file().then(|| program.to_owned());
    }
    let folders = env::var_os("PATH")?;
    env::split_paths(&folders)
        .map(|folder| folder.join(program))
        .find(|file| file.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_python_that_is_named_and_not_there_is_an_error_that_helps() {
        let named = Path::new("no/such/python");
        let error = find_python(Some(named), Path::new("etendue")).unwrap_err();
        let text = error.to_string();
        assert!(
            text.contains("no/such/python") && text.contains("tools/venv"),
            "{text}"
        );
    }

    #[test]
    fn the_environment_beside_the_program_goes_before_the_path() {
        let folder = tempfile::tempdir().unwrap();
        let python = folder.path().join(if cfg!(windows) {
            "venv/Scripts/python.exe"
        } else {
            "venv/bin/python"
        });
        std::fs::create_dir_all(python.parent().unwrap()).unwrap();
        std::fs::write(&python, "").unwrap();
        let found = find_python(None, &folder.path().join("release/etendue")).unwrap();
        if env::var_os(VARIABLE).is_none() {
            assert_eq!(found, python);
        }
    }
}
