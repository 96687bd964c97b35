//! `roughplastic`: a matte base under a clear, rough coat. As `plastic`, with the coat's reflection that
//! of microfacets and its transmittance averaged over them, tabulated by the cosine of incidence when the
//! scene is built. `distribution` beckmann or ggx; `alpha` (0.1) is a number.

use std::sync::Arc;

use rayon::prelude::*;

use super::microfacet::{Distribution, Kind};
use super::plastic::{Base, coat_probability};
use super::{BlockBsdf, Bsdf, BsdfSamples, BsdfValues, Lobes, fresnel, ior, single_face};
use crate::color::{ColorModel, Role};
use crate::description::Properties;
use crate::description::declared::{Plugin, float};
use crate::error::Result;
use crate::interaction::Points;
use crate::lanes::{Lanes, Vec2, Vec3, warp};
use crate::math::quadrature;
use crate::texture::{Palettes, Texture};

/// A matte base under a rough coat.
#[derive(Clone, Debug)]
pub struct RoughPlastic<C: ColorModel> {
    base: Base<C>,
    distribution: Distribution<f32>,
    /// The share of light that passes the coat from outside, at equal steps of the cosine from 0 to 1.
    transmittance: Arc<[f32]>,
    specular_reflectance: Texture<C>,
    specular_weight: f32,
}

/// Cosines in the table.
const STEPS: usize = 64;

/// The cosine of entry `i` of the table; the first is not quite 0.
fn cosine(i: usize) -> f32 {
    (i as f32 / (STEPS - 1) as f32).max(1e-6)
}

impl<C: ColorModel> RoughPlastic<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a matte base under a clear, rough coat",
        properties: &[
            &super::ior::dielectric("polypropylene"),
            super::plastic::PROPERTIES,
            super::microfacet::KIND,
            &[float(
                "alpha",
                super::microfacet::DEFAULT_ALPHA,
                "roughness of the coat, at least 0.0001",
            )],
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let eta = ior::relative_and_different(properties)?;
        let kind = Kind::build(properties)?;
        let alpha = properties.float("alpha")? as f32;
        let visible = Kind {
            sample_visible: true,
            ..kind
        };
        let facets = Distribution::new(visible, alpha, alpha);
        let table = |f: fn(&Distribution<f32>, f32, f32) -> f32, eta| -> Vec<f32> {
            let cosines = (0..STEPS).into_par_iter().map(cosine);
            cosines.map(|cos| f(&facets, cos, eta)).collect()
        };
        let inside = table(reflectance, 1.0 / eta);
        let internal: f32 = inside.iter().enumerate().map(|(i, r)| cosine(i) * r).sum();
        let base = Base::build(properties, palettes, eta, internal * 2.0 / STEPS as f32)?;
        let specular_reflectance =
            palettes
                .colors
                .texture(properties, "specular_reflectance", Role::Reflectance)?;
        Ok(Self {
            distribution: Distribution::new(kind, alpha, alpha),
            transmittance: table(transmittance, eta).into(),
            specular_weight: base.specular_weight(palettes, &specular_reflectance),
            base,
            specular_reflectance,
        })
    }

    /// The share of light that passes the coat at the cosine `cos`; that at 0 where it is below.
    #[inline(always)]
    fn passes<F: Lanes>(&self, cos: F) -> F {
        let x = cos.clamp(0.0, 1.0) * F::splat((STEPS - 1) as f32);
        let (mut low, mut high, mut between) = (F::ROW, F::ROW, F::ROW);
        for lane in 0..F::WIDTH {
            let x = x.lane(lane);
            let i = (x as usize).min(STEPS - 2);
            low[lane] = self.transmittance[i];
            high[lane] = self.transmittance[i + 1];
            between[lane] = x - i as f32;
        }
        let f = F::load(&between);
        F::load(&low) * (F::one() - f) + F::load(&high) * f
    }

    /// The distribution in lanes.
    #[inline(always)]
    fn facets<F: Lanes>(&self) -> Distribution<F> {
        self.distribution.all()
    }
}

/// The mean of `f`(wi, facet) over the facets that are seen at the cosine `cos`.
fn mean_over_facets(
    facets: &Distribution<f32>,
    cos: f32,
    eta: f32,
    f: impl Fn(Vec3<f32>, Vec3<f32>) -> f32,
) -> f32 {
    let wi = Vec3::new(f32::max(1.0 - cos * cos, 0.0).sqrt(), 0.0, cos);
    // Total reflection makes a step in the integrand.
    let rule = quadrature::gauss_legendre(if eta > 1.0 { 32 } else { 64 });
    let mut sum = 0.0;
    for (x, wx) in &rule {
        for (y, wy) in &rule {
            let m = facets.sample(wi, Vec2::new(*x as f32, *y as f32));
            sum += wx * wy * f64::from(f(wi, m));
        }
    }
    sum as f32
}

/// The share of light that a rough boundary reflects.
fn reflectance(facets: &Distribution<f32>, cos: f32, eta: f32) -> f32 {
    mean_over_facets(facets, cos, eta, |wi, m| {
        let wo = fresnel::reflect(wi, m);
        if wo.z <= 0.0 {
            return 0.0;
        }
        facets.g1(wo, m) * fresnel::dielectric(wi.dot(m), eta).reflectance
    })
}

/// The share of light that passes a rough boundary.
fn transmittance(facets: &Distribution<f32>, cos: f32, eta: f32) -> f32 {
    mean_over_facets(facets, cos, eta, |wi, m| {
        let boundary = fresnel::dielectric(wi.dot(m), eta);
        let wo = fresnel::refract(wi, m, &boundary);
        if wo.z >= 0.0 {
            return 0.0;
        }
        facets.g1(wo, m) * (1.0 - boundary.reflectance)
    })
}

impl<C: ColorModel> Bsdf<C> for RoughPlastic<C> {
    fn lobes(&self) -> Lobes {
        Lobes::REFLECTION
    }

    single_face!();
}

impl<C: ColorModel> BlockBsdf<C> for RoughPlastic<C> {
    #[inline(always)]
    fn eval_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        wo: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        let (zero, one, four) = (F::zero(), F::one(), F::splat(4.0));
        let facets = self.facets::<F>();
        let m = (wi + wo).normalize();
        let (t_i, t_o) = (self.passes(wi.z), self.passes(wo.z));
        let reflectance = fresnel::dielectric(wi.dot(m), self.base.eta).reflectance;
        let specular = reflectance * facets.eval(m) * facets.g(wi, wo, m) / (four * wi.z);
        let probability = coat_probability(one - t_i, self.specular_weight);
        let coat_pdf = facets.pdf(wi, m) / (four * wo.dot(m));
        let base_pdf = warp::cosine_hemisphere_pdf(wo.z);
        let values = BsdfValues {
            value: self.specular_reflectance.eval_lanes(at, w) * specular
                + self.base.eval(at, t_i, t_o, wo.z, w),
            pdf: probability * coat_pdf + (one - probability) * base_pdf,
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
        let reflected = F::one() - self.passes(wi.z);
        let probability = coat_probability(reflected, self.specular_weight);
        let coat = fresnel::reflect(wi, self.facets::<F>().sample(wi, u2));
        let base = warp::cosine_hemisphere(u2);
        let wo = Vec3::select(u1.lt(probability), coat, base);
        self.eval_lanes(at, wi, wo, w).as_samples(wo, F::one())
    }
}
