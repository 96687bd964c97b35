//! `area`: a shape that emits `radiance` from its front, the same in all directions. Points are drawn as the
//! shape draws them, by solid angle where it can, and where a texture makes parts of it bright also by that.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::block::BlockEmitter;
use super::brightness::Brightness;
use super::{Emitter, LightContext, LightSample, LightSamples, interaction, mean_of};
use crate::color::{ColorModel, Role, Spectral};
use crate::description::Properties;
use crate::description::declared::{Plugin, texture};
use crate::error::Result;
use crate::interaction::Interaction;
use crate::lanes::{self, Lanes};
use crate::shape::Geometry;
use crate::texture::{Palettes, Texture};

/// A shape that gives light.
#[derive(Clone, Debug)]
pub struct Area<C: ColorModel> {
    radiance: Texture<C>,
    shape: Arc<Geometry>,
    /// Over the area, of the channels' mean.
    mean: f64,
    /// Where a texture is not even.
    brightness: Option<Brightness>,
}

impl<C: ColorModel> Area<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "light from the front of the shape that it stands in",
        properties: &[
            &[texture("radiance", 1.0, "in every direction; W/(m² sr)")],
            super::SAMPLING,
        ],
    };

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
        let radiance = colors.texture(properties, "radiance", Role::Emission)?;
        let (mean, brightness) = match &radiance {
            Texture::Uniform(value) => (mean_of(&colors.color, value.value()), None),
            _ => Brightness::survey(&radiance, shape, &colors.color),
        };
        Ok(Self {
            radiance,
            shape: shape.clone(),
            mean,
            brightness,
        })
    }
}

impl<C: ColorModel> Area<C> {
    /// Whether it is the same all over, so that it is written over lanes.
    pub(super) fn is_even(&self) -> bool {
        matches!(self.radiance, Texture::Uniform(_))
    }
}

impl<C: ColorModel> BlockEmitter<C> for Area<C> {
    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        from: lanes::Vec3<F>,
        u: lanes::Vec2<F>,
        w: &[C::Wavelengths],
        active: F::Mask,
    ) -> LightSamples<F, C::Columns<F>> {
        let Texture::Uniform(radiance) = &self.radiance else {
            return LightSamples::none();
        };
        let point = self.shape.sample_lanes(from, u, active);
        let direction = (point.position - from).normalize_or_zero();
        let lit = direction.dot(point.normal).lt(F::zero());
        LightSamples {
            direction,
            target: point.position,
            radiance: C::evaluate_lanes(radiance.value(), w),
            pdf: F::select(lit, point.pdf, F::zero()),
            ..LightSamples::none()
        }
    }
}

impl<C: ColorModel> Emitter<C> for Area<C> {
    fn sample(
        &self,
        from: Vec3,
        u: Vec2,
        wavelengths: &C::Wavelengths,
    ) -> Option<LightSample<C::Sample>> {
        let point = match &self.brightness {
            Some(brightness) => brightness.sample(&self.shape, from, u)?,
            None => self.shape.sample(from, u)?,
        };
        let direction = (point.position - from).normalize_or_zero();
        if direction.dot(point.normal) >= 0.0 {
            return None;
        }
        let radiance = match &self.radiance {
            Texture::Uniform(radiance) => C::evaluate(radiance.value(), wavelengths),
            texture => texture.eval(&interaction(&self.shape, &point), wavelengths),
        };
        Some(LightSample {
            direction,
            target: Some(point.position),
            radiance,
            pdf: point.pdf,
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
        match &self.brightness {
            Some(brightness) => brightness.pdf(&self.shape, from, at),
            None => self.shape.pdf(from, at),
        }
    }

    fn power(&self, _color: &C, _radius: f64) -> f64 {
        PI * self.shape.area() * self.mean
    }
}
