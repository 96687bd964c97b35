//! `directional`: parallel light along `direction` (or the z axis of `to_world`, +z by default) that
//! brings `irradiance` to a surface at right angles.

use std::f64::consts::PI;

use glam::{DVec3, Vec2, Vec3};

use super::block::BlockEmitter;
use super::{Emitter, LightContext, LightSample, LightSamples, mean_of, to_world};
use crate::color::{ColorModel, PerLane as _, Role};
use crate::description::Properties;
use crate::description::declared::{Plugin, color, vector};
use crate::error::Result;
use crate::interaction::Reference;
use crate::lanes::{self, Lanes, Mask as _};
use crate::math::Moving;

/// Where light goes, unit length.
#[derive(Clone, Debug)]
enum Direction {
    /// At all times there.
    Still(Vec3),
    /// Along the z axis.
    Moving(Moving),
}

impl Direction {
    #[inline]
    fn at(&self, time: f32) -> Vec3 {
        match self {
            Self::Still(direction) => *direction,
            Self::Moving(moving) => moving.at(time).vector(Vec3::Z).normalize(),
        }
    }
}

/// How far a scale may be from 1 without a word.
const UNIT_LENGTH: f64 = 1e-3;

/// Light from a single direction.
#[derive(Clone, Debug)]
pub struct Directional<C: ColorModel> {
    irradiance: C::Stored,
    direction: Direction,
}

impl<C: ColorModel> Directional<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "parallel light",
        properties: &[
            &[
                color("irradiance", 1.0, "of a surface at right angles; W/m²"),
                vector("direction", [0.0, 0.0, 1.0], "where the light goes")
                    .absent("+z of to_world"),
                super::TO_WORLD,
            ],
            super::SAMPLING,
        ],
    };

    pub(super) fn build(
        properties: &Properties<'_>,
        context: &LightContext<'_, C>,
    ) -> Result<Self> {
        let direction = match properties.given::<DVec3>("direction")? {
            Some(_) if properties.has("to_world") => {
                return Err(
                    properties.error("direction", "direction and to_world exclude each other")
                );
            }
            Some(direction) => {
                let direction = direction.normalize_or_zero();
                if direction == DVec3::ZERO {
                    return Err(properties.error("direction", "a direction cannot have length 0"));
                }
                Direction::Still(direction.as_vec3())
            }
            None => {
                let moving = to_world(properties)?;
                let axis = |time| moving.at(time).vector(Vec3::Z).as_dvec3();
                let lengths = moving.times().into_iter().map(|time| axis(time).length());
                if let Some(length) = lengths.into_iter().find(|l| (l - 1.0).abs() > UNIT_LENGTH) {
                    let message = format!(
                        "to_world scales the direction by {length:.4}, and the irradiance stays: Mitsuba multiplies it, and renders another image"
                    );
                    let warning = properties.error("to_world", message);
                    let help = "leave out the scale, and give the irradiance that is meant";
                    context.palettes.colors.warn(warning.help(help));
                }
                match moving.is_still() {
                    true => Direction::Still(axis(0.0).normalize_or_zero().as_vec3()),
                    false => Direction::Moving(moving),
                }
            }
        };
        let irradiance = context
            .palettes
            .colors
            .color(properties, "irradiance", Role::Emission)?;
        Ok(Self {
            irradiance,
            direction,
        })
    }
}

impl<C: ColorModel> Directional<C> {
    /// Whether it is.
    pub(super) fn is_still(&self) -> bool {
        matches!(self.direction, Direction::Still(_))
    }
}

impl<C: ColorModel> BlockEmitter<C> for Directional<C> {
    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        _from: lanes::Vec3<F>,
        _u: lanes::Vec2<F>,
        w: &[C::Wavelengths],
        active: F::Mask,
        radiance: &mut C::PerLane<F>,
    ) -> LightSamples<F> {
        let Direction::Still(direction) = self.direction else {
            return LightSamples::none();
        };
        radiance.put(active, &self.irradiance, F::one(), w);
        LightSamples {
            direction: lanes::Vec3::all(-direction),
            distant: F::Mask::splat(true),
            pdf: F::one(),
            delta: F::Mask::splat(true),
            ..LightSamples::none()
        }
    }
}

impl<C: ColorModel> Emitter<C> for Directional<C> {
    fn sample(
        &self,
        from: Reference,
        _u: Vec2,
        wavelengths: &C::Wavelengths,
    ) -> Option<LightSample<C::Sample>> {
        let radiance = C::evaluate(&self.irradiance, wavelengths);
        Some(LightSample {
            direction: -self.direction.at(from.time),
            target: None,
            radiance,
            pdf: 1.0,
            delta: true,
        })
    }

    fn power(&self, color: &C, radius: f64) -> f64 {
        PI * radius * radius * mean_of(color, &self.irradiance)
    }
}
