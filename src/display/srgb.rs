//! 8-bit sRGB: code = round(255 · curve(x)) of linear BT.709 values clamped to [0, 1], with the curve of
//! [`crate::color::srgb`]. NaN becomes 0.

use std::sync::LazyLock;

use crate::color::srgb;
use crate::image::{Encoding, Image, Picture};

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

/// An image's linear values: codes of a file are decoded, but for opacity, which has no curve.
pub fn linear(picture: Picture) -> Image {
    let mut image = picture.image;
    if picture.encoding == Encoding::Srgb {
        let alpha = image.alpha();
        let channels = image.channels().len();
        for (i, value) in image.data_mut().iter_mut().enumerate() {
            if Some(i % channels) != alpha {
                *value = srgb::decode(*value);
            }
        }
    }
    image
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
}
