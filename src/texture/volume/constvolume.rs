//! `constvolume`: one value (1) everywhere.

use super::field::{Field, Placement, TO_WORLD, role_of};
use crate::color::ColorModel;
use crate::description::Properties;
use crate::description::declared::{Plugin, texture};
use crate::error::Result;
use crate::math::Bounds;
use crate::texture::Palette;

/// One value.
#[derive(Clone, Debug)]
pub struct ConstVolume<C: ColorModel> {
    value: C::Stored,
    bounds: Bounds,
}

impl<C: ColorModel> ConstVolume<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "the same everywhere",
        properties: &[&[
            texture("value", 1.0, "the value, a color or a spectrum"),
            TO_WORLD,
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, palette: &Palette<C>) -> Result<Self> {
        let role = role_of(properties, "value", palette.role);
        Ok(Self {
            value: palette.color(properties, "value", role)?,
            bounds: Placement::of(properties, glam::DMat4::IDENTITY)?.bounds,
        })
    }

    /// That value in the unit cube as it is.
    pub(super) fn everywhere(value: C::Stored) -> Self {
        Self {
            value,
            bounds: Placement::identity().bounds,
        }
    }

    /// The value.
    #[inline(always)]
    pub(super) fn value(&self) -> &C::Stored {
        &self.value
    }
}

impl<C: ColorModel> Field<C> for ConstVolume<C> {
    fn constant(&self) -> Option<&C::Stored> {
        Some(&self.value)
    }

    fn bounds(&self) -> Bounds {
        self.bounds
    }
}
