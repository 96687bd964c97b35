//! `constant`: the same `radiance` from everywhere around.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};

use super::{Emitter, LightContext, LightSample, mean_of};
use crate::color::{ColorModel, Role};
use crate::description::Properties;
use crate::description::declared::{Plugin, color};
use crate::error::Result;
use crate::math::warp;

/// A uniform environment.
#[derive(Clone, Debug)]
pub struct Constant<C: ColorModel> {
    radiance: C::Stored,
}

const PDF: f32 = 0.25 * FRAC_1_PI;

impl<C: ColorModel> Constant<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "the same light from everywhere around",
        properties: &[
            &[
                color("radiance", 1.0, "from every direction; W/(m² sr)"),
                super::TO_WORLD.without_effect(),
            ],
            super::SAMPLING,
        ],
    };

    pub(super) fn build(
        properties: &Properties<'_>,
        context: &LightContext<'_, C>,
    ) -> Result<Self> {
        let radiance = context
            .palettes
            .colors
            .color(properties, "radiance", Role::Emission)?;
        Ok(Self { radiance })
    }
}

impl<C: ColorModel> Emitter<C> for Constant<C> {
    fn sample(
        &self,
        _from: Vec3,
        u: Vec2,
        wavelengths: &C::Wavelengths,
    ) -> Option<LightSample<C::Sample>> {
        let direction = warp::uniform_sphere(u);
        let radiance = C::evaluate(&self.radiance, wavelengths);
        Some(LightSample {
            direction,
            target: None,
            radiance,
            pdf: PDF,
            delta: false,
        })
    }

    fn is_environment(&self) -> bool {
        true
    }

    fn environment_radiance(&self, _direction: Vec3, wavelengths: &C::Wavelengths) -> C::Sample {
        C::evaluate(&self.radiance, wavelengths)
    }

    fn environment_pdf(&self, _direction: Vec3) -> f32 {
        PDF
    }

    fn power(&self, color: &C, radius: f64) -> f64 {
        4.0 * std::f64::consts::PI.powi(2) * radius * radius * mean_of(color, &self.radiance)
    }
}
