//! `disk`: the unit disk at z = 0 facing +z, under `to_world` (which may make it an ellipse) and
//! `flip_normals`, with texture coordinates (r, φ/2π).

use std::f32::consts::TAU;

use glam::{DAffine3, DMat4, Vec2, Vec3};

use super::{Bounds, Chart, Geometry, Shape, Surface, SurfaceSample, area_to_solid_angle};
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::interaction::{Hit, Interaction, Ray, offset};
use crate::lanes::warp;
use crate::math::Frame;

/// A disk in world space. A hit's parameters are its local x and y.
#[derive(Debug)]
pub struct Disk {
    center: Vec3,
    /// Images of the local x and y axis.
    axes: [Vec3; 2],
    normal: Vec3,
    to_local: DAffine3,
    area: f64,
}

pub(super) const PLUGIN: Plugin = Plugin {
    about: "the unit disk at z = 0, facing +z",
    properties: &[super::COMMON, &[super::FLIP_NORMALS]],
};

pub(super) fn build(properties: &Properties<'_>, to_world: &DMat4) -> Result<Shape> {
    let to_world = DAffine3::from_mat4(*to_world);
    let flip = properties.boolean("flip_normals")?;
    match Disk::new(to_world, flip) {
        Some(disk) => Ok(Geometry::Disk(disk).into()),
        None => Err(properties.error("to_world", "the disk has no finite, positive area")),
    }
}

impl Disk {
    /// `None` where it has no finite, positive area.
    pub(super) fn new(to_world: DAffine3, flip: bool) -> Option<Self> {
        let to_local = to_world.inverse();
        let [x, y] = [to_world.matrix3.x_axis, to_world.matrix3.y_axis];
        // By the inverse transpose, whose rows are the columns here.
        let normal = to_local.matrix3.row(2).normalize() * if flip { -1.0 } else { 1.0 };
        let area = std::f64::consts::PI * x.cross(y).length();
        (area > 0.0 && area.is_finite() && to_local.is_finite()).then(|| Self {
            center: to_world.translation.as_vec3(),
            axes: [x.as_vec3(), y.as_vec3()],
            normal: normal.as_vec3(),
            to_local,
            area,
        })
    }

    fn position(&self, p: Vec2) -> Vec3 {
        self.center + self.axes[0] * p.x + self.axes[1] * p.y
    }

    /// The point there, without a density.
    fn at(&self, p: Vec2) -> SurfaceSample {
        SurfaceSample {
            position: self.position(p),
            normal: self.normal,
            primitive: 0,
            barycentric: p,
            pdf: 0.0,
        }
    }

    fn polar(p: Vec2) -> Vec2 {
        Vec2::new(p.length(), turns(p))
    }

    fn error(&self) -> Vec3 {
        (self.center.abs() + self.axes[0].abs() + self.axes[1].abs()) * offset::gamma(5)
    }
}

/// The angle of `p` around the origin, in [0, 1].
pub(super) fn turns(p: Vec2) -> f32 {
    let phi = p.y.atan2(p.x) / TAU;
    if phi < 0.0 { phi + 1.0 } else { phi }
}

impl Surface for Disk {
    fn primitive_count(&self) -> u32 {
        1
    }

    fn bounds(&self, _primitive: u32) -> Bounds {
        let [x, y] = self.axes;
        let reach = (x * x + y * y).map(f32::sqrt) + self.error();
        Bounds {
            min: self.center - reach,
            max: self.center + reach,
        }
    }

    fn intersect(&self, _primitive: u32, ray: &Ray) -> Option<(f32, f32, f32)> {
        let o = self.to_local.transform_point3(ray.origin.as_dvec3());
        let d = self.to_local.transform_vector3(ray.direction.as_dvec3());
        let t = -o.z / d.z;
        let p = (o + d * t).truncate();
        let far = t as f32;
        (far > 0.0 && far <= ray.t_max && p.length_squared() <= 1.0)
            .then_some((far, p.x as f32, p.y as f32))
    }

    fn interaction(&self, ray: &Ray, hit: &Hit) -> Interaction<'_> {
        let p = Vec2::new(hit.u, hit.v);
        let out = p.normalize_or(Vec2::X);
        let [x, y] = self.axes;
        let dp_du = x * out.x + y * out.y;
        let frame = Frame::along(self.normal, dp_du);
        Interaction {
            t: hit.t,
            position: self.position(p),
            error: self.error(),
            normal: self.normal,
            frame,
            uv: Self::polar(p),
            dp_du,
            dp_dv: TAU * (y * p.x - x * p.y),
            footprint: [Vec2::ZERO; 2],
            wi: frame.to_local(-ray.direction),
            time: ray.time,
            shape: hit.shape,
            primitive: hit.primitive,
            mesh: None,
            barycentric: Vec2::ZERO,
        }
    }

    fn area(&self) -> f64 {
        self.area
    }

    fn sample(&self, from: Vec3, u: Vec2) -> Option<SurfaceSample> {
        let p = Vec2::from(warp::concentric_disk(u.into()));
        let sample = self.at(p);
        let pdf = area_to_solid_angle(self.area, from, sample.position, self.normal);
        (pdf > 0.0).then_some(SurfaceSample { pdf, ..sample })
    }

    fn uv(&self, point: &SurfaceSample) -> Vec2 {
        let local = self.to_local.transform_point3(point.position.as_dvec3());
        Self::polar(local.truncate().as_vec2())
    }

    fn pdf(&self, from: Vec3, at: &Interaction<'_>) -> f32 {
        area_to_solid_angle(self.area, from, at.position, at.normal)
    }

    /// By texture coordinates.
    fn chart(&self, parameters: Vec2) -> Option<Chart> {
        let p = parameters.x * Vec2::from_angle(TAU * parameters.y);
        Some(Chart {
            point: self.at(p),
            stretch: 2.0 * f64::from(parameters.x) * self.area,
        })
    }

    fn bytes(&self) -> usize {
        size_of::<Self>()
    }
}
