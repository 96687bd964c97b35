//! `point`: light from the point `position` (or the origin of `to_world`), `intensity` in each direction.

use std::f64::consts::PI;

use glam::{DVec3, Vec2, Vec3};

use super::{Emitter, LightContext, LightSample, mean_of, origin};
use crate::color::{ColorModel, Role};
use crate::description::Properties;
use crate::description::declared::{Plugin, color, vector};
use crate::error::Result;

/// A point that gives light.
#[derive(Clone, Debug)]
pub struct Point<C: ColorModel> {
    intensity: C::Stored,
    position: Vec3,
}

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
            Some(position) => position.as_vec3(),
            None => origin(properties)?,
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

impl<C: ColorModel> Emitter<C> for Point<C> {
    fn sample(
        &self,
        from: Vec3,
        _u: Vec2,
        wavelengths: &C::Wavelengths,
    ) -> Option<LightSample<C::Sample>> {
        let way = self.position - from;
        let squared = way.length_squared();
        (squared > 0.0).then(|| LightSample {
            direction: way / squared.sqrt(),
            target: Some(self.position),
            radiance: C::evaluate(&self.intensity, wavelengths) / squared,
            pdf: 1.0,
            delta: true,
        })
    }

    fn power(&self, color: &C, _radius: f64) -> f64 {
        4.0 * PI * mean_of(color, &self.intensity)
    }
}
