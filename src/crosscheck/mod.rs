//! Étendue beside Mitsuba: a scene is rendered by both with several seeds, in turns, and the images are held
//! against each other by [`compare`](crate::compare), whose yardstick is how much the seeds of each side
//! differ. Both sides are processes that load the scene once and then render a seed at a time, so that
//! seconds, processor seconds and memory mean the same on both.

mod cost;
mod images;
mod order;
mod process;
mod python;
mod run;
mod serve;

use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

use serde::Serialize;

use crate::render::Overrides;

pub use cost::{Cost, Time};
pub use images::Pictures;
pub use python::{Python, VARIABLE, find_python, home, install};
pub use run::{Crosscheck, crosscheck};
pub use serve::serve;

/// One of the two that are held against each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// This program.
    Etendue,
    /// Mitsuba 3, the reference.
    Mitsuba,
}

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Etendue => "Étendue",
            Self::Mitsuba => "Mitsuba",
        })
    }
}

/// How scenes are compared.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The `etendue` program, and the arguments with which it calls [`serve`].
    pub etendue: (PathBuf, Vec<String>),
    /// The Python that has Mitsuba: see [`find_python`].
    pub python: Python,
    /// A folder of Python files that register plugins with Mitsuba, in place of Étendue's own: `phong`, `ambient`,
    /// `plane` and `cone`.
    pub plugins: Option<PathBuf>,
    /// Mitsuba's variant, such as `scalar_rgb`.
    pub variant: String,
    /// How many spectral bands Étendue renders; RGB where absent.
    pub bands: Option<u16>,
    /// What Mitsuba renders in place of the scene: the same in words that it knows.
    pub reference: Option<PathBuf>,
    /// Values of the scene's parameters.
    pub defines: Vec<(String, String)>,
    /// Whether Étendue refuses what Mitsuba would not read.
    pub strict: bool,
    /// Values in place of the scene's own, on both sides.
    pub overrides: Overrides,
    /// Which of the scene's sensors, by id or number; the first where absent.
    pub sensor: Option<String>,
    /// How often each side renders the scene, at least twice.
    pub seeds: u32,
    /// The first of the seeds; those that follow are one greater each.
    pub first_seed: u64,
    /// Threads of each side; one a processor where absent.
    pub threads: Option<u32>,
    /// The longest that either side may take to load the scene, and to render a seed.
    pub timeout: Duration,
    /// Where the mean images of both sides and two maps of the error are kept.
    pub keep: Option<PathBuf>,
    /// Whether [`Crosscheck::pictures`] are wanted.
    pub pictures: bool,
    /// Whether images are not judged, only timed.
    pub timing_only: bool,
}

/// Somebody who watches a crosscheck.
pub trait Watch {
    /// `done` of `total` images are there; `side` works on the next.
    fn at(&self, side: Side, done: u32, total: u32);
    /// Whether to stop.
    fn stop(&self) -> bool;
}

/// Why a scene was not compared.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Failure {
    /// One of the sides cannot render the scene, and why.
    NotComparable(String),
    /// This Python has no Mitsuba.
    NoMitsuba(PathBuf),
    /// A side ended before its time.
    Died {
        /// Which.
        side: Side,
        /// In which way.
        how: String,
        /// What it said last on standard error.
        words: String,
    },
    /// Something else went wrong: a program that does not start, a time limit, a file that cannot be written.
    Broken(String),
    /// The watch asked for it.
    Stopped,
}

impl Failure {
    /// What would help, where that is known.
    pub fn help(&self) -> Option<&'static str> {
        matches!(self, Self::NoMitsuba(_)).then_some(python::HELP)
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotComparable(why) | Self::Broken(why) => f.write_str(why),
            Self::NoMitsuba(python) => write!(f, "{} has no Mitsuba", python.display()),
            Self::Died { side, how, words } if words.is_empty() => {
                write!(f, "{side} {how} without a word")
            }
            Self::Died { side, how, words } => write!(f, "{side} {how}; its last words:\n{words}"),
            Self::Stopped => f.write_str("stopped"),
        }
    }
}

impl std::error::Error for Failure {}

impl From<crate::error::Error> for Failure {
    fn from(error: crate::error::Error) -> Self {
        Self::Broken(error.to_string())
    }
}
