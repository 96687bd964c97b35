//! CIE standard illuminant D65, daylight of 6504 K: relative spectral power every 5 nm from 360 to 830 nm
//! (CIE 15:2004, table T.1), linear in between and scaled so that its luminance under
//! [`cie::NORMALIZATION`](super::cie::NORMALIZATION) is 1: RGB (1, 1, 1) is this spectrum.

use super::cie::{Between, locate};
use crate::lanes::{Lanes, SMALL_TABLE};

/// What the table is divided by, as in Mitsuba 3: ∫ D65(λ) ȳ(λ) dλ over ∫ ȳ(λ) dλ.
const SCALE: f32 = 1.0 / 98.997_42;

/// Power of D65 at `lambda` (nm) with luminance 1, 0 outside 360–830 nm.
pub fn d65(lambda: f32) -> f32 {
    match locate(lambda) {
        Some((i, t)) => SCALE * ((1.0 - t) * POWER[i] + t * POWER[i + 1]),
        None => 0.0,
    }
}

/// The same at wavelengths in lanes.
#[inline(always)]
pub(super) fn d65_lanes<F: Lanes>(lambda: F) -> F {
    F::splat(SCALE) * Between::of(lambda).look_up(&POWER)
}

/// Relative spectral power, 100 at 560 nm, and a last number, which nobody asks for.
#[rustfmt::skip]
static POWER: [f32; SMALL_TABLE] = [
    46.6383, 49.3637, 52.0891, 51.0323, 49.9755, 52.3118, 54.6482, 68.7015,
    82.7549, 87.1204, 91.486, 92.4589, 93.4318, 90.057, 86.6823, 95.7736,
    104.865, 110.936, 117.008, 117.41, 117.812, 116.336, 114.861, 115.392,
    115.923, 112.367, 108.811, 109.082, 109.354, 108.578, 107.802, 106.296,
    104.79, 106.239, 107.689, 106.047, 104.405, 104.225, 104.046, 102.023,
    100.0, 98.1671, 96.3342, 96.0611, 95.788, 92.2368, 88.6856, 89.3459,
    90.0062, 89.8026, 89.5991, 88.6489, 87.6987, 85.4936, 83.2886, 83.4939,
    83.6992, 81.863, 80.0268, 80.1207, 80.2146, 81.2462, 82.2778, 80.281,
    78.2842, 74.0027, 69.7213, 70.6652, 71.6091, 72.979, 74.349, 67.9765,
    61.604, 65.7448, 69.8856, 72.4863, 75.087, 69.3398, 63.5927, 55.0054,
    46.4182, 56.6118, 66.8054, 65.0941, 63.3828, 63.8434, 64.304, 61.8779,
    59.4519, 55.7054, 51.959, 54.6998, 57.4406, 58.8765, 60.3125, 60.3125,
];

#[cfg(test)]
mod tests {
    use super::super::cie;
    use super::*;

    #[test]
    fn daylight_has_mitsubas_values() {
        for (lambda, power) in [
            (450.0, 1.1819),
            (550.0, 1.0510),
            (560.0, 1.0101),
            (650.0, 0.8084),
        ] {
            assert!(
                (d65(lambda) - power).abs() < 1e-4,
                "{lambda} nm: {}",
                d65(lambda)
            );
        }
        assert_eq!(d65(359.0), 0.0);
    }

    #[test]
    fn lanes_see_the_same_daylight() {
        for i in 0..5000 {
            let lambda = 350.0 + 0.1 * i as f32;
            let error = d65_lanes::<f32>(lambda) - d65(lambda);
            assert!(error.abs() < 1e-5, "{lambda}: {error}");
        }
    }

    #[test]
    fn daylight_is_the_white_point() {
        let mut white = [0.0; 3];
        for k in 0..4700 {
            let lambda = 360.05 + 0.1 * k as f32;
            let observer = cie::xyz(lambda);
            for (w, o) in white.iter_mut().zip(observer) {
                *w += f64::from(0.1 * cie::NORMALIZATION * o * d65(lambda));
            }
        }
        for (w, expected) in white.iter().zip([0.9504, 1.0, 1.0888]) {
            assert!((w - expected).abs() < 5e-4, "{white:?}");
        }
    }
}
