//! `phong`: the modified Phong model, f = k_d/π + k_s·(n + 2)/2π·max(0, R·V)ⁿ with R the mirror image of the
//! light's direction (Phong, *Illumination for computer generated pictures*, 1975; normalised as in
//! Lafortune and Willems, *Using the modified Phong reflectance model*, 1994). Parameters are Mitsuba 0.6's:
//! `diffuse_reflectance` (0.5), `specular_reflectance` (0.2), `exponent` (30).
//!
//! Where k_d + k_s passes 1 for some colour, f is scaled by 0.99 over the largest sum, as there; the
//! textbook's equation, which has no such law, takes the parameters as they are. `ambient_reflectance` (0) is
//! the share of an `ambient` emitter's light that is returned.

use std::f32::consts::{FRAC_1_PI, TAU};

use super::{
    BlockBsdf, Bsdf, BsdfSamples, BsdfValues, Lobes, PhongTerms, fresnel, mean, samples,
    single_face,
};
use crate::color::{ColorModel, Mono, Role, Spectral};
use crate::description::Properties;
use crate::description::declared::{Plugin, number, texture};
use crate::error::Result;
use crate::interaction::{Interaction, Points};
use crate::lanes::{Frame, Lanes, Vec2, Vec3, pow, sin_cos_turns, warp};
use crate::texture::{Palettes, Texture};

/// A matte base and a cosine-power highlight.
#[derive(Clone, Debug)]
pub struct Phong<C: ColorModel> {
    ambient_reflectance: Texture<C>,
    diffuse_reflectance: Texture<C>,
    specular_reflectance: Texture<C>,
    exponent: Texture<Mono>,
    /// What makes the BSDF conserve energy, in (0, 1].
    scale: f32,
    /// The probability of sampling the highlight.
    specular_weight: f32,
}

impl<C: ColorModel> Phong<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "Phong's, normalised under path and as textbooks have it under the integrator phong",
        properties: &[&[
            texture("diffuse_reflectance", 0.5, "k_d"),
            texture("specular_reflectance", 0.2, "k_s"),
            texture("ambient_reflectance", 0.0, "k_a, of the light ambient"),
            number("exponent", 30.0, "n; the larger, the smaller the highlight").at_least(0.0),
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let reflectance = |name| palettes.colors.texture(properties, name, Role::Reflectance);
        let diffuse_reflectance = reflectance("diffuse_reflectance")?;
        let specular_reflectance = reflectance("specular_reflectance")?;
        let exponent = palettes.numbers.number(properties, "exponent")?;
        if let Some(low) = samples(&Mono, &exponent).map(|n| n[0]).find(|n| *n < 0.0) {
            let message = format!("an exponent must be at least 0, and {low} is not");
            return Err(properties.error("exponent", message));
        }
        let color = &palettes.colors.color;
        let sums = samples(color, &diffuse_reflectance)
            .zip(samples(color, &specular_reflectance))
            .map(|(diffuse, specular)| ((diffuse + specular) * color.unit()).max_value());
        let largest = sums.fold(0.0, f32::max);
        let [diffuse, specular] =
            [&diffuse_reflectance, &specular_reflectance].map(|t| mean(palettes, t));
        Ok(Self {
            ambient_reflectance: reflectance("ambient_reflectance")?,
            diffuse_reflectance,
            specular_reflectance,
            exponent,
            scale: if largest > 1.0 { 0.99 / largest } else { 1.0 },
            specular_weight: if specular > 0.0 {
                specular / (diffuse + specular)
            } else {
                0.0
            },
        })
    }

    #[inline(always)]
    fn exponent<F: Lanes>(&self, at: &Points<'_, F>) -> F {
        self.exponent.numbers(at).max(F::zero())
    }
}

/// max(0, R·V)ⁿ, the same whichever of the two directions is the light's.
#[inline(always)]
fn lobe<F: Lanes>(wi: Vec3<F>, wo: Vec3<F>, exponent: F) -> F {
    let (zero, one) = (F::zero(), F::one());
    let cosine = fresnel::mirror(wi).dot(wo);
    F::select(zero.lt(cosine), pow(cosine.min(one), exponent), zero)
}

impl<C: ColorModel> Bsdf<C> for Phong<C> {
    fn lobes(&self) -> Lobes {
        Lobes::REFLECTION
    }

    single_face!();

    fn albedo(&self, at: &Interaction<'_>, w: &C::Wavelengths) -> C::Sample {
        self.diffuse_reflectance.eval(at, w) * self.scale
    }

    fn ambient(&self, at: &Interaction<'_>, wi: glam::Vec3, w: &C::Wavelengths) -> C::Sample {
        if wi.z > 0.0 {
            self.ambient_reflectance.eval(at, w)
        } else {
            C::Sample::zero()
        }
    }
}

impl<C: ColorModel> BlockBsdf<C> for Phong<C> {
    #[inline(always)]
    fn eval_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        wo: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        let (zero, one) = (F::zero(), F::one());
        let exponent = self.exponent(at);
        let lobe = lobe(wi, wo, exponent) / F::splat(TAU);
        let diffuse = self.diffuse_reflectance.eval_lanes(at, w) * F::splat(FRAC_1_PI);
        let highlight = (exponent + F::splat(2.0)) * lobe;
        let specular = self.specular_reflectance.eval_lanes(at, w) * highlight;
        let base = F::splat(1.0 - self.specular_weight) * warp::cosine_hemisphere_pdf(wo.z);
        let values = BsdfValues {
            value: (diffuse + specular) * (F::splat(self.scale) * wo.z),
            pdf: base + F::splat(self.specular_weight) * (exponent + one) * lobe,
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
        let one = F::one();
        let cosine = pow(one - u2.x, one / (self.exponent(at) + one));
        let sine = (one - cosine * cosine).max(F::zero()).sqrt();
        let (y, x) = sin_cos_turns(u2.y);
        let around = Frame::around(fresnel::mirror(wi));
        let highlight = around.to_world(Vec3::new(x * sine, y * sine, cosine));
        let base = warp::cosine_hemisphere(u2);
        let wo = Vec3::select(u1.lt(F::splat(self.specular_weight)), highlight, base);
        self.eval_lanes(at, wi, wo, w).as_samples(wo, one)
    }

    #[inline(always)]
    fn phong_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        wo: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> Option<PhongTerms<C::Columns<F>>> {
        let lobe = lobe(wi, wo, self.exponent(at));
        let terms = PhongTerms {
            diffuse: self.diffuse_reflectance.eval_lanes(at, w) * wo.z,
            specular: self.specular_reflectance.eval_lanes(at, w) * lobe,
        };
        Some(terms.only(F::zero().lt(wi.z) & F::zero().lt(wo.z)))
    }
}
