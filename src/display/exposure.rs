//! How bright an image becomes: a factor on scene-referred values.

use crate::color::luminance;

/// The luminance that [`Exposure::Auto`] takes the geometric mean to: that of middle grey.
pub(super) const MIDDLE_GREY: f32 = 0.18;

/// A factor on linear values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// 2 to this power.
    Stops(f32),
    /// What takes the geometric mean of luminance to middle grey, 0.18.
    Auto,
}

impl Exposure {
    /// The factor for these linear BT.709 pixels.
    pub fn factor(self, pixels: &[[f32; 3]]) -> f32 {
        match self {
            Self::Stops(stops) => stops.exp2(),
            Self::Auto => geometric_mean(pixels).map_or(1.0, |mean| MIDDLE_GREY / mean),
        }
    }
}

/// The geometric mean of the luminances of pixels that are not black, whose logarithm would be −∞; `None` where
/// all are.
pub(super) fn geometric_mean(pixels: &[[f32; 3]]) -> Option<f32> {
    let (mut sum, mut count) = (0.0, 0_u64);
    for pixel in pixels {
        let luminance = luminance(*pixel);
        if luminance > 0.0 && luminance.is_finite() {
            sum += f64::from(luminance).ln();
            count += 1;
        }
    }
    (count > 0).then(|| (sum / count as f64).exp() as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn auto_takes_the_geometric_mean_to_middle_grey() {
        let pixels = [[0.01; 3], [1.0; 3], [0.0; 3], [f32::NAN; 3], [-1.0; 3]];
        assert!((geometric_mean(&pixels).unwrap() - 0.1).abs() < 1e-6);
        assert!((Exposure::Auto.factor(&pixels) - 1.8).abs() < 1e-5);
        assert_eq!(Exposure::Auto.factor(&[[0.0; 3]]), 1.0);
        assert_eq!(Exposure::Stops(-2.0).factor(&pixels), 0.25);
    }
}
