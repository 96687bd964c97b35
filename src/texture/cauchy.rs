//! `cauchy`, an extension of Étendue's: an index of refraction n over wavelength, n = A + B/λ² + C/λ⁴ with λ in micrometres
//! (Cauchy, 1836).

use super::sellmeier::tabulated;
use super::{Palette, Pattern};
use crate::color::ColorModel;
use crate::description::Properties;
use crate::description::declared::{Plugin, float};
use crate::error::Result;
use crate::interaction::Interaction;

/// One stored index.
#[derive(Clone, Debug)]
pub struct Cauchy<C: ColorModel> {
    value: C::Stored,
}

impl<C: ColorModel> Cauchy<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "an index of refraction by Cauchy's formula",
        properties: &[&[
            float("a", 1.5, "A").positive(),
            float("b", 0.0, "B, in µm²").at_least(0.0),
            float("c", 0.0, "C, in µm⁴").at_least(0.0),
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, palette: &Palette<C>) -> Result<Self> {
        let number = |name| properties.float(name);
        let (a, b, c) = (number("a")?, number("b")?, number("c")?);
        let points = tabulated(|nanometres| {
            let square = (nanometres * 1e-3).powi(2);
            a + b / square + c / (square * square)
        });
        let value = palette.index(properties, points)?;
        Ok(Self { value })
    }
}

impl<C: ColorModel> Pattern<C> for Cauchy<C> {
    fn eval(&self, _at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> C::Sample {
        C::evaluate(&self.value, wavelengths)
    }

    fn constant(&self) -> Option<&C::Stored> {
        Some(&self.value)
    }
}
