//! `roughconductor`: brushed or cast metal, f = F·D·G / (4 cos θ_i cos θ_o) (Cook and Torrance, 1982;
//! Walter et al., 2007). `material`, or `eta` and `k`, as for a conductor; `distribution` beckmann or ggx;
//! `alpha` (0.1), or `alpha_u` and `alpha_v`, may be textures; `specular_reflectance` (1) multiplies.

use glam::{Vec2, Vec3};

use super::ior::Complex;
use super::microfacet::Roughness;
use super::{Bsdf, BsdfSample, BsdfValue, Lobes, fresnel};
use crate::color::{ColorModel, Role};
use crate::description::Properties;
use crate::description::declared::{Plugin, texture};
use crate::error::Result;
use crate::interaction::Interaction;
use crate::texture::{Palettes, Texture};

/// A rough metal.
#[derive(Clone, Debug)]
pub struct RoughConductor<C: ColorModel> {
    roughness: Roughness,
    index: Complex<C>,
    specular_reflectance: Texture<C>,
}

impl<C: ColorModel> RoughConductor<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a rough metal",
        properties: &[
            super::ior::CONDUCTOR,
            super::microfacet::STRETCHED,
            &[texture(
                "specular_reflectance",
                1.0,
                "factor on what is reflected",
            )],
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        Ok(Self {
            roughness: Roughness::build(properties, &palettes.numbers)?,
            index: Complex::build(properties, palettes)?,
            specular_reflectance: palettes.colors.texture(
                properties,
                "specular_reflectance",
                Role::Reflectance,
            )?,
        })
    }
}

impl<C: ColorModel> Bsdf<C> for RoughConductor<C> {
    fn lobes(&self) -> Lobes {
        Lobes::REFLECTION
    }

    fn eval(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        wo: Vec3,
        w: &C::Wavelengths,
    ) -> Option<BsdfValue<C::Sample>> {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return None;
        }
        let distribution = self.roughness.at(at);
        let m = (wi + wo).normalize();
        let scale = distribution.eval(m) * distribution.g(wi, wo, m) / (4.0 * wi.z);
        (scale > 0.0).then(|| BsdfValue {
            value: self.index.fresnel(at, wi.dot(m), w)
                * self.specular_reflectance.eval(at, w)
                * scale,
            pdf: distribution.pdf(wi, m) / (4.0 * wo.dot(m)),
        })
    }

    fn sample(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        _u1: f32,
        u2: Vec2,
        w: &C::Wavelengths,
    ) -> Option<BsdfSample<C::Sample>> {
        if wi.z <= 0.0 {
            return None;
        }
        let m = self.roughness.at(at).sample(wi, u2);
        let wo = fresnel::reflect(wi, m);
        self.eval(at, wi, wo, w)?.as_sample(wo, 1.0)
    }
}
