//! `cylinder`: around the segment from `p0` (the origin) to `p1` (0, 0, 1) with `radius` 1 and without caps,
//! under `to_world` (which may make it elliptic) and `flip_normals`. Texture coordinates are the angle
//! φ/2π and the height from 0 at `p0` to 1 at `p1`. The quadratic is solved in double precision.

use std::f32::consts::TAU;

use glam::{DAffine3, DVec2, DVec3, Vec2, Vec3};

use super::disk::turns;
use super::{
    Bounds, Chart, Geometry, Shape, Surface, SurfaceSample, area_to_solid_angle, to_world,
};
use crate::description::Properties;
use crate::error::Result;
use crate::interaction::{Hit, Interaction, Ray};
use crate::math::{Frame, offset};

/// The image of the unit cylinder (radius 1, z from 0 to 1) in world space.
#[derive(Debug)]
pub struct Cylinder {
    to_world: DAffine3,
    to_local: DAffine3,
    /// Normals point inward.
    flip_normals: bool,
    area: f64,
}

pub(super) fn build(properties: &Properties<'_>) -> Result<Shape> {
    let end = |name, default| Ok(properties.vector(name)?.unwrap_or(default));
    let (p0, p1) = (end("p0", DVec3::ZERO)?, end("p1", DVec3::Z)?);
    let radius = properties.float("radius")?.unwrap_or(1.0);
    if radius <= 0.0 {
        return Err(properties.error("radius", "a cylinder needs a positive radius"));
    }
    let Some(axis) = (p1 - p0).try_normalize() else {
        return Err(properties.error("p1", "the ends of a cylinder cannot be the same"));
    };
    let s = Frame::around(axis.as_vec3()).s.as_dvec3();
    let t = axis.cross(s).normalize();
    let s = t.cross(axis);
    let placed = DAffine3::from_cols(radius * s, radius * t, p1 - p0, p0);
    let to_world = DAffine3::from_mat4(to_world(properties)?) * placed;
    let to_local = to_world.inverse();
    let mut cylinder = Cylinder {
        to_world,
        to_local,
        flip_normals: properties.boolean("flip_normals")?.unwrap_or(false),
        area: 0.0,
    };
    cylinder.area = cylinder.integrate_area();
    if !(cylinder.area > 0.0 && cylinder.area.is_finite() && to_local.is_finite()) {
        return Err(properties.error("to_world", "the cylinder has no finite, positive area"));
    }
    Ok(Geometry::Cylinder(cylinder).into())
}

impl Cylinder {
    /// Area in the world for an area on the unit cylinder, at the unit vector `around`.
    fn stretch(&self, around: DVec2) -> f64 {
        let m = self.to_world.matrix3;
        let along = m.y_axis * around.x - m.x_axis * around.y;
        along.cross(m.z_axis).length()
    }

    /// The mean of a periodic function at equal steps converges faster than any power of their number.
    fn integrate_area(&self) -> f64 {
        const STEPS: u32 = 256;
        let angle = |i| std::f64::consts::TAU * f64::from(i) / f64::from(STEPS);
        let sum: f64 = (0..STEPS)
            .map(|i| self.stretch(DVec2::from_angle(angle(i))))
            .sum();
        std::f64::consts::TAU * sum / f64::from(STEPS)
    }

    fn normal(&self, around: DVec2) -> Vec3 {
        let side = if self.flip_normals { -1.0 } else { 1.0 };
        let inverse_transpose = self.to_local.matrix3.transpose();
        (inverse_transpose * around.extend(0.0) * side)
            .normalize()
            .as_vec3()
    }

    fn error(&self) -> Vec3 {
        let m = self.to_world.matrix3;
        let largest = m.x_axis.abs() + m.y_axis.abs() + m.z_axis.abs();
        (largest + self.to_world.translation.abs()).as_vec3() * offset::gamma(3)
    }

    /// The place with these texture coordinates.
    fn at(&self, uv: Vec2) -> Chart {
        let around = DVec2::from_angle(f64::from(TAU * uv.x));
        let local = around.extend(f64::from(uv.y));
        let point = SurfaceSample {
            position: self.to_world.transform_point3(local).as_vec3(),
            normal: self.normal(around),
            uv,
            primitive: 0,
            barycentric: Vec2::ZERO,
            pdf: 0.0,
        };
        Chart {
            point,
            stretch: std::f64::consts::TAU * self.stretch(around),
        }
    }

    /// The unit cylinder's point next to a world position: around the axis, and the height.
    fn local(&self, position: DVec3) -> (DVec2, f64) {
        let p = self.to_local.transform_point3(position);
        (p.truncate().normalize_or(DVec2::X), p.z.clamp(0.0, 1.0))
    }
}

impl Surface for Cylinder {
    fn primitive_count(&self) -> u32 {
        1
    }

    fn bounds(&self, _primitive: u32) -> Bounds {
        let m = self.to_world.matrix3;
        let reach = (m.x_axis * m.x_axis + m.y_axis * m.y_axis).map(f64::sqrt);
        let ends = [DVec3::ZERO, m.z_axis].map(|z| self.to_world.translation + z);
        let (min, max) = (ends[0].min(ends[1]) - reach, ends[0].max(ends[1]) + reach);
        Bounds {
            min: min.as_vec3() - self.error(),
            max: max.as_vec3() + self.error(),
        }
    }

    fn intersect(&self, _primitive: u32, ray: &Ray) -> Option<(f32, f32, f32)> {
        let o = self.to_local.transform_point3(ray.origin.as_dvec3());
        let d = self.to_local.transform_vector3(ray.direction.as_dvec3());
        let (across, start) = (d.truncate(), o.truncate());
        let (a, b) = (across.length_squared(), start.dot(across));
        // The distance of the line from the axis, without the cancellation of b² − ac.
        let nearest = start - across * (b / a);
        let discriminant = a * (1.0 - nearest.length_squared());
        // Along the axis it is NaN.
        if discriminant.is_nan() || discriminant < 0.0 {
            return None;
        }
        let root = discriminant.sqrt();
        let q = if b < 0.0 { root - b } else { -root - b };
        let c = start.length_squared() - 1.0;
        let (t0, t1) = (q / a, if q == 0.0 { q / a } else { c / q });
        [t0.min(t1), t0.max(t1)]
            .into_iter()
            .filter(|t| (0.0..=1.0).contains(&(o.z + d.z * t)))
            .map(|t| t as f32)
            .find(|&t| t > 0.0 && t <= ray.t_max)
            .map(|t| (t, 0.0, 0.0))
    }

    fn interaction(&self, ray: &Ray, hit: &Hit) -> Interaction<'_> {
        let met = ray.origin.as_dvec3() + f64::from(hit.t) * ray.direction.as_dvec3();
        let (around, height) = self.local(met);
        let position = self.to_world.transform_point3(around.extend(height));
        let normal = self.normal(around);
        let m = self.to_world.matrix3;
        let dp_du = (m.y_axis * around.x - m.x_axis * around.y).as_vec3() * TAU;
        let frame = Frame::along(normal, dp_du);
        Interaction {
            t: hit.t,
            position: position.as_vec3(),
            error: self.error(),
            normal,
            frame,
            uv: Vec2::new(turns(around.as_vec2()), height as f32),
            dp_du,
            dp_dv: m.z_axis.as_vec3(),
            wi: frame.to_local(-ray.direction),
            time: ray.time,
            shape: hit.shape,
            primitive: 0,
            mesh: None,
            barycentric: Vec2::ZERO,
        }
    }

    fn area(&self) -> f64 {
        self.area
    }

    fn sample(&self, from: Vec3, u: Vec2) -> Option<SurfaceSample> {
        let Chart { point, stretch } = self.at(u);
        let pdf = area_to_solid_angle(stretch, from, point.position, point.normal);
        (pdf > 0.0).then_some(SurfaceSample { pdf, ..point })
    }

    /// By texture coordinates.
    fn chart(&self, parameters: Vec2) -> Option<Chart> {
        Some(self.at(parameters))
    }

    fn pdf(&self, from: Vec3, at: &Interaction<'_>) -> f32 {
        let (around, _) = self.local(at.position.as_dvec3());
        // Drawn uniformly in angle and height.
        let area = std::f64::consts::TAU * self.stretch(around);
        area_to_solid_angle(area, from, at.position, at.normal)
    }

    fn bytes(&self) -> usize {
        size_of::<Self>()
    }
}
