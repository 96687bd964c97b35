//! The exponential function in single precision, without a branch or a table, so that a loop over it becomes
//! a loop over lanes.

use std::f32::consts::LOG2_E;

/// eˣ within 2 units in the last place; 0 below −87, and x = 88 stands for all beyond it.
///
/// x = n·ln 2 + r with |r| ≤ ½ ln 2, of which eʳ is Taylor's polynomial and 2ⁿ is made of its bits. ln 2 is subtracted
/// in two parts, the first of few enough digits for n times it to be exact (Cody and Waite, *Software manual for the
/// elementary functions*, 1980).
#[inline]
pub fn exp(x: f32) -> f32 {
    /// 1.5·2²³: added to a number, it leaves the nearest integer in the lowest bits.
    const ROUND: f32 = 12_582_912.0;
    const LN_2: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];
    let within = x.clamp(-87.0, 88.0);
    let rounded = within * LOG2_E + ROUND;
    let n = rounded - ROUND;
    let r = within - n * LN_2[0] - n * LN_2[1];
    let tail = 1.0 / 120.0 + r * (1.0 / 720.0 + r * (1.0 / 5040.0));
    let series = r * r * (0.5 + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * tail)));
    let power = f32::from_bits((rounded.to_bits() << 23).wrapping_add(1f32.to_bits()));
    let value = (1.0 + (r + series)) * power;
    if x < -87.0 { 0.0 } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_those_of_double_precision() {
        for i in -870_000..880_000 {
            let x = i as f32 * 1e-4;
            let exact = f64::from(x).exp();
            let error = (f64::from(exp(x)) / exact - 1.0).abs();
            assert!(error < 1.5e-7, "{x}: {error}");
        }
        assert_eq!(
            [exp(0.0), exp(-0.0), exp(-87.1), exp(f32::NEG_INFINITY)],
            [1.0, 1.0, 0.0, 0.0]
        );
        assert!(exp(f32::NAN).is_nan() && exp(f32::INFINITY) > 1e38);
    }
}
