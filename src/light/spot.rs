//! `spot`: light from the origin of `to_world` along its z axis, `intensity` on the axis, the same within
//! `beam_width` (¾ of the cutoff by default) and from there falling with the angle to nothing at
//! `cutoff_angle` (20), both in degrees from the axis. `texture` is a slide that just fills the cutoff.

use std::f64::consts::PI;

use glam::{Vec2, Vec3};

use super::emission::from_point;
use super::{
    Ball, Draw, Emission, Emitter, LightContext, LightSample, Seen, mean_of, mean_over_square,
    texture_point, to_world,
};
use crate::color::{ColorModel, Role};
use crate::description::declared::{Plugin, color, float, map};
use crate::description::{Kind, Properties};
use crate::error::Result;
use crate::interaction::Reference;
use crate::lanes;
use crate::math::Moving;
use crate::texture::Texture;

/// A point that gives light into a cone.
#[derive(Clone, Debug)]
pub struct Spot<C: ColorModel> {
    intensity: C::Stored,
    slide: Option<Texture<C>>,
    to_world: Moving,
    /// In radians.
    cutoff: f32,
    /// In radians.
    beam: f32,
}

impl<C: ColorModel> Spot<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "light from a point into a cone",
        properties: &[
            &[
                color("intensity", 1.0, "along the axis; W/sr"),
                float(
                    "cutoff_angle",
                    20.0,
                    "from the axis to the dark, in degrees; with a texture at most 89",
                )
                .above_to(180.0),
                float(
                    "beam_width",
                    15.0,
                    "half the angle of full intensity, in degrees",
                )
                .absent("¾ of cutoff_angle")
                .at_least(0.0),
                map("texture", "what the intensity is multiplied by").absent("none"),
                super::TO_WORLD,
            ],
            super::SAMPLING,
        ],
    };

    pub(super) fn build(
        properties: &Properties<'_>,
        context: &LightContext<'_, C>,
    ) -> Result<Self> {
        let cutoff = properties.float("cutoff_angle")?;
        if properties.has("texture") && cutoff > 89.0 {
            let message =
                format!("with a texture the cutoff angle is at most 89°, and not {cutoff}°");
            return Err(properties.error("cutoff_angle", message));
        }
        let colors = &context.palettes.colors;
        let beam = properties.given("beam_width")?.unwrap_or(0.75 * cutoff);
        if beam > cutoff {
            let message = format!(
                "the beam width of {beam}° is above the cutoff angle of {cutoff}°, where the light ends"
            );
            colors.warn(properties.error("beam_width", message));
        }
        let slide = match properties.object("texture")? {
            Some(child) if child.kind() == Kind::Texture => Some(Texture::build(
                &child,
                &colors.with_role(Role::Reflectance),
            )?),
            Some(_) => return Err(properties.error("texture", "a texture is wanted here")),
            None => None,
        };
        Ok(Self {
            intensity: colors.color(properties, "intensity", Role::Emission)?,
            slide,
            to_world: to_world(properties)?,
            cutoff: cutoff.to_radians() as f32,
            beam: beam.min(cutoff).to_radians() as f32,
        })
    }

    /// The cosine of the cutoff, from 1.
    fn cap(&self) -> f32 {
        let half = (0.5 * self.cutoff).sin();
        2.0 * half * half
    }

    /// The density of directions that are drawn evenly within the cutoff.
    fn pdf(&self) -> f32 {
        1.0 / (std::f32::consts::TAU * self.cap())
    }

    /// How much of the intensity leaves at that angle from the axis.
    fn falloff(&self, angle: f32) -> f32 {
        if angle <= self.beam {
            1.0
        } else {
            ((self.cutoff - angle) / (self.cutoff - self.beam)).max(0.0)
        }
    }
}

impl<C: ColorModel> Emitter<C> for Spot<C> {
    fn sample(
        &self,
        from: Reference,
        _u: Vec2,
        wavelengths: &C::Wavelengths,
    ) -> Option<LightSample<C::Sample>> {
        let to_world = self.to_world.at(from.time);
        let position = to_world.translation();
        let way = position - from.position;
        let squared = way.length_squared();
        let local = to_world.inverse().vector(-way);
        // Not the arc cosine, which has no precision near the axis.
        let falloff = self.falloff(local.truncate().length().atan2(local.z));
        if squared <= 0.0 || falloff <= 0.0 {
            return None;
        }
        let mut radiance = C::evaluate(&self.intensity, wavelengths) * (falloff / squared);
        if let Some(slide) = &self.slide {
            let uv = 0.5 + 0.5 * local.truncate() / (local.z * self.cutoff.tan());
            radiance *= slide.eval(&texture_point(position, Vec3::Z, uv), wavelengths);
        }
        Some(LightSample {
            direction: way / squared.sqrt(),
            target: Some(position),
            radiance,
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
        let to_world = self.to_world.at(draw.time);
        let (sin, cos) = lanes::sin_cos_turns(draw.direction.x);
        let drop = draw.direction.y * self.cap();
        let aside = (drop * (2.0 - drop)).sqrt();
        let local = Vec3::new(aside * cos, aside * sin, 1.0 - drop);
        let direction = to_world.vector(local).normalize();
        let position = to_world.translation();
        from_point(
            self,
            position,
            direction,
            self.pdf(),
            draw.time,
            wavelengths,
        )
    }

    fn emission_density(&self, _ball: &Ball, seen: &Seen) -> f32 {
        self.pdf() / (seen.distance * seen.distance)
    }

    fn power(&self, color: &C, _radius: f64) -> f64 {
        // Half of what is between the beam and the cutoff.
        let cap = |angle: f32| 1.0 - f64::from(angle).cos();
        let solid_angle = PI * (cap(self.beam) + cap(self.cutoff));
        let slide = self
            .slide
            .as_ref()
            .map_or(1.0, |slide| mean_over_square(color, slide));
        solid_angle * slide * mean_of(color, &self.intensity)
    }
}
