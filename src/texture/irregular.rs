//! `irregular`: a spectrum by its `values` at as many `wavelengths` (nm, increasing), linear between them and 0
//! outside.

use super::regular::numbers;
use super::{Palette, Pattern};
use crate::color::ColorModel;
use crate::description::Properties;
use crate::description::declared::{Plugin, string};
use crate::error::Result;
use crate::interaction::Interaction;

/// One stored spectrum.
#[derive(Clone, Debug)]
pub struct Irregular<C: ColorModel> {
    value: C::Stored,
}

impl<C: ColorModel> Irregular<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a spectrum by values at wavelengths",
        properties: &[&[
            string("wavelengths", "", "increasing, in nm").required(),
            string("values", "", "one for each; linear between, 0 outside").required(),
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, palette: &Palette<C>) -> Result<Self> {
        let wavelengths = numbers(properties, "wavelengths")?;
        let values = numbers(properties, "values")?;
        if let Some(pair) = wavelengths.windows(2).find(|w| w[0] >= w[1]) {
            let message = format!("wavelengths must increase: {} follows {}", pair[1], pair[0]);
            return Err(properties.error("wavelengths", message));
        }
        if wavelengths.len() != values.len() {
            let message = format!(
                "{} values for {} wavelengths",
                values.len(),
                wavelengths.len()
            );
            return Err(properties.error("values", message));
        }
        let points = wavelengths.into_iter().zip(values).collect();
        let value = palette.curve(properties, points)?;
        Ok(Self { value })
    }
}

impl<C: ColorModel> Pattern<C> for Irregular<C> {
    fn eval(&self, _at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> C::Sample {
        C::evaluate(&self.value, wavelengths)
    }

    fn constant(&self) -> Option<&C::Stored> {
        Some(&self.value)
    }
}
