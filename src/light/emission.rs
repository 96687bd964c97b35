//! Where light sets out: the beginnings of paths that go from lights (Veach, *Robust Monte Carlo methods for light transport
//! simulation*, 1997, chapters 8 and 10).
//!
//! How densely a light's paths go through a place is told per unit area at right angles and solid angle there: by the
//! invariance of étendue that is the same all along a ray, and radiance over it is what each path carries. Where a light is
//! a point or a single direction, what no path could meet by chance is left out of it, here as in [`Emitter::sample`].

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::{Emitter, Light, LightSample, interaction};
use crate::color::ColorModel;
use crate::interaction::offset::gamma;
use crate::interaction::{Interaction, Reference};
use crate::lanes::warp;
use crate::math::Frame;
use crate::shape::{Bounds, Geometry};

/// A ball around everything that light may meet.
#[derive(Clone, Copy, Debug)]
pub struct Ball {
    /// World space.
    pub center: Vec3,
    /// Scene units.
    pub radius: f32,
}

impl Ball {
    /// Around a box; around the origin where that is empty.
    pub fn around(bounds: Bounds) -> Self {
        if bounds.is_empty() {
            return Self {
                center: Vec3::ZERO,
                radius: 1.0,
            };
        }
        let half = 0.5 * (bounds.max.as_dvec3() - bounds.min.as_dvec3());
        Self {
            center: (bounds.min.as_dvec3() + half).as_vec3(),
            // A ray that only just misses would meet nothing.
            radius: (half.length() as f32).max(f32::MIN_POSITIVE) * (1.0 + 1e-3),
        }
    }

    /// The area of its shadow.
    fn shadow(&self) -> f32 {
        PI * self.radius * self.radius
    }
}

/// Random numbers of an emission.
#[derive(Clone, Copy, Debug)]
pub struct Draw {
    /// For the place, in [0, 1)².
    pub place: Vec2,
    /// For the direction, in [0, 1)².
    pub direction: Vec2,
    /// When.
    pub time: f32,
}

/// The beginning of a path.
#[derive(Clone, Debug)]
pub struct Emission<'l, S> {
    /// World space; off the surface, if it is on one.
    pub origin: Vec3,
    /// World space, unit length.
    pub direction: Vec3,
    /// What the path carries: radiance (of a light that is a point, intensity; of parallel light, irradiance) over its
    /// density.
    pub flux: S,
    /// The density of paths, see above; from a point, at distance 1.
    pub density: f32,
    /// What kind of light it is.
    pub source: Source<'l>,
}

/// Where light sets out.
#[derive(Clone, Debug)]
pub enum Source<'l> {
    /// A point of a surface.
    Surface(Box<Interaction<'l>>),
    /// A point of a surface from which light goes in one direction, so that nothing else ever finds it.
    Beam(Box<Interaction<'l>>),
    /// A point in space.
    Point,
    /// A direction that is drawn from others.
    Environment,
    /// The one direction of parallel light.
    Parallel,
}

/// A light as seen from a place.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Toward the light; world space, unit length.
    pub direction: Vec3,
    /// From where; world space.
    pub position: Vec3,
    /// How far away it is; infinite of one that is infinitely far.
    pub distance: f32,
    /// The density with which [`Emitter::sample`] draws it there, in 1/sr.
    pub pdf: f32,
    /// When.
    pub time: f32,
}

/// The emission of a light that is infinitely far: a direction as [`Emitter::sample`] draws it, and a place on the shadow
/// that the ball casts in it. `None` of a light that is not, or nowhere.
pub(super) fn from_afar<'l, C: ColorModel, E: Emitter<C> + ?Sized>(
    light: &'l E,
    ball: &Ball,
    draw: &Draw,
    w: &C::Wavelengths,
) -> Option<Emission<'l, C::Sample>> {
    let from = Reference {
        position: ball.center,
        time: draw.time,
    };
    let LightSample {
        direction,
        target: None,
        radiance,
        pdf,
        delta,
    } = light.sample(from, draw.direction, w)?
    else {
        return None;
    };
    let place = Vec2::from(warp::concentric_disk::<f32>(draw.place.into())) * ball.radius;
    let around = Frame::around(direction);
    let density = pdf / ball.shadow();
    (density > 0.0).then(|| Emission {
        origin: ball.center + direction * ball.radius + around.s * place.x + around.t * place.y,
        direction: -direction,
        flux: radiance * density.recip(),
        density,
        source: match delta {
            true => Source::Parallel,
            false => Source::Environment,
        },
    })
}

/// How densely such paths come to a place: what lies outside the ball, as a plane without an end does, may meet none.
pub(super) fn density_from_afar(ball: &Ball, seen: &Seen) -> f32 {
    let way = seen.position - ball.center;
    let along = way.dot(seen.direction);
    let beside = (way - along * seen.direction).length();
    match along <= ball.radius && beside <= ball.radius {
        true => seen.pdf / ball.shadow(),
        false => 0.0,
    }
}

/// The emission of a point from which directions are drawn with density `pdf` per solid angle.
pub(super) fn from_point<'l, C: ColorModel, E: Emitter<C> + ?Sized>(
    light: &'l E,
    position: Vec3,
    direction: Vec3,
    pdf: f32,
    time: f32,
    w: &C::Wavelengths,
) -> Option<Emission<'l, C::Sample>> {
    let at_one = Reference {
        position: position + direction,
        time,
    };
    let sample = light.sample(at_one, Vec2::ZERO, w)?;
    (pdf > 0.0 && pdf.is_finite()).then(|| Emission {
        origin: position,
        direction,
        flux: sample.radiance * pdf.recip(),
        density: pdf,
        source: Source::Point,
    })
}

/// A place drawn evenly over a shape's area.
pub(super) struct Place<'s> {
    /// As textures see it, seen along the normal.
    pub(super) at: Interaction<'s>,
    /// The shading normal, on the side that emits.
    pub(super) front: Vec3,
}

/// A place of a shape whose points can be drawn evenly; `None` of any other.
pub(super) fn place_on(shape: &Geometry, u: Vec2) -> Option<Place<'_>> {
    /// Of positions made of the corners, in units of their greatest coordinate.
    const ROUNDING: f32 = gamma(16);
    let point = shape.evenly(u)?;
    let bounds = shape.bounds(point.primitive);
    let at = Interaction {
        error: bounds.min.abs().max(bounds.max.abs()) * ROUNDING,
        ..interaction(shape, &point)
    };
    Some(Place {
        at,
        front: point.normal,
    })
}

impl<'s> Place<'s> {
    /// A direction on the side that emits, by the cosine: so paths are as dense in all of them, 1/π over the area.
    pub(super) fn direction(&self, u: Vec2) -> Vec3 {
        let local: Vec3 = warp::cosine_hemisphere::<f32>(u.into()).into();
        let normal = self.at.normal;
        let side = if normal.dot(self.front) < 0.0 {
            -normal
        } else {
            normal
        };
        Frame::around(side).to_world(local)
    }

    /// The place seen from a direction, and where a path begins that goes there.
    pub(super) fn toward(mut self, direction: Vec3) -> (Interaction<'s>, Vec3) {
        self.at.frame = Frame::around(self.front);
        self.at.wi = self.at.frame.to_local(direction);
        let origin = self.at.spawn(direction).origin;
        (self.at, origin)
    }
}

impl<C: ColorModel> Light<C> {
    /// The density with which [`Emitter::sample`] draws from `from` the place that an emission set out from, in 1/sr, or 1
    /// of a light that no path meets by chance.
    pub fn emission_pdf(&self, emission: &Emission<'_, C::Sample>, from: Vec3, time: f32) -> f32 {
        match &emission.source {
            Source::Surface(at) => self.surface_pdf(from, at),
            Source::Beam(_) => 0.0,
            Source::Point | Source::Parallel => 1.0,
            Source::Environment => self.environment_pdf(-emission.direction, time),
        }
    }
}
