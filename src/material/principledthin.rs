//! `principledthin`: Disney's material for sheets without thickness (see [`super::disney`]): light is
//! reflected or passes without being bent, by GGX lobes as far as `spec_trans` goes and diffusely
//! otherwise, on either side by `diff_trans` (0 to 2, where 1 is half). `eta` (1.5) may be a texture.

use super::disney::{
    Parameters, Point, Schlick, in_use, lerp, normal_reflectance, rate, sampling_rate,
};
use super::microfacet::Distribution;
use super::{BlockBsdf, Bsdf, BsdfSamples, BsdfValues, Lobes, fresnel, single_face};
use crate::color::{ColorModel, Mono, Spectra};
use crate::description::Properties;
use crate::description::declared::{Plugin, number};
use crate::error::Result;
use crate::interaction::Points;
use crate::lanes::{Lanes, Vec2, Vec3, warp};
use crate::texture::{Palettes, Texture};

/// Disney's thin material.
#[derive(Clone, Debug)]
pub struct PrincipledThin<C: ColorModel> {
    parameters: Parameters<C>,
    eta: Texture<Mono>,
    diff_trans: Texture<Mono>,
    specular_reflectance_rate: f32,
    specular_transmittance_rate: f32,
    diffuse_reflectance_rate: f32,
    diffuse_transmittance_rate: f32,
    transmits: bool,
}

/// Probabilities of sampling the lobes.
#[derive(Clone, Copy, Debug)]
struct Shares<F> {
    specular_reflection: F,
    specular_transmission: F,
    diffuse_reflection: F,
    diffuse_transmission: F,
}

impl<C: ColorModel> PrincipledThin<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "Disney's material for thin sheets",
        properties: &[
            super::disney::PROPERTIES,
            &[
                number("eta", 1.5, "index of refraction, inside over outside"),
                number("diff_trans", 0.0, "matte transmission: 0 is none, 2 is all"),
                sampling_rate("specular_reflectance_sampling_rate"),
                sampling_rate("specular_transmittance_sampling_rate"),
                sampling_rate("diffuse_reflectance_sampling_rate"),
                sampling_rate("diffuse_transmittance_sampling_rate"),
            ],
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let number = |name| palettes.numbers.number(properties, name);
        Ok(Self {
            parameters: Parameters::build(properties, palettes)?,
            eta: number("eta")?,
            diff_trans: number("diff_trans")?,
            specular_reflectance_rate: rate(properties, "specular_reflectance_sampling_rate")?,
            specular_transmittance_rate: rate(properties, "specular_transmittance_sampling_rate")?,
            diffuse_reflectance_rate: rate(properties, "diffuse_reflectance_sampling_rate")?,
            diffuse_transmittance_rate: rate(properties, "diffuse_transmittance_sampling_rate")?,
            transmits: in_use(properties, "spec_trans") || in_use(properties, "diff_trans"),
        })
    }

    /// The diffusely transmitted part, in [0, 1].
    #[inline(always)]
    fn diff_trans<F: Lanes>(&self, at: &Points<'_, F>) -> F {
        F::splat(0.5) * self.diff_trans.numbers(at)
    }

    #[inline(always)]
    fn shares<F: Lanes>(&self, spec_trans: F, diff_trans: F) -> Shares<F> {
        let one = F::one();
        let specular = F::splat(0.5) * spec_trans;
        let diffuse = one - spec_trans;
        let a = specular * F::splat(self.specular_reflectance_rate);
        let b = specular * F::splat(self.specular_transmittance_rate);
        let c = diffuse * (one - diff_trans) * F::splat(self.diffuse_reflectance_rate);
        let d = diffuse * diff_trans * F::splat(self.diffuse_transmittance_rate);
        let total = a + b + c + d;
        Shares {
            specular_reflection: a / total,
            specular_transmission: b / total,
            diffuse_reflection: c / total,
            diffuse_transmission: d / total,
        }
    }
}

/// The facets that reflect light, or at which it passes, which the two boundaries make rougher or smoother.
#[inline(always)]
fn facets<F: Lanes, S: Spectra<F>>(
    point: &Point<F, S>,
    reflect: F::Mask,
    eta: F,
) -> Distribution<F> {
    let passing = F::splat(0.65) * eta - F::splat(0.35);
    point.distribution(F::select(reflect, F::one(), passing))
}

impl<C: ColorModel> Bsdf<C> for PrincipledThin<C> {
    fn lobes(&self) -> Lobes {
        Lobes {
            smooth: true,
            transmission: self.transmits,
        }
    }

    single_face!();
}

impl<C: ColorModel> BlockBsdf<C> for PrincipledThin<C> {
    #[inline(always)]
    fn eval_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        wo: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        let (zero, one) = (F::zero(), F::one());
        // Both sides are alike.
        let up = one.copysign(wi.z);
        let (wi, wo) = (wi * up, wo * up);
        let seen = !(wi.z * wo.z).eq(zero);
        let point = self.parameters.at(at, w);
        let (eta, diff_trans) = (self.eta.numbers(at), self.diff_trans(at));
        let shares = self.shares(point.spec_trans, diff_trans);
        let reflection = zero.lt(wo.z);
        let cos_o = wo.z.abs();
        let mirrored = Vec3::new(wo.x, wo.y, cos_o);
        let m = (wi + mirrored).normalize();
        let cos_m = wi.dot(m);
        let fresnel = fresnel::dielectric_lanes(cos_m, eta).reflectance;
        let matte = one - point.spec_trans;
        let distribution = facets(&point, reflection, eta);
        let dg = distribution.eval(m) * distribution.g(wi, wo, m);
        let specular = point.spec_trans * dg / (F::splat(4.0) * wi.z);
        let facets_pdf = distribution.pdf(wi, m) * (F::splat(0.25) / mirrored.dot(m));
        let cosine_pdf = warp::cosine_hemisphere_pdf(cos_o);

        let (schlick, r0) = (Schlick::new(cos_m, eta), normal_reflectance(eta));
        let mut mirror = point.tint;
        for c in 0..C::Columns::<F>::CHANNELS {
            let tinted = schlick.reflectance(point.tint[c] * r0);
            mirror.set(c, specular * lerp(fresnel, tinted, point.spec_tint));
        }
        let cos_d = wo.dot(m);
        let diffuse = point.diffuse(wi.z, cos_o, cos_d) + point.sheen(cos_d);
        let reflected = BsdfValues {
            value: mirror + diffuse * (matte * (one - diff_trans) * cos_o),
            pdf: shares.specular_reflection * facets_pdf + shares.diffuse_reflection * cosine_pdf,
        };
        if !self.transmits {
            return reflected.only(seen & reflection);
        }

        let diffuse = matte * diff_trans * cosine_pdf;
        let diffuse_pdf = shares.diffuse_transmission * cosine_pdf;
        let both = diffuse + specular * (one - fresnel);
        let both_pdf = diffuse_pdf + shares.specular_transmission * facets_pdf;
        // Mitsuba leaves out facets that would be seen from behind on the other side.
        let specular = cos_d.lt(zero);
        let passing = BsdfValues {
            value: point.base_color * F::select(specular, both, diffuse),
            pdf: F::select(specular, both_pdf, diffuse_pdf),
        };
        let passing = passing.only(zero.lt(passing.pdf));
        BsdfValues::select(reflection, reflected, passing).only(seen)
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
        let zero = F::zero();
        let up = F::one().copysign(wi.z);
        let upward = wi * up;
        let point = self.parameters.at(at, w);
        let shares = self.shares(point.spec_trans, self.diff_trans(at));
        let passed = shares.specular_reflection + shares.specular_transmission;
        let mirror = u1.lt(shares.specular_reflection);
        let specular = mirror | u1.lt(passed);
        let above = u1.lt(passed + shares.diffuse_reflection);
        let m = facets(&point, mirror, self.eta.numbers(at)).sample(upward, u2);
        let reflected = fresnel::reflect(upward, m);
        let through = Vec3::new(reflected.x, reflected.y, -reflected.z);
        let cosine = warp::cosine_hemisphere(u2);
        let diffuse = Vec3::select(above, cosine, -cosine);
        let faceted = Vec3::select(mirror, reflected, through);
        let wo = Vec3::select(specular, faceted, diffuse);
        // Light must come out on the side of the surface, and of its facet, that it should.
        let fits = !specular | (zero.lt(reflected.z) & (mirror | wo.dot(m).lt(zero)));
        let wo = wo * up;
        let samples = self.eval_lanes(at, wi, wo, w).as_samples(wo, F::one());
        BsdfSamples {
            drawn: samples.drawn & fits,
            ..samples
        }
    }
}
