//! `bsplinecurve`: cubic B-splines as tubes, from the text file `filename` (see `curves`), four control points or more a
//! curve; `to_world` moves the points and leaves the radii. A tube is what a circle sweeps that stands at right angles to
//! the curve; it has no ends, and only its outside is met, so that a ray inside of it leaves. Texture coordinates are
//! the angle around the curve, from where its z is greatest a quarter turn before, and the place along all curves.
//! For light a segment is drawn by its area, and a place evenly along it and around it, whose density is known.
//! A hit is found by going from cone to cone along the curve (Reshetov and Luebke, *Phantom Ray-Hair Intersector*,
//! 2018), in pieces that are nearly straight and in double precision.

use std::f64::consts::TAU;

use glam::{DMat4, DVec3, DVec4, Vec2, Vec3, Vec4};

use super::curves::{Basis, Curves, OnTube, around_balls, passes_by, read, turned};
use super::{Bounds, Geometry, Shape, Surface, SurfaceSample, area_to_solid_angle};
use crate::description::Properties;
use crate::description::declared::{Plugin, file};
use crate::error::Result;
use crate::interaction::{Hit, Interaction, Ray};
use crate::math::distribution::Discrete;

/// B-splines in world space. A primitive is a segment of four control points.
#[derive(Debug)]
pub struct BsplineCurves {
    curves: Curves,
}

pub(super) const PLUGIN: Plugin = Plugin {
    about: "cubic B-splines as tubes, such as hair",
    properties: &[
        super::COMMON,
        &[file(
            "filename",
            "a control point a line, x y z radius; an empty line between curves",
        )],
    ],
};

pub(super) fn build(properties: &Properties<'_>, to_world: &DMat4) -> Result<Shape> {
    let basis = Basis {
        points: 4,
        name: "a B-spline",
    };
    let text = read(properties, to_world, basis)?;
    let curves = BsplineCurves {
        curves: text.curves,
    };
    Ok(Shape {
        warnings: text.warnings,
        ..Geometry::Bsplines(curves).into()
    })
}

/// A segment's control points as those of a Bézier curve.
#[inline]
fn bezier([p0, p1, p2, p3]: [DVec4; 4]) -> [DVec4; 4] {
    [
        (p0 + 4.0 * p1 + p2) / 6.0,
        (2.0 * p1 + p2) / 3.0,
        (p1 + 2.0 * p2) / 3.0,
        (p1 + 4.0 * p2 + p3) / 6.0,
    ]
}

/// The same in single precision.
#[inline]
fn bezier_single([p0, p1, p2, p3]: [Vec4; 4]) -> [Vec4; 4] {
    const THIRD: f32 = 1.0 / 3.0;
    let (one, two) = (THIRD * (2.0 * p1 + p2), THIRD * (p1 + 2.0 * p2));
    [
        0.5 * (THIRD * (p0 + 2.0 * p1) + one),
        one,
        two,
        0.5 * (two + THIRD * (2.0 * p2 + p3)),
    ]
}

/// A Bézier curve at a parameter: value, first, second and third derivative.
#[inline]
fn at([a, b, c, d]: &[DVec4; 4], u: f64) -> [DVec4; 4] {
    let v = 1.0 - u;
    let (ab, bc, cd) = (*a * v + *b * u, *b * v + *c * u, *c * v + *d * u);
    let (abc, bcd) = (ab * v + bc * u, bc * v + cd * u);
    [
        abc * v + bcd * u,
        3.0 * (bcd - abc),
        6.0 * (cd - 2.0 * bc + ab),
        6.0 * (*d - 3.0 * (*c - *b) - *a),
    ]
}

/// A Bézier curve cut in two at its middle.
#[inline]
fn halves([a, b, c, d]: &[DVec4; 4]) -> [[DVec4; 4]; 2] {
    let (ab, bc, cd) = (0.5 * (*a + *b), 0.5 * (*b + *c), 0.5 * (*c + *d));
    let (abc, bcd) = (0.5 * (ab + bc), 0.5 * (bc + cd));
    let middle = 0.5 * (abc + bcd);
    [[*a, ab, abc, middle], [middle, bcd, cd, *d]]
}

/// Part of a segment, as a ray sees it.
#[derive(Clone, Copy)]
struct Piece {
    /// Control points in a frame whose z axis the ray is, and the radii.
    points: [DVec4; 4],
    /// Where on the segment it begins, and how much of it it is.
    start: f64,
    width: f64,
    /// How often the segment was halved.
    depth: u32,
}

/// A segment is halved so often at most.
const DEEPEST: u32 = 6;
/// How far a piece's control points may lie from where those of a straight and even one would, as a part of its length.
const STRAIGHT: f64 = 0.1;

impl Piece {
    /// Whether the ray, up to `end`, comes near it.
    #[inline]
    fn is_near(&self, end: f64) -> bool {
        let p = &self.points;
        let low = p[0].min(p[1]).min(p[2].min(p[3]));
        let high = p[0].max(p[1]).max(p[2].max(p[3]));
        let r = high.w;
        // Where no radius is above 0 there is no surface.
        let across = low.x <= r && low.y <= r && high.x >= -r && high.y >= -r;
        across && r > 0.0 && high.z >= -r && low.z <= end + r
    }

    /// What a straight and even piece would differ by from it, if that is little enough.
    #[inline]
    fn straightness(&self) -> Option<f64> {
        let [a, b, c, d] = self.points;
        let one = b - (2.0 * a + d) / 3.0;
        let two = c - (a + 2.0 * d) / 3.0;
        let chord = (d - a).truncate().length_squared();
        let squared = one.length_squared().max(two.length_squared());
        (squared <= STRAIGHT * STRAIGHT * chord || self.depth == DEEPEST).then(|| squared.sqrt())
    }

    /// Where on it, from 0 to 1, the chord comes nearest to the ray's line; `None` where that is farther than the radius
    /// and `slack`.
    #[inline]
    fn nearest(&self, slack: f64) -> Option<f64> {
        let [a, .., d] = self.points;
        let (from, way) = (a.truncate().truncate(), (d - a).truncate().truncate());
        let squared = way.length_squared();
        let u = match squared > 0.0 {
            true => (-from.dot(way) / squared).clamp(0.0, 1.0),
            false => 0.5,
        };
        let reach = a.w.max(d.w) + slack;
        ((from + u * way).length_squared() <= reach * reach).then_some(u)
    }

    /// Whether the ray goes along it, so that it may come in far from where the chord is nearest.
    #[inline]
    fn is_seen_end_on(&self) -> bool {
        let [a, .., d] = self.points;
        let chord = (d - a).truncate();
        chord.z * chord.z > END_ON * chord.length_squared()
    }
}

/// Where a ray meets a tube: how far along it, and where on the segment.
#[derive(Clone, Copy)]
struct Crossing {
    z: f64,
    u: f64,
}

/// Steps from cone to cone.
const STEPS: u32 = 12;
/// Where a step along the segment is as small as this, the next one is rounding.
const CLOSE: f64 = 1e-4;
/// From this square of the cosine on, a ray goes along a curve.
const END_ON: f64 = 0.7;
/// How far beyond its ends a segment still counts, so that no ray slips through between two.
const BEYOND: f64 = 1e-9;

/// Goes from cone to cone of a segment, from the parameter `u` on, until one stays: a place where the ray comes in.
#[inline]
fn approach(points: &[DVec4; 4], mut u: f64) -> Option<Crossing> {
    let mut bend = 0.0;
    for _ in 0..STEPS {
        let [c, d, dd, _] = at(points, u);
        let (center, along, turn) = (c.truncate(), d.truncate(), dd.truncate());
        let squared = along.length_squared();
        // How much the plane at right angles turns on the way to the surface, as far as the last step knows.
        let k = (squared - bend).max(0.1 * squared);
        // A point of the ray at the height ζ above the centre is in that plane at u + a + b·ζ.
        let q0 = DVec3::new(-center.x, -center.y, 0.0);
        let (a, b) = (q0.dot(along) / k, along.z / k);
        let (v0, v1) = (q0 - a * along, DVec3::Z - b * along);
        let (r0, r1) = (c.w + a * d.w, b * d.w);
        let (qa, qb, qc) = (
            v1.length_squared() - r1 * r1,
            v0.dot(v1) - r0 * r1,
            v0.length_squared() - r0 * r0,
        );
        let inside = qb * qb - qa * qc;
        // The cone's near side; where the ray passes it, the place next to it.
        let root = inside.max(0.0).sqrt();
        let height = if qb < 0.0 {
            qc / (root - qb)
        } else {
            (-qb - root) / qa
        };
        let step = a + b * height;
        if !step.is_finite() {
            return None;
        }
        if step.abs() < CLOSE {
            let far = inside < -1e-9 * qb * qb;
            let (radius, u) = (c.w + step * d.w, u + step);
            let q = q0 + height * DVec3::Z - step * along;
            let outward = k * q - radius * d.w * along;
            let crossing = Crossing {
                z: center.z + height,
                u,
            };
            return (!far && radius > 0.0 && outward.z < 0.0).then_some(crossing);
        }
        // The line passes the cone, and by more than the curve bends away from it on the step.
        let bends = step * step * turn.length();
        let across = along.z * along.z < END_ON * squared;
        if inside < 0.0 && across && qc - qb * qb / qa > bends * (2.0 * r0.abs() + bends) {
            return None;
        }
        u += step.clamp(-0.5, 0.5);
        if !(-0.5..=1.5).contains(&u) {
            return None;
        }
        bend = (q0 + height * DVec3::Z).dot(turn);
    }
    None
}

impl BsplineCurves {
    /// Where a ray first meets a segment.
    fn first(&self, segment: u32, ray: &Ray) -> Option<Crossing> {
        let balls = bezier_single(self.curves.seen(segment, ray.origin));
        if passes_by(&balls, ray.direction) {
            return None;
        }
        let origin = ray.origin.as_dvec3();
        let direction = ray.direction.as_dvec3();
        let length = direction.length();
        let z = direction / length;
        let x = z.any_orthonormal_vector();
        let y = z.cross(x);
        let seen = |p: DVec4| {
            let way = p.truncate() - origin;
            DVec4::new(way.dot(x), way.dot(y), way.dot(z), p.w)
        };
        let [a, b, c, d] = self.curves.segment(segment);
        let whole = Piece {
            points: bezier([seen(a), seen(b), seen(c), seen(d)]),
            start: 0.0,
            width: 1.0,
            depth: 0,
        };
        let limit = f64::from(ray.t_max) * length;
        if !whole.is_near(limit) {
            return None;
        }
        // A place may be come to from another piece than its own, where control points are doubled. So no piece is left
        // out for the ray's end: what is met first would depend on what was met before.
        let mut end = f64::INFINITY;
        let mut best: Option<Crossing> = None;
        let mut pieces = [whole; DEEPEST as usize + 1];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let piece = pieces[count];
            if !piece.is_near(end) {
                continue;
            }
            let Some(slack) = piece.straightness() else {
                let width = 0.5 * piece.width;
                let [low, high] = halves(&piece.points);
                for (points, start) in [(low, piece.start), (high, piece.start + width)] {
                    pieces[count] = Piece {
                        points,
                        start,
                        width,
                        depth: piece.depth + 1,
                    };
                    count += 1;
                }
                continue;
            };
            let Some(nearest) = piece.nearest(slack) else {
                continue;
            };
            let starts = match piece.is_seen_end_on() {
                true => &[nearest, 0.0, 1.0][..],
                false => &[nearest],
            };
            for start in starts {
                let met = approach(&whole.points, piece.start + piece.width * start);
                let on = -BEYOND..=1.0 + BEYOND;
                let met = met.filter(|met| {
                    let t = (met.z / length) as f32;
                    on.contains(&met.u) && t > 0.0 && met.z <= end
                });
                if let Some(met) = met {
                    end = met.z;
                    best = Some(met);
                }
            }
        }
        let best = best.filter(|met| met.z <= limit);
        best.map(|met| Crossing {
            z: met.z / length,
            u: met.u.clamp(0.0, 1.0),
        })
    }
}

/// Places along a segment at which Gauss and Legendre sum up, and their weights (Abramowitz and Stegun, 25.4.29).
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_7, 0.173_927_422_568_726_9),
    (0.330_009_478_207_571_9, 0.326_072_577_431_273_1),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_1),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_9),
];
/// Places around a tube at which its area is summed up.
const AROUND: u16 = 8;

impl BsplineCurves {
    /// The place at a parameter of a segment, in the direction that `out` makes of the curve's own: at right angles to
    /// it, of unit length. The normal's length is that of the derivative along the curve, times the area that a radian
    /// around it and a unit of the parameter cover.
    #[inline]
    fn at(&self, segment: u32, u: f32, out: impl FnOnce(DVec3) -> DVec3) -> OnTube {
        let points = bezier(self.curves.segment(segment));
        let [c, d, dd, ddd] = at(&points, f64::from(u));
        let (center, first) = (c.truncate(), d.truncate());
        let (second, third) = (dd.truncate(), ddd.truncate());
        let speed = first.length();
        let along = first / speed;
        let out = out(along);
        let radial = c.w * out;
        let normal = (speed * speed - radial.dot(second)) * radial - d.w * c.w * first;
        // Along the curve the angle is that from the curve's own normal, which turns with its torsion.
        let binormal = first.cross(second);
        let is_twisted = binormal.length() > 1e-6 && third.length() > 1e-6;
        let torsion = match is_twisted {
            true => third.dot(binormal) / binormal.length_squared(),
            false => 0.0,
        };
        let turned = torsion * speed * along.cross(out) - out.dot(second) / speed * along;
        OnTube {
            center,
            position: center + radial,
            along,
            normal,
            dp_dv: first + d.w * out + c.w * turned,
            u,
        }
    }

    /// The place at a parameter of a segment that lies in the direction of a position.
    fn toward(&self, segment: u32, u: f32, position: DVec3) -> OnTube {
        let [c, ..] = at(&bezier(self.curves.segment(segment)), f64::from(u));
        self.at(segment, u, |along| {
            let way = position - c.truncate();
            (way - way.dot(along) * along).normalize_or(along.any_orthonormal_vector())
        })
    }

    /// The place of a point on the tube.
    fn near(&self, point: &SurfaceSample) -> OnTube {
        self.toward(
            point.primitive,
            point.barycentric.x,
            point.position.as_dvec3(),
        )
    }

    /// How much area a turn around a segment and the whole of its parameter cover, if they do as at this place.
    fn stretch(&self, segment: u32, at: &OnTube) -> f64 {
        let [_, d, ..] = self::at(&bezier(self.curves.segment(segment)), f64::from(at.u));
        TAU * at.normal.length() / d.truncate().length()
    }

    fn areas(&self) -> Option<&Discrete> {
        self.curves.areas(|segment| {
            let mut sum = 0.0;
            for (u, weight) in GAUSS {
                for i in 0..AROUND {
                    let turns = f32::from(i) / f32::from(AROUND);
                    let at = self.at(segment, u as f32, |along| turned(along, turns));
                    sum += weight * self.stretch(segment, &at) / f64::from(AROUND);
                }
            }
            sum
        })
    }

    /// With which density per solid angle a point is drawn.
    fn density(&self, from: Vec3, point: &SurfaceSample, at: &OnTube) -> f32 {
        let segment = point.primitive;
        let probability = (self.areas()).map_or(0.0, |areas| areas.probability(segment as usize));
        let area = self.stretch(segment, at) / probability;
        let pdf = area_to_solid_angle(area, from, point.position, point.normal);
        if pdf.is_finite() { pdf } else { 0.0 }
    }
}

impl Surface for BsplineCurves {
    fn primitive_count(&self) -> u32 {
        self.curves.count()
    }

    fn bounds(&self, primitive: u32) -> Bounds {
        around_balls(&bezier(self.curves.segment(primitive)))
    }

    fn intersect(&self, primitive: u32, ray: &Ray) -> Option<(f32, f32, f32)> {
        let met = self.first(primitive, ray)?;
        let t = met.z as f32;
        (t > 0.0 && t <= ray.t_max).then_some((t, met.u as f32, 0.0))
    }

    fn interaction(&self, ray: &Ray, hit: &Hit) -> Interaction<'_> {
        let way = ray.origin.as_dvec3() + f64::from(hit.t) * ray.direction.as_dvec3();
        let on_tube = self.toward(self.curves.segment_of(hit), hit.u, way);
        self.curves.interaction(ray, hit, &on_tube)
    }

    fn fetch(&self, primitive: u32) {
        self.curves.fetch(primitive);
    }

    fn area(&self) -> f64 {
        self.areas().map_or(0.0, Discrete::total)
    }

    fn sample(&self, from: Vec3, u: Vec2) -> Option<SurfaceSample> {
        let drawn = self.areas()?.sample(u.x);
        let segment = drawn.index as u32;
        let at = self.at(segment, u.y, |along| turned(along, drawn.rest));
        let point = at.drawn(segment);
        let pdf = self.density(from, &point, &at);
        (pdf > 0.0).then_some(SurfaceSample { pdf, ..point })
    }

    fn uv(&self, point: &SurfaceSample) -> Vec2 {
        self.curves.uv(point.primitive, &self.near(point))
    }

    fn pdf(&self, from: Vec3, at: &Interaction<'_>) -> f32 {
        let point = SurfaceSample {
            position: at.position,
            normal: at.normal,
            primitive: at.primitive,
            barycentric: at.barycentric,
            pdf: 0.0,
        };
        self.density(from, &point, &self.near(&point))
    }

    fn bytes(&self) -> usize {
        self.curves.bytes()
    }
}
