//! Writing Radiance HDR (RGBE: three mantissas of 8 bits and a shared exponent; Greg Ward, "Real Pixels",
//! Graphics Gems II, 1991). About 1 % precision, no negative values and no opacity.

use ::image::Rgb;
use ::image::codecs::hdr::HdrEncoder;

use crate::error::{Error, Result};
use crate::image::Image;

/// The range of the shared exponent; what is smaller becomes 0, what is larger the largest.
const SMALLEST: f32 = 1e-38;
const LARGEST: f32 = 1.7e38;
/// A scan line's length is stored in 15 bits.
const WIDEST: u32 = 32_767;

/// The bytes of a Radiance HDR file of the image's main colour.
pub(super) fn encode(image: &Image) -> Result<Vec<u8>> {
    let Some(colour) = image.rgb() else {
        return Err(Error::input("an HDR file needs channels R, G, B or Y")
            .help("write EXR, which takes any channels"));
    };
    if image.width() > WIDEST || image.width() == 0 || image.height() == 0 {
        return Err(Error::input(format!(
            "an HDR file cannot hold {} × {} pixels",
            image.width(),
            image.height()
        ))
        .help("write EXR"));
    }
    // NaN is neither, and becomes 0.
    let storable = |v: f32| if v >= SMALLEST { v.min(LARGEST) } else { 0.0 };
    let pixels: Vec<Rgb<f32>> = image
        .data()
        .chunks_exact(image.channels().len())
        .map(|pixel| Rgb(colour.map(|c| storable(pixel[c]))))
        .collect();
    let mut bytes = Vec::new();
    HdrEncoder::new(&mut bytes)
        .encode(&pixels, image.width() as usize, image.height() as usize)
        .map_err(|e| Error::input(format!("the image cannot be stored as HDR: {e}")))?;
    Ok(bytes)
}
