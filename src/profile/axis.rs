//! The words of a profile: what grows, in which way it is rendered, and how much is taken on.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// What grows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// P
    Pixels,
    /// O
    Objects,
    /// L
    Lights,
    /// N
    Bands,
    /// Samples a pixel.
    Samples,
    /// The longest path.
    Depth,
    /// Processors at work.
    Threads,
}

impl Axis {
    /// In the order of the report.
    pub const ALL: [Self; 7] = [
        Self::Pixels,
        Self::Objects,
        Self::Lights,
        Self::Bands,
        Self::Samples,
        Self::Depth,
        Self::Threads,
    ];

    /// As on the command line and on plots.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pixels => "P",
            Self::Objects => "O",
            Self::Lights => "L",
            Self::Bands => "N",
            Self::Samples => "samples",
            Self::Depth => "depth",
            Self::Threads => "threads",
        }
    }

    /// What stands along it.
    pub fn label(self) -> &'static str {
        match self {
            Self::Pixels => "pixels P",
            Self::Objects => "triangles O",
            Self::Lights => "lights L",
            Self::Bands => "bands N (3 is RGB)",
            Self::Samples => "samples a pixel",
            Self::Depth => "longest path",
            Self::Threads => "threads",
        }
    }
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Axis {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let named = |axis: &Self| axis.name().eq_ignore_ascii_case(text);
        Self::ALL.into_iter().find(named).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            format!("there is no axis {text:?}; there are {names}")
        })
    }
}

/// How much a profile takes on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Effort {
    /// The least that can be fitted: for tests.
    Tiny,
    /// Under fifteen seconds.
    Quick,
    /// Under two minutes.
    #[default]
    Usual,
    /// Up to ten million triangles.
    Full,
}

impl Effort {
    /// The most triangles.
    pub(super) fn largest(self) -> u32 {
        match self {
            Self::Tiny => 4_096,
            Self::Quick => 256 << 10,
            Self::Usual => 1 << 20,
            Self::Full => 10_000_000,
        }
    }

    /// One for a few small renders, or one for more and larger ones.
    pub(super) fn pick<T>(self, quick: T, usual: T) -> T {
        match self {
            Self::Tiny | Self::Quick => quick,
            Self::Usual | Self::Full => usual,
        }
    }
}

/// In which way a sweep is rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Way {
    /// Every ray is held against everything, without an early end.
    Brute,
    /// By tree.
    Tree,
    /// By tree, with a shadow ray to one light chosen at random in place of all.
    One,
}

impl Way {
    /// As in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Brute => "brute force",
            Self::Tree => "tree",
            Self::One => "tree, one light",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_found_by_their_names() {
        for axis in Axis::ALL {
            assert_eq!(axis.name().parse(), Ok(axis));
            assert_eq!(axis.name().to_lowercase().parse(), Ok(axis));
        }
        assert!("Q".parse::<Axis>().unwrap_err().contains("samples"));
    }
}
