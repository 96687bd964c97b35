//! `constant`: the same `radiance` from everywhere around.

use std::f32::consts::FRAC_1_PI;

use super::block::{self, BlockEmitter};
use super::{Emitter, LightContext, LightSample, LightSamples, mean_of};
use crate::color::{ColorModel, PerLane as _, Role};
use crate::description::Properties;
use crate::description::declared::{Plugin, color};
use crate::error::Result;
use crate::interaction::Reference;
use crate::lanes::{Lanes, Mask as _, Vec2, Vec3, warp};

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

impl<C: ColorModel> BlockEmitter<C> for Constant<C> {
    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        _from: Vec3<F>,
        u: Vec2<F>,
        w: &[C::Wavelengths],
        active: F::Mask,
        radiance: &mut C::PerLane<F>,
    ) -> LightSamples<F> {
        radiance.put(active, &self.radiance, F::one(), w);
        LightSamples {
            direction: warp::uniform_sphere(u),
            distant: F::Mask::splat(true),
            pdf: F::splat(PDF),
            ..LightSamples::none()
        }
    }
}

impl<C: ColorModel> Emitter<C> for Constant<C> {
    fn sample(
        &self,
        from: Reference,
        u: glam::Vec2,
        wavelengths: &C::Wavelengths,
    ) -> Option<LightSample<C::Sample>> {
        block::single_sample(self, from.position, u, wavelengths)
    }

    fn is_environment(&self) -> bool {
        true
    }

    fn environment_radiance(
        &self,
        _direction: glam::Vec3,
        _time: f32,
        wavelengths: &C::Wavelengths,
    ) -> C::Sample {
        C::evaluate(&self.radiance, wavelengths)
    }

    fn environment_pdf(&self, _direction: glam::Vec3, _time: f32) -> f32 {
        PDF
    }

    fn power(&self, color: &C, radius: f64) -> f64 {
        4.0 * std::f64::consts::PI.powi(2) * radius * radius * mean_of(color, &self.radiance)
    }
}
