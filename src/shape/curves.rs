//! Curves as tubes of varying radius, from a text file: a control point a line, `x y z radius`, and an empty line
//! before each further curve. [`Curves`] holds the points of all curves and where each segment begins: 16 bytes a point
//! and 4 a segment, for hair has millions. What a segment looks like is each plugin's own.

mod read;

use glam::{DVec3, DVec4, Vec2, Vec3, Vec4};

use super::Bounds;
use crate::interaction::{Hit, Interaction, Ray, offset};
use crate::math::Frame;

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

    /// What a hit on a tube looks like. u goes around the curve from the direction at right angles to z, v along all
    /// curves.
    pub(super) fn interaction(&self, ray: &Ray, hit: &Hit, at: &OnTube) -> Interaction<'static> {
        let radial = at.position - at.center;
        let (rot, rad) = around(at.along);
        let out = radial.normalize_or_zero();
        let angle = out.dot(rot).atan2(out.dot(rad)) / std::f64::consts::TAU;
        let angle = if angle < 0.0 { angle + 1.0 } else { angle };
        let count = f64::from(self.count());
        let segment = self.segment_of(hit);
        let dp_du = (std::f64::consts::TAU * at.along.cross(radial)).as_vec3();
        let normal = at.normal.normalize_or(out).as_vec3();
        let frame = Frame::along(normal, dp_du);
        Interaction {
            t: hit.t,
            position: at.position.as_vec3(),
            error: rounding(at),
            normal,
            frame,
            uv: Vec2::new(
                angle as f32,
                ((f64::from(at.u) + f64::from(segment)) / count) as f32,
            ),
            dp_du,
            dp_dv: (count * at.dp_dv).as_vec3(),
            wi: frame.to_local(-ray.direction),
            time: ray.time,
            shape: hit.shape,
            primitive: segment,
            mesh: None,
            barycentric: Vec2::ZERO,
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
