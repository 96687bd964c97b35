//! Images: a strided buffer of named f32 channels with views, and files in and out. Reading takes EXR,
//! HDR, PFM, TIFF, PNG, JPEG, BMP, TGA and PPM and gives values as the file holds them, but for colours that a file says
//! to be of other primaries, which become those of BT.709; writing takes linear values as EXR, HDR, PFM or TIFF and ready
//! codes as PNG, TIFF or JPEG. Which curve lies between the two is the display layer's business.

mod bands;
mod buffer;
mod codes;
mod format;
mod jpeg;
mod layers;
mod metadata;
mod openexr;
mod pfm;
mod radiance;
mod raster;
mod tiff;
mod view;
pub mod vol;

use std::cell::Cell;
use std::fs;
use std::io::Read;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

pub use bands::{Band, bands};
pub use buffer::Image;
pub use codes::{Code, Codes, Layout, Tag, check_codes, write_codes};
pub use format::Format;
pub use layers::sheet;
pub use metadata::{MetaValue, Metadata, Window};
pub use openexr::check_channels;
pub use view::View;

use crate::budget::Account;
use crate::error::{Error, Location, Problem, Result};
use crate::file;
use format::Decoder;

/// What the values of a picture mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Linear values (EXR, HDR, PFM, TIFF of floats).
    Linear,
    /// Code values in [0, 1], still encoded by the sRGB curve (TIFF, PNG, JPEG, BMP, TGA, PPM); opacity is linear.
    Srgb,
}

/// An image as its file holds it.
#[derive(Clone, Debug)]
pub struct Picture {
    /// The values, not decoded.
    pub image: Image,
    /// What the values mean.
    pub encoding: Encoding,
    /// The file's own remarks (EXR attributes) as text, by name.
    pub metadata: Vec<(String, String)>,
    /// What of the file was left out.
    pub warnings: Vec<Problem>,
}

/// Reads an image file of any known format; its content, not its name, says which. The account is asked for all that
/// this takes.
///
/// # Errors
/// Where the file is missing, unknown, damaged, cut off or larger than the budget allows.
pub fn read(path: &Path, account: &Account) -> Result<Picture> {
    let refused = |e: std::io::Error| Error::system("read", path, &e);
    let there = fs::metadata(path).map_err(refused)?;
    if !there.is_file() {
        return Err(Error::input(format!("{} is not a file", path.display())));
    }
    let taken = account.take(there.len());
    taken.map_err(|e| e.at(&Location::of_file(path)))?;
    let mut bytes = Vec::new();
    let file = file::open(path).map_err(refused)?;
    // A file that grows meanwhile is read as long as it was.
    (file.take(there.len()).read_to_end(&mut bytes)).map_err(refused)?;
    read_bytes(path, &bytes, account)
}

/// As [`read`], of an image whose bytes stand in the file `path`.
///
/// # Errors
/// Where they are no image, damaged, cut off or larger than the budget allows.
pub fn read_bytes(path: &Path, bytes: &[u8], account: &Account) -> Result<Picture> {
    let place = Location::of_file(path);
    let mut picture = decode(path, bytes, account).map_err(|e| e.at(&place))?;
    for warning in &mut picture.warnings {
        warning.location.get_or_insert_with(|| place.clone());
    }
    Ok(picture)
}

/// Whether these first bytes of the file `path` are those of an image of a known format.
pub fn is_image(path: &Path, bytes: &[u8]) -> bool {
    Decoder::of_input(path, bytes).is_ok()
}

/// Decodes the bytes of an image file; `path` only tells TGA from what is no image.
fn decode(path: &Path, bytes: &[u8], account: &Account) -> Result<Picture> {
    let decoder = Decoder::of_input(path, bytes)?;
    // The checks before it should leave a decoder nothing to panic about. It is other people's code
    // on a stranger's file, though, so a panic that slips through is one more kind of damaged file.
    // Nothing that it could leave half-changed survives it.
    guarded(|| decode_by(decoder, bytes, account))
}

thread_local! {
    static DECODING: Cell<bool> = const { Cell::new(false) };
}

/// What `decode` makes; a panic of it is a damaged file, and [`is_decoding`] meanwhile.
fn guarded(decode: impl FnOnce() -> Result<Picture>) -> Result<Picture> {
    DECODING.set(true);
    let picture = catch_unwind(AssertUnwindSafe(decode));
    DECODING.set(false);
    picture.unwrap_or_else(|_| Err(Error::input("the file is damaged")))
}

/// Whether this thread decodes an image: a panic is then told as an error of the file, and needs no words of its own.
pub fn is_decoding() -> bool {
    DECODING.get()
}

fn decode_by(decoder: Decoder, bytes: &[u8], account: &Account) -> Result<Picture> {
    match decoder {
        Decoder::Exr => openexr::decode(bytes, account),
        Decoder::Hdr => radiance::decode(bytes, account),
        Decoder::Jpeg => jpeg::decode(bytes, account),
        Decoder::Pfm => pfm::decode(bytes, account),
        Decoder::Tiff => tiff::decode(bytes, account),
        Decoder::Raster(format) => raster::decode(bytes, format, account),
    }
}

/// Writes linear values as EXR (all channels, metadata), HDR, PFM (main colour) or TIFF (that and opacity), by the extension. The file
/// appears whole or not at all.
///
/// # Errors
/// Where the extension is another, the format cannot hold the image, or the file system refuses.
pub fn write(path: &Path, image: &Image, metadata: &Metadata) -> Result<()> {
    let whole = Window {
        x: 0,
        y: 0,
        full_width: image.width(),
        full_height: image.height(),
    };
    write_window(path, image, &whole, metadata)
}

/// Like [`write()`], for an image that is a part of a whole: EXR says which, the others only store the part.
///
/// # Errors
/// As [`write()`], and where the image reaches beyond the whole.
pub fn write_window(
    path: &Path,
    image: &Image,
    window: &Window,
    metadata: &Metadata,
) -> Result<()> {
    let bytes = match Format::of_output(path)? {
        Format::Exr => openexr::encode(image, window, metadata)?,
        Format::Hdr => radiance::encode(image)?,
        Format::Pfm => pfm::encode(image)?,
        Format::Tiff => tiff::encode(image)?,
        Format::Png | Format::Jpeg => {
            return Err(Error::input(format!(
                "linear values cannot be stored as {}",
                path.display()
            ))
            .help("encode them for display first"));
        }
    };
    file::write_atomically(path, &bytes)
}

/// Finds out before a render what would stop its image from being written: an unknown extension, a
/// missing folder, a file that must not be replaced. Nothing is left behind.
///
/// # Errors
/// Any of these.
pub fn check_writable(path: &Path) -> Result<()> {
    Format::of_output(path)?;
    file::check_writable(path)
}

#[cfg(test)]
mod tests;
