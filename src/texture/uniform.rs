//! `uniform`: the same `value` everywhere and at every wavelength; also what a plain colour or number in a scene file
//! becomes. `wavelength_min` and `wavelength_max` do not bound it in Mitsuba either.

use super::{Palette, Pattern};
use crate::color::{Color, ColorModel, Role};
use crate::description::Properties;
use crate::description::declared::{Plugin, float};
use crate::error::Result;
use crate::interaction::Interaction;

/// One stored colour.
#[derive(Clone, Debug)]
pub struct Uniform<C: ColorModel> {
    value: C::Stored,
}

impl<C: ColorModel> Uniform<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "the same value everywhere",
        properties: &[&[
            float("value", 1.0, "the value"),
            float("wavelength_min", 360.0, "no bound, in Mitsuba either").without_effect(),
            float("wavelength_max", 830.0, "no bound, in Mitsuba either").without_effect(),
        ]],
    };

    pub(super) fn new(value: C::Stored) -> Self {
        Self { value }
    }

    /// The colour.
    pub fn value(&self) -> &C::Stored {
        &self.value
    }

    pub(super) fn build(properties: &Properties<'_>, palette: &Palette<C>) -> Result<Self> {
        let value = properties.float("value")?;
        palette.refuse_negative_light(properties, "value", &[value])?;
        let value = palette.store(properties, "value", &Color::Flat(value), Role::Quantity)?;
        Ok(Self { value })
    }
}

impl<C: ColorModel> Pattern<C> for Uniform<C> {
    #[inline]
    fn eval(&self, _at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> C::Sample {
        C::evaluate(&self.value, wavelengths)
    }

    fn constant(&self) -> Option<&C::Stored> {
        Some(&self.value)
    }
}
