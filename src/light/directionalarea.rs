//! `directionalarea`: a shape whose every point emits along its normal alone. No direction that is drawn from elsewhere
//! is that one, so that integrators which start at the camera find none of its light, here as in Mitsuba; `ptracer` and `bdpt`
//! follow it from the light. The shape is black, as one that gives light is.

use std::sync::Arc;

use glam::Vec2;

use super::emission::place_on;
use super::{
    Ball, Draw, Emission, Emitter, LightContext, LightSample, Seen, Source, mean_over_square,
};
use crate::color::{ColorModel, Role};
use crate::description::Properties;
use crate::description::declared::{Plugin, texture};
use crate::error::Result;
use crate::interaction::Reference;
use crate::shape::Geometry;
use crate::texture::{Palettes, Texture};

/// A shape that emits along its normals.
#[derive(Clone, Debug)]
pub struct DirectionalArea<C: ColorModel> {
    radiance: Texture<C>,
    shape: Arc<Geometry>,
    /// Whether the shape moves; then there is no light.
    moves: bool,
}

impl<C: ColorModel> DirectionalArea<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "light from the shape that it stands in, along the normals alone",
        properties: &[
            &[texture(
                "radiance",
                1.0,
                "what leaves along the normal; W/m²",
            )],
            super::SAMPLING,
        ],
    };

    pub(super) fn build(
        properties: &Properties<'_>,
        context: &LightContext<'_, C>,
    ) -> Result<Self> {
        let Some(shape) = context.shape else {
            let message = "a directionalarea emitter gives light from a shape, and stands in none";
            return Err(properties.error("", message).help("nest it in a <shape>"));
        };
        let Palettes { colors, .. } = context.palettes;
        let moves = context.motion.is_some();
        let (message, help) = match moves {
            false => (
                "paths from the camera find no light of a directionalarea",
                "ptracer and bdpt follow it from the light; an area emitter shines in all directions",
            ),
            true => (
                "a directionalarea that moves gives no light",
                "let it stand, and move what it lights",
            ),
        };
        colors.warn(properties.error("", message).help(help));
        Ok(Self {
            moves,
            radiance: colors.texture(properties, "radiance", Role::Emission)?,
            shape: shape.clone(),
        })
    }
}

impl<C: ColorModel> Emitter<C> for DirectionalArea<C> {
    fn sample(
        &self,
        _from: Reference,
        _u: Vec2,
        _wavelengths: &C::Wavelengths,
    ) -> Option<LightSample<C::Sample>> {
        None
    }

    fn emit(
        &self,
        _ball: &Ball,
        draw: &Draw,
        wavelengths: &C::Wavelengths,
    ) -> Option<Emission<'_, C::Sample>> {
        if self.moves {
            return None;
        }
        let place = place_on(&self.shape, draw.place)?;
        let direction = place.front;
        let (at, origin) = place.toward(direction);
        let density = self.shape.area().recip() as f32;
        Some(Emission {
            origin,
            direction,
            flux: self.radiance.eval(&at, wavelengths) * density.recip(),
            density,
            source: Source::Beam(Box::new(at)),
        })
    }

    fn emission_density(&self, _ball: &Ball, _seen: &Seen) -> f32 {
        0.0
    }

    fn emitted_power(&self, color: &C, _radius: f64) -> f64 {
        match self.moves {
            true => 0.0,
            false => self.shape.area() * mean_over_square(color, &self.radiance),
        }
    }
}
