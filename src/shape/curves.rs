//! Curves as tubes of varying radius, from a text file: a control point a line, `x y z radius`, and an empty line
//! before each further curve. [`Curves`] holds the points of all curves and where each segment begins: 16 bytes a point
//! and 4 a segment, for hair has millions. What a segment looks like is each plugin's own.

mod read;

use std::sync::OnceLock;

use glam::{DVec3, DVec4, Vec2, Vec3, Vec4};

use super::{Bounds, SurfaceSample};
use crate::interaction::{Hit, Interaction, Ray, offset};
use crate::math::Frame;
use crate::math::distribution::Discrete;

pub(super) use read::read;

/// What two kinds of curve differ in.
#[derive(Clone, Copy, Debug)]
pub(super) struct Basis {
    /// Control points of a segment; the next segment begins one point later.
    pub(super) points: usize,
    /// For a message: `a B-spline`.
    pub(super) name: &'static str,
}

/// The curves of a file.
#[derive(Debug)]
pub(super) struct Curves {
    /// World space, with the radius in scene units.
    points: Vec<Vec4>,
    /// The first control point of each segment.
    segments: Vec<u32>,
    /// Over segments, by area; made when light is first drawn.
    areas: OnceLock<Option<Discrete>>,
}

/// A place on a tube.
pub(super) struct OnTube {
    /// The nearest point of the curve.
    pub(super) center: DVec3,
    /// Where the surface is.
    pub(super) position: DVec3,
    /// Along the curve; unit length.
    pub(super) along: DVec3,
    /// Of the surface, outward; of any length.
    pub(super) normal: DVec3,
    /// How the position changes along all curves, of which each segment takes an equal part.
    pub(super) dp_dv: DVec3,
    /// Where on the segment.
    pub(super) u: f32,
}

impl OnTube {
    /// Unit length.
    fn normal(&self) -> Vec3 {
        let out = (self.position - self.center).normalize_or_zero();
        self.normal.normalize_or(out).as_vec3()
    }

    /// As a point that was drawn, without a density.
    pub(super) fn drawn(&self, segment: u32) -> SurfaceSample {
        SurfaceSample {
            position: self.position.as_vec3(),
            normal: self.normal(),
            primitive: segment,
            barycentric: Vec2::new(self.u, 0.0),
            pdf: 0.0,
        }
    }
}

impl Curves {
    pub(super) fn count(&self) -> u32 {
        self.segments.len() as u32
    }

    /// The control points of a segment, which are `N`.
    #[inline]
    pub(super) fn segment<const N: usize>(&self, segment: u32) -> [DVec4; N] {
        let first = self.segments[segment as usize] as usize;
        std::array::from_fn(|i| self.points[first + i].as_dvec4())
    }

    /// Whether the segment before is of the same curve.
    #[inline]
    pub(super) fn follows(&self, segment: u32) -> bool {
        let before = segment.checked_sub(1).map(|s| self.segments[s as usize]);
        before.is_some_and(|before| before + 1 == self.segments[segment as usize])
    }

    /// Segments in proportion to their area, which `area` tells; `None` where there is none.
    pub(super) fn areas(&self, area: impl Fn(u32) -> f64) -> Option<&Discrete> {
        let build = || Discrete::new((0..self.count()).map(area));
        self.areas.get_or_init(build).as_ref()
    }

    /// Texture coordinates. u goes around the curve from the direction at right angles to z, v along all curves.
    pub(super) fn uv(&self, segment: u32, at: &OnTube) -> Vec2 {
        let out = (at.position - at.center).normalize_or_zero();
        let (rot, rad) = around(at.along);
        let angle = out.dot(rot).atan2(out.dot(rad)) / std::f64::consts::TAU;
        let angle = if angle < 0.0 { angle + 1.0 } else { angle };
        let v = (f64::from(at.u) + f64::from(segment)) / f64::from(self.count());
        Vec2::new(angle as f32, v as f32)
    }

    /// What a hit on a tube looks like; its first barycentric coordinate is the place on the segment.
    pub(super) fn interaction(&self, ray: &Ray, hit: &Hit, at: &OnTube) -> Interaction<'static> {
        let radial = at.position - at.center;
        let count = f64::from(self.count());
        let segment = self.segment_of(hit);
        let dp_du = (std::f64::consts::TAU * at.along.cross(radial)).as_vec3();
        let normal = at.normal();
        let frame = Frame::along(normal, dp_du);
        Interaction {
            t: hit.t,
            position: at.position.as_vec3(),
            error: rounding(at),
            normal,
            frame,
            uv: self.uv(segment, at),
            dp_du,
            dp_dv: (count * at.dp_dv).as_vec3(),
            wi: frame.to_local(-ray.direction),
            time: ray.time,
            shape: hit.shape,
            primitive: segment,
            mesh: None,
            barycentric: Vec2::new(at.u, 0.0),
        }
    }

    /// The segment that was hit.
    pub(super) fn segment_of(&self, hit: &Hit) -> u32 {
        hit.primitive
    }

    pub(super) fn bytes(&self) -> usize {
        self.points.len() * size_of::<Vec4>() + self.segments.len() * size_of::<u32>()
    }
}

/// The direction at right angles to a curve that is so many turns around it.
pub(super) fn turned(along: DVec3, turns: f32) -> DVec3 {
    let (rot, rad) = around(along);
    let (sin, cos) = (f64::from(turns) * std::f64::consts::TAU).sin_cos();
    cos * rad + sin * rot
}

/// Two directions at right angles to a curve and each other, from which angles around it are told: the first is as near
/// to +z as it can be.
fn around(along: DVec3) -> (DVec3, DVec3) {
    let rot = match along.z.abs() as f32 == 1.0 {
        true => DVec3::Y,
        false => (DVec3::Z - along * along.z).normalize(),
    };
    (rot, rot.cross(along))
}

/// Half a unit in the last place of a position that was computed in double precision, and what that may have lost.
fn rounding(at: &OnTube) -> Vec3 {
    const DOUBLE: f64 = 1e3 * f64::EPSILON;
    let reach = at.center.abs().max(at.position.abs());
    (reach * (f64::from(offset::gamma(2)) + DOUBLE)).as_vec3()
}

/// A box around balls, with room for rounding: around all that lies in their convex hull.
pub(super) fn around_balls(balls: &[DVec4]) -> Bounds {
    let bounds = balls.iter().fold(Bounds::EMPTY, |bounds, ball| {
        let (center, radius) = (ball.truncate(), ball.w.max(0.0));
        (bounds.with((center - radius).as_vec3())).with((center + radius).as_vec3())
    });
    let room = bounds.min.abs().max(bounds.max.abs()) * offset::gamma(4);
    Bounds {
        min: bounds.min - room,
        max: bounds.max + room,
    }
}
