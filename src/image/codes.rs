//! Images of 8-bit codes, and their file format, PNG. What the codes mean is not known here: the display
//! layer makes them.

use std::path::Path;

use ::image::codecs::png::{CompressionType, FilterType, PngEncoder};
use ::image::{ExtendedColorType, ImageEncoder};

use crate::error::{Error, Result};
use crate::file;
use crate::image::format::Format;

/// The channels of an 8-bit image.
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

/// An image of 8-bit codes, interleaved, the top row first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Codes {
    width: u32,
    height: u32,
    layout: Layout,
    data: Vec<u8>,
}

impl Codes {
    /// An image of the given codes.
    ///
    /// # Errors
    /// Unless there are exactly as many codes as width, height and layout ask for.
    pub fn new(width: u32, height: u32, layout: Layout, data: Vec<u8>) -> Result<Self> {
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
    pub fn data(&self) -> &[u8] {
        &self.data
    }

    /// The bytes of a PNG file.
    fn to_png(&self) -> Result<Vec<u8>> {
        let color = match self.layout {
            Layout::Grey => ExtendedColorType::L8,
            Layout::GreyAlpha => ExtendedColorType::La8,
            Layout::Rgb => ExtendedColorType::Rgb8,
            Layout::Rgba => ExtendedColorType::Rgba8,
        };
        let mut bytes = Vec::new();
        // Noise hardly gets smaller by more work.
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive)
            .write_image(&self.data, self.width, self.height, color)
            .map_err(|e| Error::input(format!("the image cannot be stored as PNG: {e}")))?;
        Ok(bytes)
    }
}

/// Writes 8-bit codes as a PNG file, whole or not at all.
///
/// # Errors
/// Where the extension is not `.png` or the file system refuses.
pub fn write_codes(path: &Path, codes: &Codes) -> Result<()> {
    if Format::of_output(path)? != Format::Png {
        return Err(Error::input(format!(
            "8-bit codes cannot be stored as {}",
            path.display()
        ))
        .help("use .png"));
    }
    file::write_atomically(path, &codes.to_png()?)
}
