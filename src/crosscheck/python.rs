//! The Python that drives Mitsuba: the one that is named, else the one in Étendue's own environment, which
//! [`install`] makes when it is asked to. None is sought in the folder that a command happens to run in.

use std::env;
use std::fmt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::error::{Error, Result};

/// The environment variable that names a Python.
pub const VARIABLE: &str = "ETENDUE_PYTHON";
/// How to get one that has Mitsuba.
pub(super) const HELP: &str = "name a Python that has Mitsuba by --python or ETENDUE_PYTHON, or let \
    `etendue crosscheck --install` make an environment of its own (in a checkout, tools/venv makes one)";
/// What [`install`] installs: the Mitsuba that images are held against, and what the plugins for it need.
const PACKAGES: [&str; 2] = ["mitsuba==3.9.1", "numpy"];

/// A Python, and who named it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Python {
    /// The program.
    pub path: PathBuf,
    /// In words.
    pub from: &'static str,
}

impl fmt::Display for Python {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({})", self.path.display(), self.from)
    }
}

/// Finds the Python to use: `named`, else that of the variable `ETENDUE_PYTHON`, else that of the environment in
/// [`home`]. Whether it has Mitsuba turns out when it is started.
///
/// # Errors
/// Where there is none, or the one that is named is not there.
pub fn find_python(named: Option<&Path>) -> Result<Python> {
    let variable = env::var_os(VARIABLE).filter(|v| !v.is_empty());
    let named = match (named, variable) {
        (Some(path), _) => Some((path.to_owned(), "--python")),
        (None, Some(path)) => Some((path.into(), VARIABLE)),
        (None, None) => None,
    };
    if let Some((python, from)) = named {
        let missing =
            || Error::input(format!("there is no Python {}", python.display())).help(HELP);
        let path = on_path(&python).ok_or_else(missing)?;
        return Ok(Python { path, from });
    }
    let own = home().map(|folder| inside(&folder));
    let path = own
        .filter(|python| python.is_file())
        .ok_or_else(|| Error::input("there is no Python to run Mitsuba with").help(HELP))?;
    let from = "made by --install";
    Ok(Python { path, from })
}

/// The folder of Étendue's own environment: `etendue/python` in the user's folder for caches. `None` where the
/// system names no such folder.
pub fn home() -> Option<PathBuf> {
    let folder = |name: &str| {
        let value = env::var_os(name).map(PathBuf::from);
        // As the standard for such folders asks, one that is not absolute is none.
        value.filter(|folder| folder.is_absolute())
    };
    let cache = if cfg!(windows) {
        folder("LOCALAPPDATA")
    } else {
        folder("XDG_CACHE_HOME").or_else(|| folder("HOME").map(|home| home.join(".cache")))
    };
    cache.map(|cache| cache.join("etendue").join("python"))
}

/// Makes the environment in [`home`] with the Python `base` and installs Mitsuba into it from the package index; what
/// the programs say goes to standard error. The answer is the Python in it.
///
/// # Errors
/// Where there is no folder for caches, or one of the programs fails.
pub fn install(base: Option<&Path>) -> Result<PathBuf> {
    let folder = home().ok_or_else(|| Error::input("there is no folder for caches").help(HELP))?;
    let base = base.unwrap_or(Path::new("python3"));
    let missing = || Error::input(format!("there is no Python {}", base.display()));
    let base = on_path(base).ok_or_else(missing)?;
    let python = inside(&folder);
    run(Command::new(&base)
        .args(["-m", "venv", "--clear"])
        .arg(&folder))?;
    run(Command::new(&python)
        .args(["-m", "pip", "install", "--disable-pip-version-check"])
        .args(PACKAGES))?;
    run(Command::new(&python).args(["-c", "import mitsuba, numpy"]))?;
    Ok(python)
}

/// Runs a program to its end.
fn run(command: &mut Command) -> Result<()> {
    command.stdin(Stdio::null()).stdout(std::io::stderr());
    // A folder that is named by somebody else is no place for modules, and the current one neither.
    command.env_remove("PYTHONPATH").env("PYTHONSAFEPATH", "1");
    let program = command.get_program().to_string_lossy().into_owned();
    let failed = |how: String| {
        Error::input(format!("{program} {how}")).help(
            "its words are above; a Python that has Mitsuba can be named by --python or ETENDUE_PYTHON",
        )
    };
    let status = command.status();
    let status = status.map_err(|e| failed(format!("cannot be started: {e}")))?;
    match status.success() {
        true => Ok(()),
        false => Err(failed(format!("failed ({status})"))),
    }
}

/// The Python of an environment.
fn inside(folder: &Path) -> PathBuf {
    folder.join(if cfg!(windows) {
        "Scripts/python.exe"
    } else {
        "bin/python"
    })
}

/// The file, which is sought on the path where it is a bare name; folders of the path that depend on the current one are
/// passed over.
fn on_path(program: &Path) -> Option<PathBuf> {
    if program.components().count() > 1 {
        return program.is_file().then(|| program.to_owned());
    }
    let folders = env::var_os("PATH")?;
    env::split_paths(&folders)
        .filter(|folder| folder.is_absolute())
        .map(|folder| folder.join(program))
        .find(|file| file.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_python_that_is_named_and_not_there_is_an_error_that_helps() {
        let named = Path::new("no/such/python");
        let text = find_python(Some(named)).unwrap_err().to_string();
        for part in ["no/such/python", "--install", "tools/venv"] {
            assert!(text.contains(part), "{text}");
        }
    }
}
