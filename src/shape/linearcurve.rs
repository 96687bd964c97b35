//! `linearcurve`: lines as tubes, from the text file `filename` (see `curves`), two control points or more a curve;
//! `to_world` moves the points and leaves the radii. A curve is what a ball sweeps whose radius changes evenly from point
//! to point: cones that touch the balls at their ends (Han et al., *Ray Tracing Generalized Tube Primitives*, 2019). Only
//! the outside is met, and nothing of a segment that is inside its neighbours. Texture coordinates are the angle around
//! the line and the place along all curves. For light all of it is drawn evenly, and what is inside a neighbour with it:
//! no ray gets there.

use std::f64::consts::TAU;

use glam::{DMat4, DVec3, DVec4, Vec2, Vec3};

use super::curves::{Basis, Curves, OnTube, around_balls, passes_by, read, turned};
use super::{Bounds, Geometry, Shape, Surface, SurfaceSample, area_to_solid_angle};
use crate::description::Properties;
use crate::description::declared::{Plugin, file};
use crate::error::Result;
use crate::interaction::{Hit, Interaction, Ray};
use crate::math::distribution::Discrete;

/// Lines in world space. A primitive is a segment: its cone, the ball at its end, and the one at the curve's start.
#[derive(Debug)]
pub struct LinearCurves {
    curves: Curves,
}

pub(super) const PLUGIN: Plugin = Plugin {
    about: "lines as tubes with round joints and ends",
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
        points: 2,
        name: "a linear curve",
    };
    let text = read(properties, to_world, basis)?;
    let curves = LinearCurves {
        curves: text.curves,
    };
    Ok(Shape {
        warnings: text.warnings,
        ..Geometry::Lines(curves).into()
    })
}

/// A cone that touches two balls, between the circles where it does.
struct Cone {
    from: DVec3,
    radius: f64,
    /// To the other ball's centre.
    axis: DVec3,
    /// How much the other ball is larger.
    growth: f64,
    /// axis² − growth²; not above 0 where one ball holds the other, and there is no cone.
    spread: f64,
}

impl Cone {
    fn new([a, b]: [DVec4; 2]) -> Self {
        let axis = (b - a).truncate();
        let growth = b.w - a.w;
        Self {
            from: a.truncate(),
            radius: a.w,
            axis,
            growth,
            // A radius below 0 makes no surface.
            spread: match a.w >= 0.0 && b.w >= 0.0 {
                true => axis.length_squared() - growth * growth,
                false => 0.0,
            },
        }
    }

    /// Where on the axis, 0 to 1 from ball to ball, the surface's normal through a place `from` the first ball begins.
    #[inline]
    fn foot(&self, place: DVec3) -> f64 {
        (place.dot(self.axis) + self.radius * self.growth) / self.spread
    }

    /// Whether it holds a place, with a margin that rounding does not reach.
    fn holds(&self, place: DVec3) -> bool {
        let way = place - self.from;
        let foot = self.foot(way);
        let radius = self.radius + foot * self.growth;
        let inside = (way - foot * self.axis).length_squared() < radius * radius * (1.0 - 1e-6);
        self.spread > 0.0 && foot > 0.0 && foot < 1.0 && inside
    }

    /// Where a line comes in: how far along it, and the foot. `origin` is seen from the first ball, and `direction` has
    /// unit length.
    fn enter(&self, origin: DVec3, direction: DVec3) -> Option<(f64, f64)> {
        if self.spread <= 0.0 {
            return None;
        }
        // About the point of the line that is next to the first ball, so that nothing cancels from far away.
        let near = -origin.dot(direction);
        let o = origin + near * direction;
        let (og, dg) = (o.dot(self.axis), direction.dot(self.axis));
        let (r, growth) = (self.radius, self.growth);
        let squared = self.axis.length_squared();
        let a = self.spread - dg * dg;
        let b = self.spread * o.dot(direction) - dg * (og + r * growth);
        let c =
            self.spread * o.length_squared() - og * og - r * r * squared - 2.0 * r * growth * og;
        let inside = b * b - a * c;
        if inside < 0.0 {
            return None;
        }
        let root = inside.sqrt();
        let t = if b < 0.0 {
            c / (root - b)
        } else {
            (-b - root) / a
        };
        let foot = self.foot(o + t * direction);
        let on = t.is_finite() && (0.0..=1.0).contains(&foot);
        (on && r + foot * growth > 0.0).then_some((near + t, foot))
    }
}

/// Where a line comes into a ball: how far along it. `origin` is seen from the centre.
fn enter_ball(origin: DVec3, direction: DVec3, radius: f64) -> Option<f64> {
    let near = -origin.dot(direction);
    let inside = radius * radius - (origin + near * direction).length_squared();
    (radius > 0.0 && inside >= 0.0).then(|| near - inside.sqrt())
}

impl LinearCurves {
    fn cone(&self, segment: u32) -> Cone {
        Cone::new(self.curves.segment(segment))
    }

    /// Where a ray first meets a segment: t, and the place on it.
    fn first(&self, segment: u32, ray: &Ray) -> Option<(f64, f64)> {
        if passes_by(&self.curves.seen::<2>(segment, ray.origin), ray.direction) {
            return None;
        }
        let [a, b] = self.curves.segment(segment);
        let cone = Cone::new([a, b]);
        let direction = ray.direction.as_dvec3();
        let length = direction.length();
        let direction = direction / length;
        let origin = ray.origin.as_dvec3();
        let from = origin - a.truncate();
        let starts = !self.curves.follows(segment);
        // A ball's surface is met where its cone does not begin.
        let start = (starts.then(|| enter_ball(from, direction, a.w)).flatten())
            .filter(|t| cone.spread <= 0.0 || cone.foot(from + *t * direction) <= 0.0);
        let end = enter_ball(origin - b.truncate(), direction, b.w)
            .filter(|t| cone.spread <= 0.0 || cone.foot(from + *t * direction) >= 1.0);
        let side = cone.enter(from, direction);
        let ends = [start.map(|t| (t, 0.0)), end.map(|t| (t, 1.0))];
        let last = segment + 1 == self.curves.count() || !self.curves.follows(segment + 1);
        let before = (!starts).then(|| self.cone(segment - 1));
        let after = (!last).then(|| self.cone(segment + 1));
        let met = [side].into_iter().chain(ends).flatten();
        let met = met.filter(|(t, _)| {
            let (place, single) = (origin + *t * direction, (*t / length) as f32);
            let inside = |cone: &Option<Cone>| cone.as_ref().is_some_and(|c| c.holds(place));
            single > 0.0 && single <= ray.t_max && !inside(&before) && !inside(&after)
        });
        let first = met.min_by(|a, b| a.0.total_cmp(&b.0));
        first.map(|(t, foot)| (t / length, foot))
    }
}

impl LinearCurves {
    /// The place whose normal begins at `foot` on the axis and goes `out`.
    fn at(&self, segment: u32, foot: f32, out: DVec3) -> OnTube {
        let [a, b] = self.curves.segment(segment);
        let ball = a + f64::from(foot) * (b - a);
        let (center, axis) = (ball.truncate(), (b - a).truncate());
        OnTube {
            center,
            position: center + ball.w * out,
            along: axis.normalize_or(DVec3::X),
            normal: out,
            dp_dv: axis + (b.w - a.w) * out,
            u: foot,
        }
    }

    /// The place with its foot there that lies in the direction of a position.
    fn toward(&self, segment: u32, foot: f32, position: DVec3) -> OnTube {
        let [a, b] = self.curves.segment(segment);
        let center = (a + f64::from(foot) * (b - a)).truncate();
        let out = (position - center).normalize_or(DVec3::Z);
        self.at(segment, foot, out)
    }

    /// The areas of a segment's side, of the ball at its end and of that at its start, as far as the side does not hold
    /// them.
    fn parts(&self, segment: u32) -> [f64; 3] {
        let [a, b] = self.curves.segment(segment);
        let cone = Cone::new([a, b]);
        let ball = |radius: f64, share: f64| 2.0 * TAU * radius.max(0.0).powi(2) * share;
        let (side, end, start) = match cone.spread > 0.0 {
            true => {
                let length = cone.axis.length();
                let side = 0.5 * TAU * (a.w + b.w) * cone.spread / length;
                let steep = cone.growth / length;
                (side, 0.5 * (1.0 + steep), 0.5 * (1.0 - steep))
            }
            false => (0.0, 1.0, 1.0),
        };
        let start = if self.curves.follows(segment) {
            0.0
        } else {
            start
        };
        [side, ball(b.w, end), ball(a.w, start)]
    }

    fn areas(&self) -> Option<&Discrete> {
        self.curves
            .areas(|segment| self.parts(segment).iter().sum())
    }

    /// A place drawn evenly over a segment: its foot, and the normal there.
    fn draw(&self, segment: u32, u: Vec2) -> Option<(f64, DVec3)> {
        let part = Discrete::new(self.parts(segment))?.sample(u.x);
        let (rest, [a, b]) = (f64::from(part.rest), self.curves.segment(segment));
        let cone = Cone::new([a, b]);
        let along = cone.axis.normalize_or(DVec3::X);
        let steep = match cone.spread > 0.0 {
            true => cone.growth / cone.axis.length(),
            false => 0.0,
        };
        let (foot, cos) = match (part.index, cone.spread > 0.0) {
            // In proportion to the radius, which changes evenly.
            (0, _) => {
                let squared = a.w * a.w + rest * (b.w * b.w - a.w * a.w);
                (rest * (a.w + b.w) / (a.w + squared.max(0.0).sqrt()), -steep)
            }
            (1, true) => (1.0, -steep + rest * (1.0 + steep)),
            (_, true) => (0.0, -steep - rest * (1.0 - steep)),
            (1, false) => (1.0, 2.0 * rest - 1.0),
            (_, false) => (0.0, 2.0 * rest - 1.0),
        };
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        Some((foot, cos * along + sin * turned(along, u.y)))
    }
}

impl Surface for LinearCurves {
    fn primitive_count(&self) -> u32 {
        self.curves.count()
    }

    fn bounds(&self, primitive: u32) -> Bounds {
        around_balls(&self.curves.segment::<2>(primitive))
    }

    fn intersect(&self, primitive: u32, ray: &Ray) -> Option<(f32, f32, f32)> {
        let (t, foot) = self.first(primitive, ray)?;
        Some((t as f32, foot as f32, 0.0))
    }

    fn interaction(&self, ray: &Ray, hit: &Hit) -> Interaction<'_> {
        let place = ray.origin.as_dvec3() + f64::from(hit.t) * ray.direction.as_dvec3();
        let on_tube = self.toward(self.curves.segment_of(hit), hit.u, place);
        self.curves.interaction(ray, hit, &on_tube)
    }

    fn fetch(&self, primitive: u32) {
        self.curves.fetch(primitive);
    }

    fn area(&self) -> f64 {
        self.areas().map_or(0.0, Discrete::total)
    }

    fn sample(&self, from: Vec3, u: Vec2) -> Option<SurfaceSample> {
        let areas = self.areas()?;
        let drawn = areas.sample(u.x);
        let segment = drawn.index as u32;
        let (foot, out) = self.draw(segment, Vec2::new(drawn.rest, u.y))?;
        let point = self.at(segment, foot as f32, out).drawn(segment);
        let pdf = area_to_solid_angle(areas.total(), from, point.position, point.normal);
        (pdf > 0.0 && pdf.is_finite()).then_some(SurfaceSample { pdf, ..point })
    }

    fn uv(&self, point: &SurfaceSample) -> Vec2 {
        let (segment, foot) = (point.primitive, point.barycentric.x);
        let at = self.toward(segment, foot, point.position.as_dvec3());
        self.curves.uv(segment, &at)
    }

    fn pdf(&self, from: Vec3, at: &Interaction<'_>) -> f32 {
        area_to_solid_angle(self.area(), from, at.position, at.normal)
    }

    fn bytes(&self) -> usize {
        self.curves.bytes()
    }
}
