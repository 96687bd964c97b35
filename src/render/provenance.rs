//! What an image was made of, kept beside it as OUT.fingerprint; a part says it itself. So it can be told whether what is
//! there is what would be rendered, without loading a mesh.

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::adaptive::Ladder;
use super::fingerprint::{self, Contents, Fingerprint};
use super::options::{Options, Overrides};
use super::part::{self, Passes, Reader};
use super::plan::Plan;
use super::prepare;
use super::session::Task;
use crate::color::ColorModel;
use crate::description::Description;
use crate::error::{Error, Result};
use crate::file;
use crate::sensor::{Film, Window};

/// What an image was made of.
#[derive(Clone, Debug)]
pub struct Provenance(Made);

#[derive(Clone, Debug)]
pub(super) struct Made {
    /// Of the image without its crop.
    pub(super) fingerprint: Fingerprint,
    pub(super) crop: Window,
}

/// The file.
#[derive(Debug, Serialize, Deserialize)]
struct Stored {
    format: u32,
    fingerprint: Fingerprint,
    crop: Window,
    /// Of the image's file.
    content: String,
}

/// Of a provenance's file.
const FORMAT: u32 = 1;

impl Provenance {
    pub(super) fn new(fingerprint: Fingerprint, crop: Window) -> Self {
        Self(Made { fingerprint, crop })
    }

    /// Writes the provenance of the image in the file `output`.
    ///
    /// # Errors
    /// Where the image cannot be read or the provenance not be written.
    pub fn write(self, output: &Path) -> Result<()> {
        let content = fingerprint::hash_file(output);
        let stored = Stored {
            format: FORMAT,
            fingerprint: self.0.fingerprint,
            crop: self.0.crop,
            content: content.map_err(|e| Error::system("read", output, &e))?,
        };
        let json = serde_json::to_vec(&stored).expect("a provenance has only names and numbers");
        file::write_atomically(&path(output), &json)
    }
}

/// The record's file beside an image.
fn path(output: &Path) -> PathBuf {
    let mut name = output.as_os_str().to_owned();
    name.push(".fingerprint");
    name.into()
}

/// Reads the provenance of an image that is as it was written.
fn read(output: &Path) -> Option<Made> {
    let json = fs::read(path(output)).ok()?;
    let stored: Stored = serde_json::from_slice(&json).ok()?;
    let content = fingerprint::hash_file(output).ok()?;
    (stored.format == FORMAT && stored.content == content).then_some(Made {
        fingerprint: stored.fingerprint,
        crop: stored.crop,
    })
}

/// The fingerprint of an image whatever its crop: with that of the whole film.
pub(super) fn without_crop(description: &Description, film: &Film) -> Description {
    let mut whole = description.clone();
    let overrides = Overrides {
        crop: Some(film.full()),
        ..Overrides::default()
    };
    overrides.apply(&mut whole);
    whole
}

/// Whether the file `output` is there, undamaged, and what rendering `description` (some `passes` of it where it is a
/// part) would make.
///
/// # Errors
/// Where the scene's view is wrong or its files cannot be read.
pub fn is_current(
    description: &Description,
    options: &Options,
    passes: Passes,
    output: &Path,
) -> Result<bool> {
    let (made, of) = if part::is_part(output) {
        let Some(head) = Reader::open(output).and_then(Reader::examine).ok() else {
            return Ok(false);
        };
        let made = Made {
            fingerprint: head.fingerprint,
            crop: head.film.crop,
        };
        (made, Some(head.passes))
    } else {
        match read(output) {
            Some(made) => (made, None),
            None => return Ok(false),
        }
    };
    Look {
        description,
        options,
        passes,
        made,
        of,
    }
    .run_in(description, options)
}

/// Holds a provenance against what would be rendered.
struct Look<'a> {
    description: &'a Description,
    options: &'a Options,
    passes: Passes,
    made: Made,
    /// The passes of a part.
    of: Option<Range<u32>>,
}

impl Task for Look<'_> {
    type Output = bool;

    fn run<C: ColorModel>(self, _color: C) -> Result<bool> {
        let sensor = prepare::sensor(self.description, self.options)?;
        let view = prepare::view::<C>(self.description, sensor)?;
        let whole = without_crop(self.description, &view.film);
        let contents = Contents::read(&whole, &self.made.fingerprint.named(&whole, sensor))?;
        let wanted = Fingerprint::new(&whole, sensor, &contents, self.options)?;
        let passes = match (&self.of, &self.options.adaptive) {
            (None, _) => None,
            (Some(_), None) => Some(Plan::new(&view.film, view.sampler.sample_count()).passes()),
            (Some(_), Some(adaptive)) => Some(Ladder::checked(&view.sampler, adaptive)?.passes()),
        };
        let passes = passes.map(|all| self.passes.within(all)).transpose()?;
        Ok(wanted.difference(&self.made.fingerprint).is_none()
            && view.film.crop == self.made.crop
            && passes == self.of)
    }
}
