//! Parts of an image: the sums of some passes over a crop, in a file. What [`merge`](super::merge()) makes of the parts of
//! an image has the bits of one run, because sums of floating-point numbers are kept apart where that run would add them
//! to others first: a part that begins with the first pass holds one sum a pixel, any other those of its units, in
//! their order.
//!
//! A file is the mark, the head (its length as u32, and JSON), records, the tail (likewise) and the BLAKE3 hash of all
//! that, little-endian. A record is a count (u32), a place (four u32) and so many f64; a count of 0 ends them. The place
//! of uniform samples is a window; of adaptive ones it is the number of half a block, and three zeros.

mod cover;
mod make;
mod read;
mod write;

use std::ops::Range;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::fingerprint::Fingerprint;
use super::origin::Origin;
use crate::error::{Error, Result};
use crate::file;
use crate::film::{Layout, Tally};
use crate::sensor::Film;

pub(super) use cover::{Piece, cover};
pub(super) use make::{Made, make};
pub(super) use read::Reader;

const MARK: &[u8; 16] = b"etendue part 1\r\n";
/// Of the names of files.
const EXTENSION: &str = "part";

/// Which passes over the film a part holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Passes {
    /// The first, from 0.
    pub first: u32,
    /// The first that is not in it; the number of all where absent.
    pub end: Option<u32>,
}

impl Passes {
    /// As a range within all that there are.
    ///
    /// # Errors
    /// Where they are not among these, or there are none.
    pub(super) fn within(self, all: u32) -> Result<Range<u32>> {
        let Self { first, end } = self;
        let range = first..end.unwrap_or(all);
        if range.start < range.end && range.end <= all {
            return Ok(range);
        }
        let asked = match end {
            Some(end) => format!("{first}:{end}"),
            None => format!("{first}:"),
        };
        let message = format!("there are no passes {asked}: this render has {all}, 0:{all}");
        Err(Error::input(message).help("a range begins below its end, which is at most that many"))
    }
}

/// What a part says of itself before its sums.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Head {
    /// Of the image: it is the same whatever the crop.
    pub(super) fingerprint: Fingerprint,
    /// The system that it was rendered on: bits are the same on one.
    pub(super) target: String,
    pub(super) origin: Origin,
    pub(super) film: Film,
    pub(super) layout: Layout,
    /// Samples of a pixel in all passes, where each pixel has the same number.
    pub(super) spp: u32,
    pub(super) adaptive: Option<Noise>,
    pub(super) passes: Range<u32>,
    /// How many passes all parts have together.
    pub(super) all_passes: u32,
}

/// What is asked of adaptive samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Noise {
    pub(super) threshold: f64,
    /// The fewest and the most samples that a pixel can get.
    pub(super) limits: [u32; 2],
}

/// What it says after them.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Tail {
    pub(super) tally: Tally,
    /// Seconds that rendering took.
    pub(super) seconds: f64,
}

impl Head {
    /// Whether what was read can be reckoned with.
    fn is_sound(&self) -> bool {
        let Range { start, end } = self.passes;
        self.film.is_sound() && self.layout.is_sound() && start < end && end <= self.all_passes
    }

    /// What is not the same in `other`, a part of another image, in words.
    pub(super) fn difference(&self, other: &Self) -> Option<String> {
        if self.target != other.target {
            return Some(format!("the system ({} and {})", self.target, other.target));
        }
        let differs = self.fingerprint.difference(&other.fingerprint);
        // What follows from an equal fingerprint is equal, unless somebody forged it.
        let same = self.layout == other.layout
            && self.all_passes == other.all_passes
            && self.adaptive == other.adaptive
            && self.film.sampled() == other.film.sampled()
            && self.film.margin() == other.film.margin()
            && self.film.pixel_format == other.film.pixel_format;
        differs.or_else(|| (!same).then(|| "the film".to_owned()))
    }
}

/// The system that this program was made for.
pub(super) fn target() -> String {
    format!("{}-{}", std::env::consts::ARCH, std::env::consts::OS)
}

/// Whether a file is a part, by its name.
pub fn is_part(path: &Path) -> bool {
    path.extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case(EXTENSION))
}

/// Finds out before rendering what would stop a part from being written.
///
/// # Errors
/// Where it could not.
pub fn check_part_writable(path: &Path) -> Result<()> {
    file::check_writable(path)
}

/// The error for a file that is not what was written.
fn damaged(path: &Path, why: &str) -> Error {
    let message = format!("{} is no part or a damaged one: {why}", path.display());
    Error::input(message).help("render it again")
}
