//! AgX as Benjamin Wrensch's *Minimal AgX implementation* (2023) has it, after Troy Sobotka's view of scene-referred light
//! (github.com/sobotka/AgX, 2022): the primaries are drawn toward grey, so that bright saturated colours go to white instead of
//! to a corner; a curve over 16.5 stops, from 10 below to 6.5 above middle grey, has slope 2 in the middle; the primaries go
//! back, which in Sobotka's configuration they do not: its colours are paler, its greys and the curve are the same. The curve
//! is the one that Wrensch's polynomials approximate.

use glam::{DMat3, DVec3};

/// What draws BT.709's primaries toward grey, by columns.
const INSET: DMat3 = DMat3::from_cols(
    DVec3::new(
        0.842_479_062_253_094,
        0.042_328_242_261_012_3,
        0.042_375_654_905_705_1,
    ),
    DVec3::new(0.078_433_599_999_999_2, 0.878_468_636_469_772, 0.078_433_6),
    DVec3::new(
        0.079_223_745_147_764_3,
        0.079_166_127_460_543_4,
        0.879_142_973_793_104,
    ),
);

/// Stops above and below middle grey.
const RANGE: [f64; 2] = [-10.0, 6.5];
/// The curve's slope at middle grey, where it has the value ½.
const SLOPE: f64 = 2.0;
/// How quickly the curve bends below and above.
const POWERS: [f64; 2] = [3.0, 3.25];

/// Display-referred linear BT.709 in [0, 1].
pub(super) fn view(rgb: [f32; 3]) -> [f32; 3] {
    let drawn = INSET * DVec3::from(rgb.map(|v| f64::from(v.max(0.0))));
    let [least, most] = RANGE;
    let curved = drawn.to_array().map(|v| {
        let stops = (v / 0.18).max(1e-10).log2();
        curve(((stops - least) / (most - least)).clamp(0.0, 1.0))
    });
    // The curve's codes are those of a display with exponent 2.2.
    let back = INSET.inverse() * DVec3::from(curved);
    back.to_array().map(|v| v.clamp(0.0, 1.0).powf(2.2) as f32)
}

/// From [0, 1] to [0, 1]: through (0, 0), (pivot, ½) and (1, 1), there with slope 2, with x/(1 + xᵖ)^(1/p) on both
/// sides.
fn curve(x: f64) -> f64 {
    let pivot = -RANGE[0] / (RANGE[1] - RANGE[0]);
    let side = if x < pivot { 0 } else { 1 };
    let (length, power) = ([pivot, 1.0 - pivot][side], POWERS[side]);
    // Chosen so that the end is met.
    let scale = SLOPE * length / ((SLOPE * length / 0.5).powf(power) - 1.0).powf(1.0 / power);
    let t = SLOPE * (x - pivot).abs() / scale;
    let bent = scale * t / (1.0 + t.powf(power)).powf(1.0 / power);
    if side == 0 { 0.5 - bent } else { 0.5 + bent }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Wrensch's polynomial of degree 6, which is nowhere far from a curve like this.
    #[test]
    fn the_curve_is_what_the_published_polynomial_approximates() {
        const COEFFICIENTS: [f64; 7] = [-0.00232, 0.1191, 0.4298, -6.868, 31.96, -40.14, 15.5];
        let mut square = 0.0;
        for i in 0..=1000 {
            let x = f64::from(i) / 1000.0;
            let fit = COEFFICIENTS.iter().rev().fold(0.0, |sum, c| sum * x + c);
            square += (fit - curve(x)).powi(2) / 1001.0;
        }
        assert!(square.sqrt() < 0.003, "{square}");
        assert!(curve(0.0).abs() < 1e-9 && (curve(1.0) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn middle_grey_is_half_a_code_and_bright_colours_go_to_white() {
        let grey = view([0.18; 3]);
        assert!(
            grey.iter().all(|v| (v.powf(1.0 / 2.2) - 0.5).abs() < 1e-4),
            "{grey:?}"
        );
        let [red, green, blue] = view([80.0, 0.8, 0.8]);
        assert!(
            red > 0.9 && green > 0.2 && blue > 0.2,
            "{red} {green} {blue}"
        );
        assert_eq!(view([0.0; 3]), [0.0; 3]);
        assert!(
            view([f32::NAN, -1.0, f32::INFINITY])
                .iter()
                .all(|v| (0.0..=1.0).contains(v))
        );
    }
}
