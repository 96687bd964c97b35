//! `irradiancemeter`: the irradiance of the shape that it stands in, ∫ L cos θ dω over the side to which the normals
//! point. The film lies over the shape: a pixel shows the mean over its part of the surface, which is spread as Mitsuba
//! spreads random numbers over that shape. Directions are drawn in proportion to the cosine, so that each is worth π·L.

use std::f32::consts::PI;
use std::sync::Arc;

use glam::{Mat4, Vec2, Vec3};

use super::{Camera, Film};
use crate::description::declared::Plugin;
use crate::description::{Kind, Properties};
use crate::error::Result;
use crate::interaction::{Ray, offset};
use crate::lanes::warp;
use crate::math::Frame;
use crate::shape::Geometry;

/// A surface that measures.
#[derive(Clone, Debug)]
pub struct IrradianceMeter {
    shape: Arc<Geometry>,
    /// A bound on the rounding errors of positions, for each axis.
    error: Vec3,
    shutter: (f32, f32),
}

impl IrradianceMeter {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "the irradiance of the shape that it stands in",
        properties: &[super::COMMON],
    };

    pub(super) fn build(properties: &Properties<'_>, _film: &Film) -> Result<Self> {
        let Some(shape) = properties.holder(Kind::Shape) else {
            let message = "an irradiancemeter measures a shape, and stands in none";
            return Err(properties.error("", message).help("nest it in a <shape>"));
        };
        let shape = super::distant::surface(properties, &shape)?;
        let farthest = (0..shape.primitive_count())
            .map(|primitive| shape.bounds(primitive))
            .fold(Vec3::ZERO, |most, b| most.max(b.min.abs()).max(b.max.abs()));
        Ok(Self {
            shape,
            error: farthest * offset::gamma(16),
            shutter: super::shutter(properties)?,
        })
    }
}

impl Camera for IrradianceMeter {
    fn ray(&self, film: Vec2, lens: Vec2, time: f32) -> Ray {
        let place = film.clamp(Vec2::ZERO, Vec2::splat(1f32.next_down()));
        let point = self.shape.evenly(place).expect("it was tried");
        let local = warp::cosine_hemisphere::<f32>(lens.into());
        let direction = Frame::around(point.normal).to_world(local.into());
        let origin = offset::offset::<f32>(
            point.position.into(),
            self.error.into(),
            point.normal.into(),
            direction.into(),
        );
        Ray {
            origin: origin.into(),
            direction,
            t_max: f32::INFINITY,
            time,
        }
    }

    fn has_lens(&self) -> bool {
        true
    }

    fn is_projective(&self) -> bool {
        false
    }

    fn weight(&self, _film: Vec2) -> f32 {
        PI
    }

    fn neighbours(&self, ray: &Ray, _step: Vec2) -> [Ray; 2] {
        [*ray; 2]
    }

    fn world_to_camera(&self, _time: f32) -> Mat4 {
        Mat4::IDENTITY
    }

    fn projection(&self) -> Mat4 {
        Mat4::IDENTITY
    }

    fn shutter(&self) -> (f32, f32) {
        self.shutter
    }
}
