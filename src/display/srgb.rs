//! 8-bit sRGB: code = round(255 · curve(x)) of linear BT.709 values clamped to [0, 1], with the curve of
//! [`crate::color::srgb`]. NaN becomes 0. Opacity has no curve.

use std::sync::LazyLock;

use rayon::prelude::*;

use crate::color::srgb;
use crate::error::{Error, Result};
use crate::image::{Codes, Image, Layout};

/// Pixels that one task encodes.
const GRAIN: usize = 1 << 13;

/// The 8-bit code of linear light `x`, the nearest one.
pub fn encode_value(x: f32) -> u8 {
    // It has passed as many borders; a search among them costs less than half of the curve's power.
    BORDERS.partition_point(|border| *border <= x) as u8
}

/// The linear light that lies between each code and the next.
static BORDERS: LazyLock<[f32; 255]> =
    LazyLock::new(|| std::array::from_fn(|code| srgb::decode((code as f32 + 0.5) / 255.0)));

/// The linear light of an 8-bit code.
pub fn decode_value(code: u8) -> f32 {
    srgb::decode_table()[usize::from(code)]
}

/// The codes of an image's main colour, and of its straight opacity if it has a channel A.
///
/// # Errors
/// Where the image has neither R, G, B nor X, Y, Z nor Y, or no pixels.
pub fn encode(image: &Image) -> Result<Codes> {
    let image = &*image.in_rgb();
    let Some(rgb) = image.rgb() else {
        return Err(Error::input("a display image needs channels R, G, B or Y")
            .help("write EXR, which takes any channels"));
    };
    let alpha = image.alpha();
    let grey = rgb[0] == rgb[1];
    let layout = match (grey, alpha) {
        (true, None) => Layout::Grey,
        (true, Some(_)) => Layout::GreyAlpha,
        (false, None) => Layout::Rgb,
        (false, Some(_)) => Layout::Rgba,
    };
    let colour = if grey { &rgb[..1] } else { &rgb[..] };
    let pixels = image.width() as usize * image.height() as usize;
    let mut codes = vec![0; pixels * layout.channels()];
    let coded = codes.par_chunks_exact_mut(layout.channels());
    let pixels = image.data().par_chunks_exact(image.channels().len());
    (coded.zip(pixels).with_min_len(GRAIN)).for_each(|(codes, pixel)| {
        for (code, &c) in codes.iter_mut().zip(colour) {
            *code = encode_value(pixel[c]);
        }
        if let (Some(a), Some(code)) = (alpha, codes.last_mut()) {
            *code = quantise(clamp(pixel[a]));
        }
    });
    Codes::new(image.width(), image.height(), layout, codes)
}

/// Into [0, 1]; NaN becomes 0.
fn clamp(x: f32) -> f32 {
    if x > 0.0 { x.min(1.0) } else { 0.0 }
}

/// The nearest of 256 codes to `x` in [0, 1].
fn quantise(x: f32) -> u8 {
    (x * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_survives_decoding_and_encoding() {
        for code in 0..=255 {
            assert_eq!(encode_value(decode_value(code)), code);
        }
    }

    #[test]
    fn values_beyond_the_display_are_clamped_and_nan_is_black() {
        let codes = [-1.0, -0.0, 7.0, f32::INFINITY, f32::NEG_INFINITY, f32::NAN];
        assert_eq!(codes.map(encode_value), [0, 0, 255, 255, 0, 0]);
    }

    #[test]
    fn codes_round_to_the_nearest() {
        // The border between two codes lies where the curve is half-way between them.
        for code in 0_u8..255 {
            let border = srgb::decode((f32::from(code) + 0.5) / 255.0);
            assert_eq!(encode_value(border * 0.9999), code);
            assert_eq!(encode_value(border * 1.0001), code + 1);
        }
    }

    #[test]
    fn channels_decide_the_layout_and_opacity_has_no_curve() {
        for (names, layout, codes) in [
            (&["Y"][..], Layout::Grey, &[188][..]),
            (&["Y", "A"], Layout::GreyAlpha, &[188, 128]),
            (&["B", "G", "R"], Layout::Rgb, &[188, 188, 188]),
            (&["A", "B", "G", "R"], Layout::Rgba, &[188, 188, 188, 128]),
        ] {
            let names: Vec<String> = names.iter().map(ToString::to_string).collect();
            let data = vec![0.5; names.len()];
            let encoded = encode(&Image::from_data(1, 1, names, data).unwrap()).unwrap();
            assert_eq!(encoded.layout(), layout);
            assert_eq!(encoded.data(), codes);
        }
        assert!(encode(&Image::new(1, 1, vec!["depth".into()])).is_err());
    }
}
