//! A sensor's response curves: what a film's channel makes of a spectrum, ∫ R(λ) L(λ) dλ, not normalised.

use super::comb::{Comb, Teeth, VISIBLE};
use super::spectrum::Spectrum;

/// A channel of a film.
#[derive(Clone, Debug, PartialEq)]
pub struct Response {
    /// The channel's name.
    pub name: String,
    /// The response, at least 0.
    pub spectrum: Spectrum,
}

impl Response {
    /// Every wavelength to which one of the responses is not 0, in nm: what a comb has to cover.
    pub fn range(responses: &[Self]) -> [f32; 2] {
        let supports = responses.iter().map(|r| r.spectrum.support());
        let supports = supports.map(|support| support.unwrap_or(VISIBLE));
        let both = supports.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]);
        both.unwrap_or(VISIBLE)
    }

    /// What the channel makes of values at some of the wavelengths of a comb.
    pub(super) fn of(&self, comb: &Comb, values: &[f32], wavelengths: &Teeth<f32>) -> f32 {
        let products = values.iter().enumerate();
        let sum: f64 = products
            .map(|(i, value)| f64::from(value * self.spectrum.at(wavelengths.at(i))))
            .sum();
        (sum * f64::from(comb.width())) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::{Color, Role};

    #[test]
    fn a_band_s_response_integrates_its_width() {
        let ones = Color::Curve(vec![(430.0, 1.0), (471.0, 1.0)]);
        let response = Response {
            name: "b".into(),
            spectrum: Spectrum::new(&ones, Role::Quantity).unwrap(),
        };
        assert_eq!(
            Response::range(std::slice::from_ref(&response)),
            [430.0, 471.0]
        );
        let comb = Comb::new(16, VISIBLE).unwrap();
        let steps = 400;
        let mean: f32 = (0..steps)
            .map(|s| {
                let u = (s as f32 + 0.5) / steps as f32;
                response.of(&comb, &[2.0; 16], &comb.teeth(0, 1, u)) / steps as f32
            })
            .sum();
        assert!((mean - 82.0).abs() < 0.3, "{mean}");
    }
}
