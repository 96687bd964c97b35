//! `phong`: the modified Phong model, f = k_d/π + k_s·(n + 2)/2π·max(0, R·V)ⁿ with R the mirror image of the
//! light's direction (Phong, *Illumination for computer generated pictures*, 1975; normalised as in
//! Lafortune and Willems, *Using the modified Phong reflectance model*, 1994). Parameters are Mitsuba 0.6's:
//! `diffuse_reflectance` (0.5), `specular_reflectance` (0.2), `exponent` (30).
//!
//! Where k_d + k_s passes 1 for some colour, f is scaled by 0.99 over the largest sum, as there; the
//! textbook's equation, which has no such law, takes the parameters as they are. `ambient_reflectance` (0) is
//! the share of an `ambient` emitter's light that is returned.

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::{Vec2, Vec3};

use super::{Bsdf, BsdfSample, BsdfValue, Lobes, PhongTerms, fresnel, mean, samples};
use crate::color::{ColorModel, Mono, Role, Spectral};
use crate::description::Properties;
use crate::description::declared::{Plugin, number, texture};
use crate::error::Result;
use crate::interaction::Interaction;
use crate::lanes::warp;
use crate::math::Frame;
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

    fn exponent(&self, at: &Interaction<'_>) -> f32 {
        self.exponent.eval(at, &())[0].max(0.0)
    }
}

/// max(0, R·V)ⁿ, the same whichever of the two directions is the light's.
fn lobe(wi: Vec3, wo: Vec3, exponent: f32) -> f32 {
    let cosine = Vec3::from(fresnel::mirror::<f32>(wi.into())).dot(wo);
    if cosine > 0.0 {
        cosine.min(1.0).powf(exponent)
    } else {
        0.0
    }
}

impl<C: ColorModel> Bsdf<C> for Phong<C> {
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
        let exponent = self.exponent(at);
        let lobe = lobe(wi, wo, exponent) / TAU;
        let diffuse = self.diffuse_reflectance.eval(at, w) * FRAC_1_PI;
        let specular = self.specular_reflectance.eval(at, w) * ((exponent + 2.0) * lobe);
        let base = (1.0 - self.specular_weight) * warp::cosine_hemisphere_pdf(wo.z);
        Some(BsdfValue {
            value: (diffuse + specular) * (self.scale * wo.z),
            pdf: base + self.specular_weight * (exponent + 1.0) * lobe,
        })
    }

    fn sample(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        u1: f32,
        u2: Vec2,
        w: &C::Wavelengths,
    ) -> Option<BsdfSample<C::Sample>> {
        let wo = if u1 < self.specular_weight {
            let cosine = (1.0 - u2.x).powf(1.0 / (self.exponent(at) + 1.0));
            let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
            let (y, x) = (TAU * u2.y).sin_cos();
            let around = Frame::around(fresnel::mirror::<f32>(wi.into()).into());
            around.to_world(Vec3::new(x * sine, y * sine, cosine))
        } else {
            Vec3::from(warp::cosine_hemisphere(u2.into()))
        };
        self.eval(at, wi, wo, w)?.as_sample(wo, 1.0)
    }

    fn albedo(&self, at: &Interaction<'_>, w: &C::Wavelengths) -> C::Sample {
        self.diffuse_reflectance.eval(at, w) * self.scale
    }

    fn phong(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        wo: Vec3,
        w: &C::Wavelengths,
    ) -> Option<PhongTerms<C::Sample>> {
        (wi.z > 0.0 && wo.z > 0.0).then(|| PhongTerms {
            diffuse: self.diffuse_reflectance.eval(at, w) * wo.z,
            specular: self.specular_reflectance.eval(at, w) * lobe(wi, wo, self.exponent(at)),
        })
    }

    fn ambient(&self, at: &Interaction<'_>, wi: Vec3, w: &C::Wavelengths) -> C::Sample {
        if wi.z > 0.0 {
            self.ambient_reflectance.eval(at, w)
        } else {
            C::Sample::zero()
        }
    }
}
