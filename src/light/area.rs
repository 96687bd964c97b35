//! `area`: a shape that emits `radiance` from its front, the same in all directions.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::{Emitter, LightContext, LightSample, texture_point};
use crate::color::{Color, ColorModel, Role, Spectral};
use crate::description::Properties;
use crate::error::Result;
use crate::interaction::Interaction;
use crate::shape::{Geometry, SurfaceSample};
use crate::texture::{Palettes, Texture};

/// A shape that gives light.
#[derive(Clone, Debug)]
pub struct Area<C: ColorModel> {
    radiance: Texture<C>,
    shape: Arc<Geometry>,
}

impl<C: ColorModel> Area<C> {
    pub(super) fn build(
        properties: &Properties<'_>,
        context: &LightContext<'_, C>,
    ) -> Result<Self> {
        let Some(shape) = context.shape else {
            return Err(properties
                .error(
                    "",
                    "an area emitter gives light from a shape, and stands in none",
                )
                .help("nest it in a <shape>"));
        };
        let Palettes { colors, .. } = context.palettes;
        let radiance = colors.texture(properties, "radiance", Role::Emission, Color::D65(1.0))?;
        Ok(Self {
            radiance,
            shape: shape.clone(),
        })
    }
}

impl<C: ColorModel> Emitter<C> for Area<C> {
    fn sample(
        &self,
        from: Vec3,
        u: Vec2,
        wavelengths: &C::Wavelengths,
    ) -> Option<LightSample<C::Sample>> {
        let SurfaceSample {
            position,
            normal,
            uv,
            pdf,
        } = self.shape.sample(from, u)?;
        let direction = (position - from).normalize();
        if direction.dot(normal) >= 0.0 {
            return None;
        }
        let radiance = self
            .radiance
            .eval(&texture_point(position, normal, uv), wavelengths);
        Some(LightSample {
            direction,
            target: Some(position),
            radiance,
            pdf,
            delta: false,
        })
    }

    fn surface_radiance(&self, at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> C::Sample {
        if at.wi.z > 0.0 {
            self.radiance.eval(at, wavelengths)
        } else {
            C::Sample::zero()
        }
    }

    fn surface_pdf(&self, from: Vec3, at: &Interaction<'_>) -> f32 {
        self.shape.pdf(from, at)
    }
}
