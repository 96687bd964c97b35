//! What `cylinder` and `cone` build: the side of a frustum, with flat ends or without. In its own space the side
//! is x² + y² = (1 + s·z)² for 0 ≤ z ≤ 1, with the slope s = 0 of a cylinder and −1 of a cone; `to_world` may
//! stretch and shear it. The quadratic is solved in double precision and about the point of the ray's line next
//! to the origin, so that its terms do not cancel however far away the ray begins.

use std::f64::consts::TAU;

use glam::{DAffine3, DMat4, DVec2, DVec3, Vec2, Vec3};

use super::disk::{Disk, turns};
use super::{
    Bounds, Chart, Geometry, Shape, Surface, SurfaceSample, area_to_solid_angle, rounding,
};
use crate::description::Properties;
use crate::error::Result;
use crate::interaction::{Hit, Interaction, Ray};
use crate::math::Frame;
use crate::math::distribution::Discrete;

/// A cylinder or a cone in world space. Primitive 0 is the side, the others are the ends.
#[derive(Debug)]
pub struct Frustum {
    to_world: DAffine3,
    to_local: DAffine3,
    /// By how much the radius, 1 at z = 0, has changed at z = 1.
    slope: f64,
    /// 1, or −1 where normals point inward.
    side: f64,
    ends: Vec<Disk>,
    /// Of the side and of each end.
    areas: Discrete,
}

/// What tells one plugin from another.
pub(super) struct Profile {
    pub(super) slope: f64,
    /// The heights of the ends that are closed: 0 and 1 or fewer.
    pub(super) closed: Vec<f64>,
}

/// Builds the frustum from `p0`, the centre of the end of the given `radius`, to `p1`, under `to_world`.
pub(super) fn build(
    properties: &Properties<'_>,
    to_world: &DMat4,
    profile: Profile,
) -> Result<Shape> {
    let plugin = properties.plugin();
    let (p0, p1) = (properties.vector("p0")?, properties.vector("p1")?);
    let radius = properties.float("radius")?;
    let Some(axis) = (p1 - p0).try_normalize() else {
        let message = format!("the ends of a {plugin} cannot be the same");
        return Err(properties.error("p1", message));
    };
    let s = Frame::around(axis.as_vec3()).s.as_dvec3();
    let t = axis.cross(s).normalize();
    let s = t.cross(axis);
    let placed = DAffine3::from_cols(radius * s, radius * t, p1 - p0, p0);
    let to_world = DAffine3::from_mat4(*to_world) * placed;
    let flip = properties.boolean("flip_normals")?;
    match Frustum::new(to_world, profile, flip) {
        Some(frustum) => Ok(Geometry::Frustum(frustum).into()),
        None => {
            let message = format!("the {plugin} has no finite, positive area");
            Err(properties.error("to_world", message))
        }
    }
}

impl Frustum {
    /// `None` where it has no finite, positive area.
    fn new(to_world: DAffine3, profile: Profile, flip: bool) -> Option<Self> {
        let Profile { slope, closed } = profile;
        let to_local = to_world.inverse();
        let ends = closed.into_iter().map(|z| {
            let radius = DVec3::new(1.0 + slope * z, 1.0 + slope * z, 1.0);
            let place = to_world * DAffine3::from_translation(z * DVec3::Z);
            Disk::new(place * DAffine3::from_scale(radius), flip != (z == 0.0))
        });
        let ends = ends.collect::<Option<Vec<_>>>()?;
        let mut frustum = Self {
            to_world,
            to_local,
            slope,
            side: if flip { -1.0 } else { 1.0 },
            ends,
            areas: Discrete::new([1.0])?,
        };
        let areas = frustum.ends.iter().map(Surface::area);
        let areas: Vec<f64> = std::iter::once(frustum.integrate_area())
            .chain(areas)
            .collect();
        let sound = areas.iter().all(|a| *a > 0.0 && a.is_finite()) && to_local.is_finite();
        frustum.areas = Discrete::new(areas)?;
        sound.then_some(frustum)
    }

    /// The radius at a height.
    fn radius(&self, z: f64) -> f64 {
        1.0 + self.slope * z
    }

    /// The mean radius.
    fn mean(&self) -> f64 {
        self.radius(0.5)
    }

    /// How the position changes with the angle (in radians, at radius 1) and with the height, at the unit
    /// vector `around`.
    fn tangents(&self, around: DVec2) -> [DVec3; 2] {
        let m = self.to_world.matrix3;
        [
            m.y_axis * around.x - m.x_axis * around.y,
            m * around.extend(0.0) * self.slope + m.z_axis,
        ]
    }

    /// Area in the world for a unit of angle and height at radius 1.
    fn stretch(&self, around: DVec2) -> f64 {
        let [along, up] = self.tangents(around);
        along.cross(up).length()
    }

    /// The mean of a periodic function at equal steps converges faster than any power of their number.
    fn integrate_area(&self) -> f64 {
        const STEPS: u32 = 256;
        let angle = |i| TAU * f64::from(i) / f64::from(STEPS);
        let sum: f64 = (0..STEPS)
            .map(|i| self.stretch(DVec2::from_angle(angle(i))))
            .sum();
        TAU * self.mean() * sum / f64::from(STEPS)
    }

    fn normal(&self, around: DVec2) -> Vec3 {
        let inverse_transpose = self.to_local.matrix3.transpose();
        (inverse_transpose * around.extend(-self.slope) * self.side)
            .normalize()
            .as_vec3()
    }

    /// Density per solid angle of a point of the side: uniform in angle, and over the heights in proportion to
    /// the radius.
    fn density(&self, from: Vec3, position: Vec3, around: DVec2, normal: Vec3) -> f32 {
        let area = TAU * self.mean() * self.stretch(around) / self.areas.probability(0);
        area_to_solid_angle(area, from, position, normal)
    }

    /// The side's point with these texture coordinates, and the direction from the axis to it.
    fn at(&self, uv: Vec2) -> (DVec2, SurfaceSample) {
        let around = DVec2::from_angle(TAU * f64::from(uv.x));
        let height = f64::from(uv.y);
        let local = (self.radius(height) * around).extend(height);
        let point = SurfaceSample {
            position: self.to_world.transform_point3(local).as_vec3(),
            normal: self.normal(around),
            primitive: 0,
            barycentric: Vec2::ZERO,
            pdf: 0.0,
        };
        (around, point)
    }

    /// The side's point next to a local one: around the axis, and the height.
    fn nearest(&self, local: DVec3) -> (DVec2, f64) {
        let around = local.truncate().normalize_or(DVec2::X);
        (around, local.z.clamp(0.0, 1.0))
    }

    /// Where the ray meets the side.
    fn distance(&self, ray: &Ray) -> Option<f64> {
        let origin = self.to_local.transform_point3(ray.origin.as_dvec3());
        let d = self.to_local.transform_vector3(ray.direction.as_dvec3());
        let near = -origin.dot(d) / d.length_squared();
        let o = origin + near * d;
        let (start, across) = (o.truncate(), d.truncate());
        let (radius, change) = (self.radius(o.z), self.slope * d.z);
        let a = across.length_squared() - change * change;
        let b = start.dot(across) - radius * change;
        let c = start.length_squared() - radius * radius;
        // NaN where the ray runs along a cylinder's axis.
        let root = (b * b - a * c).sqrt();
        let q = if b < 0.0 { root - b } else { -root - b };
        let (t0, t1) = (q / a, if q == 0.0 { q / a } else { c / q });
        [t0.min(t1), t0.max(t1)]
            .into_iter()
            .filter(|t| (0.0..=1.0).contains(&(o.z + d.z * t)))
            .map(|t| near + t)
            .find(|&t| t as f32 > 0.0 && t as f32 <= ray.t_max)
    }
}

/// The texture coordinates of the side.
fn unrolled(around: DVec2, height: f64) -> Vec2 {
    Vec2::new(turns(around.as_vec2()), height as f32)
}

impl Surface for Frustum {
    fn primitive_count(&self) -> u32 {
        1 + self.ends.len() as u32
    }

    fn bounds(&self, primitive: u32) -> Bounds {
        if let Some(end) = primitive.checked_sub(1) {
            return self.ends[end as usize].bounds(0);
        }
        let m = self.to_world.matrix3;
        let reach = (m.x_axis * m.x_axis + m.y_axis * m.y_axis).map(f64::sqrt);
        [0.0, 1.0].into_iter().fold(Bounds::EMPTY, |bounds, z| {
            let center = self.to_world.transform_point3(z * DVec3::Z);
            let reach = reach * self.radius(z);
            let error = rounding(&self.to_world, DVec3::ONE, center.abs() + reach);
            bounds
                .with((center - reach).as_vec3() - error)
                .with((center + reach).as_vec3() + error)
        })
    }

    fn intersect(&self, primitive: u32, ray: &Ray) -> Option<(f32, f32, f32)> {
        match primitive.checked_sub(1) {
            Some(end) => self.ends[end as usize].intersect(0, ray),
            None => self.distance(ray).map(|t| (t as f32, 0.0, 0.0)),
        }
    }

    fn interaction(&self, ray: &Ray, hit: &Hit) -> Interaction<'_> {
        if let Some(end) = hit.primitive.checked_sub(1) {
            return self.ends[end as usize].interaction(ray, hit);
        }
        let t = self.distance(ray).unwrap_or(f64::from(hit.t));
        let met = ray.origin.as_dvec3() + t * ray.direction.as_dvec3();
        let (around, height) = self.nearest(self.to_local.transform_point3(met));
        let radius = self.radius(height);
        let local = (radius * around).extend(height);
        let position = self.to_world.transform_point3(local);
        let normal = self.normal(around);
        let [along, up] = self.tangents(around);
        let dp_du = (TAU * radius * along).as_vec3();
        let frame = Frame::along(normal, dp_du);
        Interaction {
            t: hit.t,
            position: position.as_vec3(),
            error: rounding(&self.to_world, local, position),
            normal,
            frame,
            uv: unrolled(around, height),
            dp_du,
            dp_dv: up.as_vec3(),
            footprint: [Vec2::ZERO; 2],
            wi: frame.to_local(-ray.direction),
            time: ray.time,
            shape: hit.shape,
            primitive: 0,
            mesh: None,
            barycentric: Vec2::ZERO,
        }
    }

    fn area(&self) -> f64 {
        self.areas.total()
    }

    fn sample(&self, from: Vec3, u: Vec2) -> Option<SurfaceSample> {
        let drawn = self.areas.sample(u.x);
        let u = Vec2::new(drawn.rest, u.y);
        if let Some(end) = drawn.index.checked_sub(1) {
            let sample = self.ends[end].sample(from, u)?;
            return Some(SurfaceSample {
                primitive: drawn.index as u32,
                pdf: sample.pdf * drawn.probability as f32,
                ..sample
            });
        }
        // The share of the area below a height, inverted.
        let (s, v) = (self.slope, f64::from(u.y));
        let height = v * (2.0 + s) / (1.0 + (1.0 + v * s * (2.0 + s)).sqrt());
        let (around, point) = self.at(Vec2::new(u.x, height as f32));
        let pdf = self.density(from, point.position, around, point.normal);
        (pdf > 0.0).then_some(SurfaceSample { pdf, ..point })
    }

    fn uv(&self, point: &SurfaceSample) -> Vec2 {
        if let Some(end) = point.primitive.checked_sub(1) {
            return self.ends[end as usize].uv(point);
        }
        let local = self.to_local.transform_point3(point.position.as_dvec3());
        let (around, height) = self.nearest(local);
        unrolled(around, height)
    }

    /// By the side's texture coordinates; none where there are ends as well.
    fn chart(&self, parameters: Vec2) -> Option<Chart> {
        (self.ends.is_empty())
            .then(|| self.patch(0, parameters))
            .flatten()
    }

    /// By texture coordinates, of the side and of the ends.
    fn patch(&self, primitive: u32, parameters: Vec2) -> Option<Chart> {
        if let Some(end) = primitive.checked_sub(1) {
            return self.ends.get(end as usize)?.chart(parameters);
        }
        let (around, point) = self.at(parameters);
        let stretch = TAU * self.radius(parameters.y.into()) * self.stretch(around);
        Some(Chart { point, stretch })
    }

    fn pdf(&self, from: Vec3, at: &Interaction<'_>) -> f32 {
        if let Some(end) = at.primitive.checked_sub(1) {
            let probability = self.areas.probability(at.primitive as usize);
            return self.ends[end as usize].pdf(from, at) * probability as f32;
        }
        let local = self.to_local.transform_point3(at.position.as_dvec3());
        let (around, _) = self.nearest(local);
        self.density(from, at.position, around, at.normal)
    }

    fn bytes(&self) -> usize {
        size_of::<Self>() + self.ends.len() * size_of::<Disk>()
    }
}
