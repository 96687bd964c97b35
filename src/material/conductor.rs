//! `conductor`: a polished metal. `material` names one of the table, or `eta` and `k` give its index of
//! refraction; without either it is a perfect mirror. `specular_reflectance` (1) multiplies.

use glam::{Vec2, Vec3};

use super::ior::Complex;
use super::{Bsdf, BsdfSample, Lobes, fresnel};
use crate::color::{ColorModel, Role};
use crate::description::Properties;
use crate::description::declared::{Plugin, texture};
use crate::error::Result;
use crate::interaction::Interaction;
use crate::texture::{Palettes, Texture};

/// A metallic mirror.
#[derive(Clone, Debug)]
pub struct Conductor<C: ColorModel> {
    index: Complex<C>,
    specular_reflectance: Texture<C>,
}

impl<C: ColorModel> Conductor<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a smooth metal",
        properties: &[
            super::ior::CONDUCTOR,
            &[texture(
                "specular_reflectance",
                1.0,
                "factor on what is reflected",
            )],
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        Ok(Self {
            index: Complex::build(properties, palettes)?,
            specular_reflectance: palettes.colors.texture(
                properties,
                "specular_reflectance",
                Role::Reflectance,
            )?,
        })
    }
}

impl<C: ColorModel> Bsdf<C> for Conductor<C> {
    fn lobes(&self) -> Lobes {
        Lobes::MIRROR
    }

    fn sample(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        _u1: f32,
        _u2: Vec2,
        w: &C::Wavelengths,
    ) -> Option<BsdfSample<C::Sample>> {
        (wi.z > 0.0).then(|| BsdfSample {
            wo: fresnel::mirror(wi),
            weight: self.index.fresnel(at, wi.z, w) * self.specular_reflectance.eval(at, w),
            pdf: 1.0,
            eta: 1.0,
            delta: true,
            null: false,
        })
    }
}
