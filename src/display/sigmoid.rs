//! A sigmoid over the logarithm of light: R' = R / (L/a + R), where L is the geometric mean of luminance. What is as
//! bright as the mean becomes a / (1 + a); a larger a is brighter.

use super::exposure::{MIDDLE_GREY, geometric_mean};

/// Applies it to linear values, with a = 0.18/0.82, by which the mean becomes middle grey. `exposure` multiplies the
/// values but not the mean.
pub(super) fn view(pixels: &mut [[f32; 3]], exposure: f32) {
    let a = MIDDLE_GREY / (1.0 - MIDDLE_GREY);
    let Some(mean) = geometric_mean(pixels) else {
        return;
    };
    for pixel in pixels {
        *pixel = pixel.map(|v| {
            let v = (v * exposure).max(0.0);
            if v.is_finite() {
                v / (mean / a + v)
            } else {
                1.0
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_becomes_middle_grey_and_nothing_exceeds_one() {
        let mut pixels = [
            [0.5; 3],
            [0.005; 3],
            [50.0; 3],
            [0.0; 3],
            [f32::INFINITY; 3],
        ];
        view(&mut pixels, 1.0);
        assert!((pixels[0][0] - 0.18).abs() < 1e-6, "{pixels:?}");
        assert!((pixels[1][0] - 0.01 * 0.18 / (0.82 + 0.01 * 0.18)).abs() < 1e-6);
        assert!(pixels[2][0] > 0.95 && pixels[2][0] < 1.0);
        assert_eq!((pixels[3], pixels[4]), ([0.0; 3], [1.0; 3]));
        let mut brighter = [[0.5; 3], [0.5; 3]];
        view(&mut brighter, 2.0);
        assert!((brighter[0][0] - 0.36 / (0.82 + 0.36)).abs() < 1e-6);
    }
}
