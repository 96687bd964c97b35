//! How fast texture coordinates change over the film (Igehy, *Tracing ray differentials*, 1999): the rays through the
//! neighbouring points meet the plane that touches the surface, and the steps between these points are written, by
//! least squares, as steps of u and v. As in Mitsuba a neighbour is a pixel away over the root of the samples in it.

use glam::{DVec3, Vec2, Vec3, Vec4};

use crate::interaction::{Cone, Interaction, Ray};
use crate::sensor::{Film, Sensor};

/// The camera, and how far apart its rays are.
#[derive(Clone, Debug)]
pub struct Footprint {
    sensor: Sensor,
    /// In units of the film.
    step: Vec2,
    /// Of a pixel's side.
    share: f32,
    /// Of the film in pixels.
    size: Vec2,
}

impl Footprint {
    /// Of so many samples a pixel.
    pub fn new(sensor: Sensor, film: &Film, samples: u32) -> Self {
        let size = Vec2::new(film.width as f32, film.height as f32);
        Self {
            sensor,
            step: size.recip() / (samples as f32).sqrt(),
            share: 1.0 / (samples as f32).sqrt(),
            size,
        }
    }

    /// The cone around a ray of the camera's: its circle is as large as what lies between the ray and its neighbours.
    pub(super) fn cone(&self, ray: &Ray) -> Cone {
        let [right, down] = self.sensor.neighbours(ray, self.step);
        let across = |a: Vec3, b: Vec3| a.cross(b).length().sqrt();
        Cone {
            width: across(right.origin - ray.origin, down.origin - ray.origin),
            spread: across(
                right.direction - ray.direction,
                down.direction - ray.direction,
            ),
        }
    }

    /// A point that a ray of the camera's has met, as textures see it.
    pub(super) fn seen<'s>(&self, ray: &Ray, at: Interaction<'s>) -> Interaction<'s> {
        let width = self.cone(ray).at(at.t);
        at.seen_within(width)
    }

    /// How much of what a pixel's samples cover together one of them stands for, as a length.
    pub(super) fn share(&self) -> f32 {
        self.share
    }

    /// By how many pixels, to the right and down, what is at `position` at a time is displaced over the film while the
    /// shutter is open; 0 where it is behind the camera.
    pub(super) fn motion(&self, position: impl Fn(f32) -> Vec3) -> Vec2 {
        self.motion_of(|time| position(time).extend(1.0))
    }

    /// The same of what is infinitely far in a direction: only a camera that turns displaces it. 0 under parallel rays.
    pub(super) fn sky_motion(&self, direction: Vec3) -> Vec2 {
        self.motion_of(|_| direction.extend(0.0))
    }

    /// The same of a point in homogeneous coordinates.
    fn motion_of(&self, point: impl Fn(f32) -> Vec4) -> Vec2 {
        let (open, close) = self.sensor.shutter();
        let [from, to] = [open, close].map(|time| self.place(point(time), time));
        let motion = to - from;
        if motion.is_finite() {
            motion
        } else {
            Vec2::ZERO
        }
    }

    /// Where a point in homogeneous coordinates is seen on the film, in pixels from its left and its top; not a number
    /// behind the camera.
    fn place(&self, point: Vec4, time: f32) -> Vec2 {
        let to_clip = self.sensor.projection() * self.sensor.world_to_camera(time);
        let clip = to_clip * point;
        let device = match clip.w > 0.0 {
            true => clip.truncate().truncate() / clip.w,
            false => Vec2::NAN,
        };
        (0.5 + 0.5 * device * Vec2::new(1.0, -1.0)) * self.size
    }

    /// The change of (u, v) from one ray to its neighbour to the right and to that below; 0 where there is none.
    pub(super) fn duv(&self, ray: &Ray, at: &Interaction<'_>) -> [Vec2; 2] {
        let [position, normal, dp_du, dp_dv] =
            [at.position, at.normal, at.dp_du, at.dp_dv].map(|v| v.as_dvec3());
        let neighbours = self.sensor.neighbours(ray, self.step);
        neighbours.map(|neighbour| {
            let (origin, direction) = (neighbour.origin.as_dvec3(), neighbour.direction.as_dvec3());
            let t = normal.dot(position - origin) / normal.dot(direction);
            let duv = in_terms_of(dp_du, dp_dv, origin + t * direction - position);
            if duv.is_finite() { duv } else { Vec2::ZERO }
        })
    }
}

/// The coefficients of `a` and `b` that come nearest to `v`.
fn in_terms_of(a: DVec3, b: DVec3, v: DVec3) -> Vec2 {
    let (aa, ab, bb) = (a.dot(a), a.dot(b), b.dot(b));
    let (av, bv) = (a.dot(v), b.dot(v));
    let scale = (aa * bb - ab * ab).recip();
    let (u, v) = (bb * av - ab * bv, aa * bv - ab * av);
    Vec2::new((u * scale) as f32, (v * scale) as f32)
}
