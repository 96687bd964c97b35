//! `area`: a shape that emits `radiance` from its front, the same in all directions. Points are drawn as the
//! shape draws them, by solid angle where it can, and where a texture makes parts of it bright also by that. On a shape
//! that moves they are drawn in the shape's own space, from where the other point is there at its time: an affine map A
//! turns a density per solid angle p(ω) into p(ω)·|Aω|³/|det A|.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::block::BlockEmitter;
use super::brightness::Brightness;
use super::emission::place_on;
use super::{
    Ball, Draw, Emission, Emitter, LightContext, LightSample, LightSamples, Seen, Source,
    interaction, mean_of,
};
use crate::color::{ColorModel, PerLane as _, Role, Spectral};
use crate::description::Properties;
use crate::description::declared::{Plugin, texture};
use crate::error::Result;
use crate::interaction::{Interaction, Reference};
use crate::lanes::{self, Lanes};
use crate::math::{Moving, Transform};
use crate::shape::{Geometry, SurfaceSample};
use crate::texture::{Palettes, Texture};

/// A shape that gives light.
#[derive(Clone, Debug)]
pub struct Area<C: ColorModel> {
    radiance: Texture<C>,
    shape: Arc<Geometry>,
    /// From the shape's space to the world, where it moves.
    motion: Option<Moving>,
    /// Over the area, of the channels' mean.
    mean: f64,
    /// Where a texture is not even.
    brightness: Option<Brightness>,
    /// The density of paths that set out: even over the area and by the cosine. 0 where its points cannot be drawn so.
    density: f32,
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
            motion: context.motion.cloned(),
            mean,
            brightness,
            density: match context.motion.is_none() && shape.evenly(Vec2::splat(0.5)).is_some() {
                true => (1.0 / (PI * shape.area())) as f32,
                false => 0.0,
            },
        })
    }
}

impl<C: ColorModel> Area<C> {
    /// Whether it is: it is the same all over, and stands still.
    pub(super) fn is_written_over_lanes(&self) -> bool {
        matches!(self.radiance, Texture::Uniform(_)) && self.motion.is_none()
    }

    /// A point of the shape, in its own space.
    fn draw(&self, from: Vec3, u: Vec2) -> Option<SurfaceSample> {
        match &self.brightness {
            Some(brightness) => brightness.sample(&self.shape, from, u),
            None => self.shape.sample(from, u),
        }
    }

    /// The density with which [`Self::draw`] draws a point, in its own space.
    fn density(&self, from: Vec3, at: &Interaction<'_>) -> f32 {
        match &self.brightness {
            Some(brightness) => brightness.pdf(&self.shape, from, at),
            None => self.shape.pdf(from, at),
        }
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
        radiance: &mut C::PerLane<F>,
    ) -> LightSamples<F> {
        let Texture::Uniform(color) = &self.radiance else {
            return LightSamples::none();
        };
        radiance.put(active, color.value(), F::one(), w);
        let point = self.shape.sample_lanes(from, u, active);
        let direction = (point.position - from).normalize_or_zero();
        let lit = direction.dot(point.normal).lt(F::zero());
        LightSamples {
            direction,
            target: point.position,
            pdf: F::select(lit, point.pdf, F::zero()),
            ..LightSamples::none()
        }
    }
}

impl<C: ColorModel> Emitter<C> for Area<C> {
    fn sample(
        &self,
        from: Reference,
        u: Vec2,
        wavelengths: &C::Wavelengths,
    ) -> Option<LightSample<C::Sample>> {
        let to_world = self.motion.as_ref().map(|motion| motion.at(from.time));
        let own = match &to_world {
            Some(to_world) => to_world.inverse().point(from.position),
            None => from.position,
        };
        let point = self.draw(own, u)?;
        let target = match &to_world {
            Some(to_world) => to_world.point(point.position),
            None => point.position,
        };
        let direction = (target - from.position).normalize_or_zero();
        // Which side emits is the same in the shape's own space as in the world.
        let (toward, pdf) = match &to_world {
            Some(to_world) => {
                let way = point.position - own;
                (way, point.pdf * solid_angle_ratio(to_world, way))
            }
            None => (direction, point.pdf),
        };
        if toward.dot(point.normal) >= 0.0 {
            return None;
        }
        let radiance = match &self.radiance {
            Texture::Uniform(radiance) => C::evaluate(radiance.value(), wavelengths),
            texture => {
                let at = Interaction {
                    position: target,
                    ..interaction(&self.shape, &point)
                };
                texture.eval(&at, wavelengths)
            }
        };
        Some(LightSample {
            direction,
            target: Some(target),
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
        let Some(motion) = &self.motion else {
            return self.density(from, at);
        };
        let to_world = motion.at(at.time);
        let to_own = to_world.inverse();
        let own = at
            .clone()
            .transformed(&to_own, to_own.vector(-at.frame.to_world(at.wi)));
        let from = to_own.point(from);
        self.density(from, &own) * solid_angle_ratio(&to_world, own.position - from)
    }

    fn emit(
        &self,
        _ball: &Ball,
        draw: &Draw,
        wavelengths: &C::Wavelengths,
    ) -> Option<Emission<'_, C::Sample>> {
        if self.density <= 0.0 {
            return None;
        }
        let place = place_on(&self.shape, draw.place)?;
        let direction = place.direction(draw.direction);
        let (at, origin) = place.toward(direction);
        Some(Emission {
            origin,
            direction,
            flux: self.surface_radiance(&at, wavelengths) * self.density.recip(),
            density: self.density,
            source: Source::Surface(Box::new(at)),
        })
    }

    fn sends_paths(&self) -> bool {
        self.density > 0.0
    }

    fn emission_density(&self, _ball: &Ball, _seen: &Seen) -> f32 {
        self.density
    }

    fn power(&self, _color: &C, _radius: f64) -> f64 {
        // Of what moves the area as it is at the first keyframe, if it grows evenly.
        let scale = self.motion.as_ref().map_or(1.0, |motion| {
            let linear = motion.at(motion.times()[0]).linear();
            f64::from(linear.determinant().abs()).powf(2.0 / 3.0)
        });
        PI * self.shape.area() * scale * self.mean
    }
}

/// What a density per solid angle in the direction `way`, which need not be of unit length, is multiplied by where space
/// is mapped: |Aω|³/|det A|.
fn solid_angle_ratio(to_world: &Transform, way: Vec3) -> f32 {
    let stretch = to_world.vector(way.normalize_or_zero()).length();
    stretch * stretch * stretch / to_world.linear().determinant().abs()
}
