//! `uniform`: the same value everywhere; what a plain colour or number in a scene file becomes.

use super::{Palette, Pattern};
use crate::color::{Color, ColorModel};
use crate::description::Properties;
use crate::error::Result;
use crate::interaction::Interaction;

/// One stored colour.
#[derive(Clone, Debug)]
pub struct Uniform<C: ColorModel> {
    value: C::Stored,
}

impl<C: ColorModel> Uniform<C> {
    pub(super) fn new(value: C::Stored) -> Self {
        Self { value }
    }

    /// The colour.
    pub fn value(&self) -> &C::Stored {
        &self.value
    }

    pub(super) fn build(properties: &Properties<'_>, palette: &Palette<C>) -> Result<Self> {
        let value = properties.float("value")?.unwrap_or(1.0);
        let stored = palette.color.store(&Color::Grey(value), palette.role);
        stored
            .map(Self::new)
            .map_err(|e| properties.error("value", e))
    }
}

impl<C: ColorModel> Pattern<C> for Uniform<C> {
    #[inline]
    fn eval(&self, _at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> C::Sample {
        C::evaluate(&self.value, wavelengths)
    }
}
