//! `point`: light from the point `position` (or the origin of `to_world`), `intensity` in each direction.

use std::f64::consts::PI;

use glam::{DVec3, Vec2};

use super::block::BlockEmitter;
use super::emission::from_point;
use super::{
    Ball, Draw, Emission, Emitter, LightContext, LightSample, LightSamples, Origin, Seen, mean_of,
};
use crate::color::{ColorModel, PerLane as _, Role};
use crate::description::Properties;
use crate::description::declared::{Plugin, color, vector};
use crate::error::Result;
use crate::interaction::Reference;
use crate::lanes::{self, Lanes, Mask as _, warp};

/// A point that gives light.
#[derive(Clone, Debug)]
pub struct Point<C: ColorModel> {
    intensity: C::Stored,
    position: Origin,
}

/// Of a direction.
const PDF: f32 = 0.25 * std::f32::consts::FRAC_1_PI;

impl<C: ColorModel> Point<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "light from a point",
        properties: &[
            &[
                color("intensity", 1.0, "in every direction; W/sr"),
                vector("position", [0.0; 3], "where the light is").absent("origin of to_world"),
                super::TO_WORLD,
            ],
            super::SAMPLING,
        ],
    };

    pub(super) fn build(
        properties: &Properties<'_>,
        context: &LightContext<'_, C>,
    ) -> Result<Self> {
        let position = match properties.given::<DVec3>("position")? {
            Some(_) if properties.has("to_world") => {
                return Err(
                    properties.error("position", "position and to_world exclude each other")
                );
            }
            Some(position) => Origin::Still(position.as_vec3()),
            None => Origin::of(properties)?,
        };
        let intensity = context
            .palettes
            .colors
            .color(properties, "intensity", Role::Emission)?;
        Ok(Self {
            intensity,
            position,
        })
    }
}

impl<C: ColorModel> Point<C> {
    /// Whether it is.
    pub(super) fn is_still(&self) -> bool {
        matches!(self.position, Origin::Still(_))
    }
}

impl<C: ColorModel> BlockEmitter<C> for Point<C> {
    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        from: lanes::Vec3<F>,
        _u: lanes::Vec2<F>,
        w: &[C::Wavelengths],
        active: F::Mask,
        radiance: &mut C::PerLane<F>,
    ) -> LightSamples<F> {
        let Origin::Still(position) = self.position else {
            return LightSamples::none();
        };
        let target = lanes::Vec3::all(position);
        let way = target - from;
        let squared = way.length_squared();
        radiance.put(active, &self.intensity, F::one() / squared, w);
        LightSamples {
            direction: way / squared.sqrt(),
            target,
            pdf: F::select(F::zero().lt(squared), F::one(), F::zero()),
            delta: F::Mask::splat(true),
            ..LightSamples::none()
        }
    }
}

impl<C: ColorModel> Emitter<C> for Point<C> {
    fn sample(
        &self,
        from: Reference,
        _u: Vec2,
        wavelengths: &C::Wavelengths,
    ) -> Option<LightSample<C::Sample>> {
        let position = self.position.at(from.time);
        let way = position - from.position;
        let squared = way.length_squared();
        (squared > 0.0).then(|| LightSample {
            direction: way / squared.sqrt(),
            target: Some(position),
            radiance: C::evaluate(&self.intensity, wavelengths) / squared,
            pdf: 1.0,
            delta: true,
        })
    }

    fn emit(
        &self,
        _ball: &Ball,
        draw: &Draw,
        wavelengths: &C::Wavelengths,
    ) -> Option<Emission<'_, C::Sample>> {
        let position = self.position.at(draw.time);
        let direction = warp::uniform_sphere::<f32>(draw.direction.into()).into();
        from_point(self, position, direction, PDF, draw.time, wavelengths)
    }

    fn emission_density(&self, _ball: &Ball, seen: &Seen) -> f32 {
        PDF / (seen.distance * seen.distance)
    }

    fn power(&self, color: &C, _radius: f64) -> f64 {
        4.0 * PI * mean_of(color, &self.intensity)
    }
}
