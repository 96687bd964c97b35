//! `conductor`: a polished metal. `material` names one of the table, or `eta` and `k` give its index of
//! refraction; without either it is a perfect mirror. `specular_reflectance` (1) multiplies.

use super::ior::Complex;
use super::{BlockBsdf, Bsdf, BsdfSamples, Lobes, fresnel, single_face};
use crate::color::{ColorModel, Role};
use crate::description::Properties;
use crate::description::declared::{Plugin, texture};
use crate::error::Result;
use crate::interaction::Points;
use crate::lanes::{Lanes, Vec2, Vec3};
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

    single_face!();
}

impl<C: ColorModel> BlockBsdf<C> for Conductor<C> {
    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        _u1: F,
        _u2: Vec2<F>,
        w: &[C::Wavelengths],
    ) -> BsdfSamples<F, C::Columns<F>> {
        let factor = self.specular_reflectance.eval_lanes(at, w);
        let weight = self.index.fresnel(at, wi.z, w) * factor;
        let seen = F::zero().lt(wi.z);
        BsdfSamples::delta(seen, fresnel::mirror(wi), weight, F::one())
    }
}
