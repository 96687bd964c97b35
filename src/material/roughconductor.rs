//! `roughconductor`: brushed or cast metal, f = F·D·G / (4 cos θ_i cos θ_o) (Cook and Torrance, 1982;
//! Walter et al., 2007). `material`, or `eta` and `k`, as for a conductor; `distribution` beckmann or ggx;
//! `alpha` (0.1), or `alpha_u` and `alpha_v`, may be textures; `specular_reflectance` (1) multiplies.

use super::ior::Complex;
use super::microfacet::Roughness;
use super::{BlockBsdf, Bsdf, BsdfSamples, BsdfValues, Lobes, fresnel, single_face};
use crate::color::{ColorModel, Role};
use crate::description::Properties;
use crate::description::declared::{Plugin, texture};
use crate::error::Result;
use crate::interaction::Points;
use crate::lanes::{Lanes, Vec2, Vec3};
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

    single_face!();
}

impl<C: ColorModel> BlockBsdf<C> for RoughConductor<C> {
    #[inline(always)]
    fn eval_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        wo: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        let (zero, four) = (F::zero(), F::splat(4.0));
        let facets = self.roughness.at_lanes(at);
        let m = (wi + wo).normalize();
        let scale = facets.eval(m) * facets.g(wi, wo, m) / (four * wi.z);
        let factor = self.specular_reflectance.eval_lanes(at, w);
        let values = BsdfValues {
            value: self.index.fresnel(at, wi.dot(m), w) * factor * scale,
            pdf: facets.pdf(wi, m) / (four * wo.dot(m)),
        };
        values.only(zero.lt(wi.z) & zero.lt(wo.z) & zero.lt(scale))
    }

    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        _u1: F,
        u2: Vec2<F>,
        w: &[C::Wavelengths],
    ) -> BsdfSamples<F, C::Columns<F>> {
        let m = self.roughness.at_lanes(at).sample(wi, u2);
        let wo = fresnel::reflect(wi, m);
        self.eval_lanes(at, wi, wo, w).as_samples(wo, F::one())
    }
}
