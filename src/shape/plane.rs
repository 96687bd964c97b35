//! `plane`, Étendue's own: the infinite plane z = 0 facing +z, under `to_world` and `flip_normals`. It is the
//! `rectangle` without its edges: its texture coordinates are (p + 1)/2 as well, and go on beyond [0, 1]. The
//! distance is s = −(d + N·O)/(N·D), in double precision.

use glam::{DAffine3, DMat4, DVec3, Vec2, Vec3};

use super::{Bounds, Geometry, Shape, Surface, SurfaceSample, rounding};
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::interaction::{Hit, Interaction, Ray};
use crate::math::Frame;

/// A plane in world space. It has no area to draw points from, so it cannot be a light.
#[derive(Debug)]
pub struct Plane {
    to_world: DAffine3,
    to_local: DAffine3,
    /// Unit length.
    normal: Vec3,
}

pub(super) const PLUGIN: Plugin = Plugin {
    about: "the rectangle without its edges",
    properties: &[super::COMMON, &[super::FLIP_NORMALS]],
};

pub(super) fn build(properties: &Properties<'_>, to_world: &DMat4) -> Result<Shape> {
    let to_world = DAffine3::from_mat4(*to_world);
    let to_local = to_world.inverse();
    let flip = properties.boolean("flip_normals")?;
    // By the inverse transpose, whose rows are the columns here.
    let normal = to_local.matrix3.row(2).normalize_or_zero() * if flip { -1.0 } else { 1.0 };
    if !(to_local.is_finite() && normal != DVec3::ZERO) {
        return Err(properties.error("to_world", "the plane has no finite place"));
    }
    let plane = Plane {
        to_world,
        to_local,
        normal: normal.as_vec3(),
    };
    Ok(Geometry::Plane(plane).into())
}

impl Plane {
    /// The normal, and the corners of a square of the plane around the foot of a point; its sides are twice `half`.
    pub(crate) fn square(&self, around: Vec3, half: f64) -> (Vec3, [Vec3; 4]) {
        let normal = self.normal.as_dvec3();
        let origin = self.to_world.translation;
        let around = around.as_dvec3();
        let foot = around - (around - origin).dot(normal) * normal;
        let (s, t) = normal.any_orthonormal_pair();
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let corner = |(x, y): (f64, f64)| (foot + half * (x * s + y * t)).as_vec3();
        (self.normal, corners.map(corner))
    }

    /// The distance along the ray, in double precision.
    fn distance(&self, ray: &Ray) -> f64 {
        let o = self.to_local.transform_point3(ray.origin.as_dvec3());
        let d = self.to_local.transform_vector3(ray.direction.as_dvec3());
        -o.z / d.z
    }
}

impl Surface for Plane {
    fn primitive_count(&self) -> u32 {
        1
    }

    fn bounds(&self, _primitive: u32) -> Bounds {
        Bounds::EVERYTHING
    }

    fn intersect(&self, _primitive: u32, ray: &Ray) -> Option<(f32, f32, f32)> {
        let t = self.distance(ray) as f32;
        (t > 0.0 && t <= ray.t_max && t.is_finite()).then_some((t, 0.0, 0.0))
    }

    fn interaction(&self, ray: &Ray, hit: &Hit) -> Interaction<'_> {
        let met = ray.origin.as_dvec3() + self.distance(ray) * ray.direction.as_dvec3();
        let p = self.to_local.transform_point3(met).truncate();
        let position = self.to_world.transform_point3(p.extend(0.0));
        let [dp_du, dp_dv] = [
            self.to_world.matrix3.x_axis.as_vec3() * 2.0,
            self.to_world.matrix3.y_axis.as_vec3() * 2.0,
        ];
        let frame = Frame::along(self.normal, dp_du);
        Interaction {
            t: hit.t,
            position: position.as_vec3(),
            error: rounding(&self.to_world, p.extend(0.0), position),
            normal: self.normal,
            frame,
            uv: (0.5 * (p + 1.0)).as_vec2(),
            dp_du,
            dp_dv,
            footprint: [Vec2::ZERO; 2],
            wi: frame.to_local(-ray.direction),
            time: ray.time,
            shape: hit.shape,
            primitive: hit.primitive,
            mesh: None,
            barycentric: Vec2::ZERO,
        }
    }

    fn uv(&self, point: &SurfaceSample) -> Vec2 {
        let p = self.to_local.transform_point3(point.position.as_dvec3());
        (0.5 * (p.truncate() + 1.0)).as_vec2()
    }

    fn bytes(&self) -> usize {
        size_of::<Self>()
    }
}
