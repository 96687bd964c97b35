//! `pplastic`: a matte base under a clear, rough coat, as Baek et al. (*Simultaneous acquisition of polarimetric SVBRDF
//! and normals*, 2018) simplify it: light enters the coat and leaves it once, f = ρ_d (1 − F_i)(1 − F_o)/π + ρ_s·F·D·G/
//! (4 cos θ_i cos θ_o). Polarisation is not followed here, and the values are those of Mitsuba's variants without it. The
//! coat's index is `eta`, which may be a texture, or `int_ior` over `ext_ior`.

use std::f32::consts::FRAC_1_PI;

use super::microfacet::Roughness;
use super::{BlockBsdf, Bsdf, BsdfSamples, BsdfValues, Lobes, fresnel, ior, mean, single_face};
use crate::color::{ColorModel, Mono, Role};
use crate::description::Properties;
use crate::description::declared::{Plugin, number, texture};
use crate::error::Result;
use crate::interaction::Points;
use crate::lanes::{Lanes, Vec2, Vec3, warp};
use crate::texture::{Palettes, Texture};

/// A matte base under a rough coat that light enters and leaves once.
#[derive(Clone, Debug)]
pub struct PPlastic<C: ColorModel> {
    diffuse_reflectance: Texture<C>,
    specular_reflectance: Texture<C>,
    roughness: Roughness,
    eta: Index,
    /// How often the coat's reflection is drawn, and not the base.
    specular_weight: f32,
}

/// Index of refraction, coat over surroundings.
#[derive(Clone, Debug)]
enum Index {
    Same(f32),
    Varying(Texture<Mono>),
}

impl Index {
    #[inline(always)]
    fn at<F: Lanes>(&self, at: &Points<'_, F>) -> F {
        match self {
            Self::Same(eta) => F::splat(*eta),
            Self::Varying(eta) => eta.numbers(at),
        }
    }
}

impl<C: ColorModel> PPlastic<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a matte base under a clear, rough coat, without light that goes back and forth between them",
        properties: &[
            &super::ior::dielectric("polypropylene"),
            &[
                number(
                    "eta",
                    1.5,
                    "index of refraction of the coat, in place of both",
                )
                .absent("int_ior over ext_ior"),
                texture("diffuse_reflectance", 0.5, "of the base"),
                texture(
                    "specular_reflectance",
                    1.0,
                    "factor on what the coat reflects",
                ),
            ],
            super::microfacet::STRETCHED,
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let given = ["int_ior", "ext_ior"]
            .into_iter()
            .find(|name| properties.has(name));
        let eta = match (properties.has("eta"), given) {
            (true, Some(name)) => {
                return Err(properties.error(name, "give either eta, or int_ior and ext_ior"));
            }
            (true, None) => Index::Varying(palettes.numbers.number(properties, "eta")?),
            (false, _) => Index::Same(ior::relative_and_different(properties)?),
        };
        let colors = &palettes.colors;
        let diffuse_reflectance =
            colors.texture(properties, "diffuse_reflectance", Role::Reflectance)?;
        let specular_reflectance =
            colors.texture(properties, "specular_reflectance", Role::Reflectance)?;
        let [diffuse, specular] =
            [&diffuse_reflectance, &specular_reflectance].map(|texture| mean(palettes, texture));
        let total = diffuse + specular;
        Ok(Self {
            specular_weight: if total > 0.0 { specular / total } else { 0.5 },
            diffuse_reflectance,
            specular_reflectance,
            roughness: Roughness::build(properties, &palettes.numbers)?,
            eta,
        })
    }
}

impl<C: ColorModel> Bsdf<C> for PPlastic<C> {
    fn lobes(&self) -> Lobes {
        Lobes::REFLECTION
    }

    single_face!();
}

impl<C: ColorModel> BlockBsdf<C> for PPlastic<C> {
    #[inline(always)]
    fn eval_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        wo: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        let (zero, one, four) = (F::zero(), F::one(), F::splat(4.0));
        let (facets, eta) = (self.roughness.at_lanes(at), self.eta.at(at));
        let m = (wi + wo).normalize();
        let reflected = fresnel::dielectric_lanes(wi.dot(m), eta).reflectance;
        let coat = reflected * facets.eval(m) * facets.g(wi, wo, m) / (four * wi.z);
        let enters = one - fresnel::dielectric_lanes(wo.z, eta).reflectance;
        let leaves = one - fresnel::dielectric_lanes(wi.z, eta).reflectance;
        let base = enters * leaves * wo.z * F::splat(FRAC_1_PI);
        let specular = F::splat(self.specular_weight);
        let coat_pdf = facets.pdf(wi, m) / (four * wo.dot(m));
        let values = BsdfValues {
            value: self.specular_reflectance.eval_lanes(at, w) * coat
                + self.diffuse_reflectance.eval_lanes(at, w) * base,
            pdf: specular * coat_pdf + (one - specular) * warp::cosine_hemisphere_pdf(wo.z),
        };
        values.only(zero.lt(wi.z) & zero.lt(wo.z))
    }

    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        u1: F,
        u2: Vec2<F>,
        w: &[C::Wavelengths],
    ) -> BsdfSamples<F, C::Columns<F>> {
        let coat = fresnel::reflect(wi, self.roughness.at_lanes(at).sample(wi, u2));
        let base = warp::cosine_hemisphere(u2);
        let wo = Vec3::select(u1.lt(F::splat(self.specular_weight)), coat, base);
        self.eval_lanes(at, wi, wo, w).as_samples(wo, F::one())
    }
}
