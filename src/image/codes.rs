//! Images of codes of 8 or 16 bits, and their file formats, PNG, TIFF and JPEG. The display layer makes them, and says by a [`Tag`] what
//! they mean.

use std::borrow::Cow;
use std::path::Path;

use ::image::codecs::png::{CompressionType, FilterType, PngEncoder};
use ::image::{ExtendedColorType, ImageEncoder};
use libjpeg_turbo_rs::{Encoder, PixelFormat, Subsampling};

use crate::color::Primaries;
use crate::error::{Error, Result};
use crate::file;
use crate::image::format::Format;
use crate::image::tiff;

/// The channels of an image of codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// Grey.
    Grey,
    /// Grey and straight opacity.
    GreyAlpha,
    /// Red, green, blue.
    Rgb,
    /// Red, green, blue and straight opacity.
    Rgba,
}

impl Layout {
    /// How many codes a pixel has.
    pub fn channels(self) -> usize {
        match self {
            Self::Grey => 1,
            Self::GreyAlpha => 2,
            Self::Rgb => 3,
            Self::Rgba => 4,
        }
    }
}

/// What codes mean, for those who show them (PNG, third edition, 2025: sRGB, gAMA, cHRM and cICP).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Tag {
    /// The colour space sRGB.
    Srgb,
    /// Codes that are light of these primaries to the power of the inverse of this.
    Gamma(f32, Primaries),
    /// Primaries and transfer characteristics by their numbers in ITU-T H.273.
    Cicp {
        /// Such as 1 for BT.709, 9 for BT.2020, 12 for P3 with white D65.
        primaries: u8,
        /// Such as 13 for sRGB, 16 for PQ, 18 for HLG.
        transfer: u8,
    },
}

impl Tag {
    /// The names and the data of the chunks that say it.
    fn chunks(self) -> Vec<(&'static [u8; 4], Vec<u8>)> {
        let parts = |numbers: &[f64]| -> Vec<u8> {
            let part = |v: &f64| ((v * 100_000.0).round() as u32).to_be_bytes();
            numbers.iter().flat_map(part).collect()
        };
        match self {
            // As rendered colours mostly are meant: perceptually.
            Self::Srgb => vec![(b"sRGB", vec![0])],
            Self::Gamma(exponent, primaries) => {
                let mut chunks = vec![(b"gAMA", parts(&[1.0 / f64::from(exponent)]))];
                // Those of BT.709 are what is meant where nothing is said.
                if !primaries.same(&Primaries::BT709) {
                    let Primaries {
                        red,
                        green,
                        blue,
                        white,
                    } = primaries;
                    chunks.push((b"cHRM", parts(&[white, red, green, blue].concat())));
                }
                chunks
            }
            // RGB, of full range.
            Self::Cicp {
                primaries,
                transfer,
            } => vec![(b"cICP", vec![primaries, transfer, 0, 1])],
        }
    }
}

/// A code's type: `u8` or `u16`.
pub trait Code: Copy {
    /// What the crate `image` calls pixels of these, by layout.
    const COLORS: [ExtendedColorType; 4];
    /// The memory's bytes.
    fn bytes(codes: &[Self]) -> Cow<'_, [u8]>;
    /// The bytes of a TIFF file of `codes`, interleaved.
    ///
    /// # Errors
    /// Where such a file cannot hold them.
    fn to_tiff(size: [u32; 2], layout: Layout, codes: &[Self]) -> Result<Vec<u8>>;
}

impl Code for u8 {
    const COLORS: [ExtendedColorType; 4] = [
        ExtendedColorType::L8,
        ExtendedColorType::La8,
        ExtendedColorType::Rgb8,
        ExtendedColorType::Rgba8,
    ];

    fn bytes(codes: &[u8]) -> Cow<'_, [u8]> {
        Cow::Borrowed(codes)
    }

    fn to_tiff(size: [u32; 2], layout: Layout, codes: &[u8]) -> Result<Vec<u8>> {
        tiff::encode_samples(size, layout, codes)
    }
}

impl Code for u16 {
    const COLORS: [ExtendedColorType; 4] = [
        ExtendedColorType::L16,
        ExtendedColorType::La16,
        ExtendedColorType::Rgb16,
        ExtendedColorType::Rgba16,
    ];

    fn bytes(codes: &[u16]) -> Cow<'_, [u8]> {
        codes.iter().flat_map(|code| code.to_ne_bytes()).collect()
    }

    fn to_tiff(size: [u32; 2], layout: Layout, codes: &[u16]) -> Result<Vec<u8>> {
        tiff::encode_samples(size, layout, codes)
    }
}

/// An image of codes, interleaved, the top row first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Codes<T = u8> {
    width: u32,
    height: u32,
    layout: Layout,
    data: Vec<T>,
}

impl<T: Code> Codes<T> {
    /// An image of the given codes.
    ///
    /// # Errors
    /// Unless there are exactly as many codes as width, height and layout ask for.
    pub fn new(width: u32, height: u32, layout: Layout, data: Vec<T>) -> Result<Self> {
        let wanted = u128::from(width) * u128::from(height) * layout.channels() as u128;
        if wanted != data.len() as u128 || data.is_empty() {
            return Err(Error::input(format!(
                "{} codes do not make an image of {width} × {height} pixels, {layout:?}",
                data.len()
            )));
        }
        Ok(Self {
            width,
            height,
            layout,
            data,
        })
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Which channels a pixel has.
    pub fn layout(&self) -> Layout {
        self.layout
    }

    /// The codes, interleaved.
    pub fn data(&self) -> &[T] {
        &self.data
    }

    /// The bytes of a PNG file.
    fn to_png(&self, tag: Tag) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        // Noise hardly gets smaller by more work.
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive)
            .write_image(
                &T::bytes(&self.data),
                self.width,
                self.height,
                T::COLORS[self.layout as usize],
            )
            .map_err(|e| Error::input(format!("the image cannot be stored as PNG: {e}")))?;
        // It stands behind the header, which every file begins with: a signature of 8 bytes, and a chunk of 25.
        let chunks = tag.chunks();
        let chunks = chunks.iter().flat_map(|(name, data)| chunk(name, data));
        bytes.splice(33..33, chunks);
        Ok(bytes)
    }

    /// The bytes of a JPEG file of the colours, with all their detail: JPEG has no opacity.
    ///
    /// # Errors
    /// Where codes have 16 bits.
    pub fn to_jpeg(&self) -> Result<Vec<u8>> {
        self.to_jpeg_of(95)
    }

    /// The same of a quality from 1 to 100.
    ///
    /// # Errors
    /// Where codes have 16 bits.
    pub fn to_jpeg_of(&self, quality: u8) -> Result<Vec<u8>> {
        if size_of::<T>() != 1 {
            return Err(only_eight());
        }
        let (format, colours) = match self.layout {
            Layout::Grey | Layout::GreyAlpha => (PixelFormat::Grayscale, 1),
            Layout::Rgb | Layout::Rgba => (PixelFormat::Rgb, 3),
        };
        let all = T::bytes(&self.data);
        let pixels = all.chunks_exact(self.layout.channels());
        let kept: Vec<u8> = pixels
            .flat_map(|pixel| &pixel[..colours])
            .copied()
            .collect();
        Encoder::new(&kept, self.width as usize, self.height as usize, format)
            .quality(quality)
            .subsampling(Subsampling::S444)
            .encode()
            .map_err(|e| Error::input(format!("the image cannot be stored as JPEG: {e}")))
    }
}

/// A chunk of a PNG file: length, name, data and a check of the last two.
fn chunk(name: &[u8; 4], data: &[u8]) -> Vec<u8> {
    let checked = [&name[..], data].concat();
    let check = crc32fast::hash(&checked);
    let length = data.len() as u32;
    [&length.to_be_bytes()[..], &checked, &check.to_be_bytes()].concat()
}

/// Writes codes as a PNG, a TIFF or a JPEG file, whole or not at all. The last two are always taken for sRGB.
///
/// # Errors
/// Where the extension is another or the format cannot hold the codes, or the file system refuses.
pub fn write_codes<T: Code>(path: &Path, codes: &Codes<T>, tag: Tag) -> Result<()> {
    let bytes = match Format::of_output(path)? {
        Format::Png => codes.to_png(tag)?,
        Format::Jpeg | Format::Tiff if tag != Tag::Srgb => return Err(no_srgb()),
        Format::Jpeg => codes.to_jpeg()?,
        Format::Tiff => T::to_tiff([codes.width, codes.height], codes.layout, &codes.data)?,
        Format::Exr | Format::Hdr | Format::Pfm => {
            let path = path.display();
            return Err(
                Error::input(format!("a picture for screens cannot be stored as {path}"))
                    .help("use .png, .tif or .jpg"),
            );
        }
    };
    file::write_atomically(path, &bytes)
}

fn no_srgb() -> Error {
    Error::input("JPEG and TIFF files cannot say that their codes are no sRGB").help("use .png")
}

/// Finds out whether codes of so many bits, which mean this, can be written as a file of this name; other formats than
/// PNG, TIFF and JPEG hold no codes, and anything goes with them.
///
/// # Errors
/// Where they cannot, or the extension is unknown.
pub fn check_codes(path: &Path, bits: u32, tag: Tag) -> Result<()> {
    match Format::of_output(path)? {
        Format::Jpeg if bits != 8 => Err(only_eight()),
        Format::Jpeg | Format::Tiff if tag != Tag::Srgb => Err(no_srgb()),
        _ => Ok(()),
    }
}

fn only_eight() -> Error {
    Error::input("JPEG has 8 bits a channel").help("use .png or .tif for 16")
}
