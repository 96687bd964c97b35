//! The sRGB transfer curve, both ways: linear light x becomes the code c = 12.92·x up to x = 0.0031308 and
//! c = 1.055·x^(1/2.4) − 0.055 above (IEC 61966-2-1, 1999). Computed in f64, so that the result is the
//! curve's value rounded once.

use std::sync::LazyLock;

/// The code value of linear light `x`; 0 and 1 stay themselves. Values outside of [0, 1] follow the same
/// formulas: clamping is the caller's.
pub fn encode(x: f32) -> f32 {
    let x = f64::from(x);
    let code = if x <= 0.003_130_8 {
        12.92 * x
    } else {
        1.055 * x.powf(1.0 / 2.4) - 0.055
    };
    code as f32
}

/// The linear light of code value `code`, the inverse of [`encode`].
pub fn decode(code: f32) -> f32 {
    let code = f64::from(code);
    let x = if code <= 0.040_45 {
        code / 12.92
    } else {
        ((code + 0.055) / 1.055).powf(2.4)
    };
    x as f32
}

/// The linear light of every 8-bit code: entry i is `decode(i / 255)`.
pub fn decode_table() -> &'static [f32; 256] {
    static TABLE: LazyLock<[f32; 256]> =
        LazyLock::new(|| std::array::from_fn(|i| decode(i as f32 / 255.0)));
    &TABLE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_stay_and_middle_grey_is_where_the_standard_puts_it() {
        assert_eq!((encode(0.0), decode(0.0)), (0.0, 0.0));
        assert_eq!((encode(1.0), decode(1.0)), (1.0, 1.0));
        assert!((encode(0.214_041_14) - 0.5).abs() < 1e-6);
        assert!((decode(0.5) - 0.214_041_14).abs() < 1e-6);
    }

    #[test]
    fn decoding_undoes_encoding_everywhere() {
        for i in 0..=10_000 {
            let x = i as f32 / 10_000.0;
            assert!((decode(encode(x)) - x).abs() < 1e-6, "{x}");
        }
    }

    #[test]
    fn the_curve_rises_across_the_joint_of_its_two_pieces() {
        let codes: Vec<f32> = (0..2000).map(|i| encode(0.003 + i as f32 * 1e-7)).collect();
        assert!(codes.windows(2).all(|pair| pair[0] <= pair[1]));
        let codes: Vec<f32> = (0..2000)
            .map(|i| decode(0.0404 + i as f32 * 1e-7))
            .collect();
        assert!(codes.windows(2).all(|pair| pair[0] <= pair[1]));
    }

    #[test]
    fn the_table_holds_the_curve() {
        for (i, &x) in decode_table().iter().enumerate() {
            assert_eq!(x, decode(i as f32 / 255.0));
        }
    }
}
