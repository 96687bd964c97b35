//! Curves as tubes of varying radius, from a text file: a control point a line, `x y z radius`, and an empty line
//! before each further curve. [`Curves`] holds the points of all curves, 16 bytes each, and a bit for each segment that
//! begins a curve: hair has millions. What a segment looks like is each plugin's own.

mod read;

use std::sync::OnceLock;

use glam::{DVec3, DVec4, Vec2, Vec3, Vec4};

use super::{Bounds, SurfaceSample};
use crate::interaction::{Hit, Interaction, Ray, offset};
use crate::lanes;
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
    /// How many segments there are.
    count: u32,
    /// How many points a curve has more than segments.
    more: u32,
    /// Which segments begin a curve, 64 at a time.
    begun: Vec<Begun>,
    /// Over segments, by area; made when light is first drawn.
    areas: OnceLock<Option<Discrete>>,
}

/// Of 64 segments, those that begin a curve.
#[derive(Clone, Copy, Debug)]
struct Begun {
    /// The lowest bit is the first segment's.
    bits: u64,
    /// How many segments before these begin one.
    before: u32,
}

/// Segments of a [`Begun`].
const BEGUN: u32 = u64::BITS;

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
    /// None yet.
    fn new(basis: Basis) -> Self {
        Self {
            points: Vec::new(),
            count: 0,
            more: basis.points as u32 - 1,
            begun: Vec::new(),
            areas: OnceLock::new(),
        }
    }

    /// Makes a curve of so many segments, one at least, of the points that no curve has yet.
    fn begin(&mut self, segments: u32) {
        let before = self.begun.last();
        let before = before.map_or(0, |last| last.before + last.bits.count_ones());
        let first = self.count;
        self.count += segments;
        let all = self.count.div_ceil(BEGUN) as usize;
        while self.begun.len() < all {
            let own = self.begun.len() as u32 * BEGUN > first;
            let before = before + u32::from(own);
            self.begun.push(Begun { bits: 0, before });
        }
        self.begun[(first / BEGUN) as usize].bits |= 1 << (first % BEGUN);
    }

    pub(super) fn count(&self) -> u32 {
        self.count
    }

    /// The first control point of a segment.
    #[inline]
    fn first(&self, segment: u32) -> usize {
        let begun = self.begun[(segment / BEGUN) as usize];
        let upto = begun.bits << (BEGUN - 1 - segment % BEGUN);
        let curve = begun.before + upto.count_ones() - 1;
        segment as usize + self.more as usize * curve as usize
    }

    /// The control points of a segment, which are `N`, with their radii.
    #[inline]
    fn balls<const N: usize>(&self, segment: u32) -> &[Vec4; N] {
        let balls = self.points[self.first(segment)..].first_chunk();
        balls.expect("a segment has as many points as its basis")
    }

    /// The control points of a segment, which are `N`.
    #[inline]
    pub(super) fn segment<const N: usize>(&self, segment: u32) -> [DVec4; N] {
        self.balls(segment).map(|ball| ball.as_dvec4())
    }

    /// The same, as they are seen from a place.
    #[inline]
    pub(super) fn seen<const N: usize>(&self, segment: u32, from: Vec3) -> [Vec4; N] {
        self.balls(segment).map(|ball| ball - from.extend(0.0))
    }

    /// Asks for the memory of a segment's points ahead.
    #[inline]
    pub(super) fn fetch(&self, segment: u32) {
        let first = self.first(segment);
        lanes::fetch(&self.points[first]);
        lanes::fetch(&self.points[first + self.more as usize]);
    }

    /// Whether the segment before is of the same curve.
    #[inline]
    pub(super) fn follows(&self, segment: u32) -> bool {
        let begun = self.begun[(segment / BEGUN) as usize];
        begun.bits >> (segment % BEGUN) & 1 == 0
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
            footprint: [Vec2::ZERO; 2],
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
        size_of_val(&*self.points) + size_of_val(&*self.begun)
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

/// How far a line may seem to pass by and still meet: some rounding of single precision.
const ROUNDING: f32 = 64.0 * f32::EPSILON;

/// Whether a line from the origin passes by the hull of balls, which a plane through it tells that goes along them.
/// Most segments whose boxes a ray enters it passes by. Says no where it is not sure.
#[inline]
pub(super) fn passes_by<const N: usize>(balls: &[Vec4; N], direction: Vec3) -> bool {
    let chord = (balls[N - 1] - balls[0]).truncate();
    let normal = direction.cross(chord);
    let length = normal.length();
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    let mut reach = 0.0_f32;
    for ball in balls {
        let height = ball.truncate().dot(normal);
        low = low.min(height - ball.w * length);
        high = high.max(height + ball.w * length);
        reach = reach.max(ball.length_squared());
    }
    let room = ROUNDING * (reach * direction.length_squared() * chord.length_squared()).sqrt();
    // Where these numbers are of no common size, products of them may not be what they should.
    (1e-15..1e15).contains(&room) && (low > room || high < -room)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random;

    /// No line through the hull of balls passes them by, near or far, thick or thin; of lines beside them most do.
    #[test]
    fn a_line_that_meets_passes_nothing_by() {
        let (mut lines, mut passed) = (0, 0);
        for i in 0..200_000 {
            let number = |key: u64| random::unit(random::bits(key, i));
            let vector =
                |key| Vec3::from_array([key, key + 1, key + 2].map(|key| 2.0 * number(key) - 1.0));
            let size = 10_f32.powf(4.0 * number(0) - 2.0);
            let radius = size * 10_f32.powf(-4.0 * number(1));
            let distance = size * 10_f32.powf(3.0 * number(2));
            let middle = distance * vector(3).normalize();
            let balls: [Vec4; 4] = std::array::from_fn(|ball| {
                let key = 10 + 4 * ball as u64;
                let center = middle + size * vector(key);
                center.extend(radius * number(key + 3))
            });
            let shares: [f32; 4] = std::array::from_fn(|ball| number(40 + ball as u64));
            let all: f32 = shares.iter().sum();
            let inside: DVec4 = (balls.iter().zip(shares))
                .map(|(ball, share)| f64::from(share / all) * ball.as_dvec4())
                .sum();
            let out = vector(50).as_dvec3().normalize();
            let at = inside.truncate() + inside.w * 0.999 * out;
            assert!(!passes_by(&balls, at.normalize().as_vec3()), "{balls:?}");
            let beside = middle + 3.0 * size * vector(60);
            lines += 1;
            passed += i32::from(passes_by(&balls, beside.normalize()));
        }
        assert!(2 * passed > lines, "{passed} of {lines}");
    }
}
