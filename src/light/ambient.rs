//! `ambient`: light of the same `radiance` everywhere, from nowhere and never shadowed, which only surfaces
//! with an `ambient_reflectance` return. It is the I_a of Phong's equation and no light of physics: in `path`
//! and `direct` a surface emits I_a·k_a of its own, and nobody looks for the light.

use glam::Vec2;

use super::{Emitter, LightContext, LightSample};
use crate::color::{ColorModel, Role};
use crate::description::Properties;
use crate::description::declared::{Plugin, color};
use crate::error::Result;
use crate::interaction::Reference;

/// Light from nowhere.
#[derive(Clone, Debug)]
pub struct Ambient<C: ColorModel> {
    radiance: C::Stored,
}

impl<C: ColorModel> Ambient<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "light from nowhere that meets ambient_reflectance alone",
        properties: &[&[color("radiance", 1.0, "everywhere; W/(m² sr)")]],
    };

    pub(super) fn build(
        properties: &Properties<'_>,
        context: &LightContext<'_, C>,
    ) -> Result<Self> {
        let colors = &context.palettes.colors;
        Ok(Self {
            radiance: colors.color(properties, "radiance", Role::Emission)?,
        })
    }
}

impl<C: ColorModel> Emitter<C> for Ambient<C> {
    fn sample(
        &self,
        _from: Reference,
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
