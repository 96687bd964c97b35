//! `diffuse`: Lambert's law, f = reflectance / π on the front side; `reflectance` 0.5 by default.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};

use super::{Bsdf, BsdfSample, BsdfValue, Lobes, PhongTerms};
use crate::color::{Color, ColorModel, Role, Spectral};
use crate::description::Properties;
use crate::description::declared::{Plugin, texture};
use crate::error::Result;
use crate::interaction::Interaction;
use crate::math::warp;
use crate::texture::{Palettes, Texture};

/// An ideal matte surface.
#[derive(Clone, Debug)]
pub struct Diffuse<C: ColorModel> {
    reflectance: Texture<C>,
}

impl<C: ColorModel> Diffuse<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "matte",
        properties: &[&[texture(
            "reflectance",
            0.5,
            "the share of light that is reflected",
        )]],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        Ok(Self {
            reflectance: palettes
                .colors
                .texture(properties, "reflectance", Role::Reflectance)?,
        })
    }

    /// The same grey, in [0, 1], everywhere.
    pub(super) fn grey(palettes: &Palettes<C>, value: f64) -> Self {
        let palette = palettes.colors.with_role(Role::Reflectance);
        Self {
            reflectance: palette
                .uniform(&Color::Grey(value))
                .expect("a fraction is a reflectance"),
        }
    }
}

impl<C: ColorModel> Bsdf<C> for Diffuse<C> {
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
        (wi.z > 0.0 && wo.z > 0.0).then(|| BsdfValue {
            value: self.reflectance.eval(at, w) * (FRAC_1_PI * wo.z),
            pdf: warp::cosine_hemisphere_pdf(wo.z),
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
        let wo = warp::cosine_hemisphere(u2);
        let pdf = warp::cosine_hemisphere_pdf(wo.z);
        let weight = self.reflectance.eval(at, w);
        (wi.z > 0.0 && pdf > 0.0 && !weight.is_black()).then_some(BsdfSample {
            wo,
            weight,
            pdf,
            eta: 1.0,
            delta: false,
            null: false,
        })
    }

    fn phong(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        wo: Vec3,
        w: &C::Wavelengths,
    ) -> Option<PhongTerms<C::Sample>> {
        (wi.z > 0.0 && wo.z > 0.0).then(|| PhongTerms {
            diffuse: self.reflectance.eval(at, w) * wo.z,
            specular: C::Sample::zero(),
        })
    }
}
