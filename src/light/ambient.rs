//! `ambient`: light of the same `radiance` everywhere, from nowhere and never shadowed, which only surfaces
//! with an `ambient_reflectance` return. It is the I_a of Phong's equation and no light of physics: in `path`
//! and `direct` a surface emits I_a·k_a of its own, and nobody looks for the light.

use glam::{Vec2, Vec3};

use super::{Emitter, LightContext, LightSample};
use crate::color::{Color, ColorModel, Role};
use crate::description::Properties;
use crate::error::Result;

/// Light from nowhere.
#[derive(Clone, Debug)]
pub struct Ambient<C: ColorModel> {
    radiance: C::Stored,
}

impl<C: ColorModel> Ambient<C> {
    pub(super) fn build(
        properties: &Properties<'_>,
        context: &LightContext<'_, C>,
    ) -> Result<Self> {
        let colors = &context.palettes.colors;
        let default = Color::Grey(1.0);
        Ok(Self {
            radiance: colors.color(properties, "radiance", Role::Emission, default)?,
        })
    }
}

impl<C: ColorModel> Emitter<C> for Ambient<C> {
    fn sample(
        &self,
        _from: Vec3,
        _u: Vec2,
        _wavelengths: &C::Wavelengths,
    ) -> Option<LightSample<C::Sample>> {
        None
    }

    fn is_ambient(&self) -> bool {
        true
    }

    fn ambient_radiance(&self, wavelengths: &C::Wavelengths) -> C::Sample {
        C::evaluate(&self.radiance, wavelengths)
    }
}
