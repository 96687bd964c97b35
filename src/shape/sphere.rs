//! `sphere`: centre, radius and `to_world` (rotation and uniform scale; one that stretches warns, and scales as its x
//! axis does). Texture coordinates are
//! (φ/2π, θ/π) about the local z axis. The quadratic is solved in double precision, so that small and
//! distant spheres keep their shape. Seen from outside, light samples are uniform over the cone that the
//! sphere fills (Shirley, Wang and Zimmerman, *Monte Carlo techniques for direct lighting*, 1996).

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use glam::{DMat4, DVec3, Mat3, Vec2, Vec3};

use super::{
    Bounds, Chart, Geometry, Shape, Surface, SurfacePoints, SurfaceSample, SurfaceSamples,
    area_to_solid_angle, area_to_solid_angles,
};
use crate::description::Properties;
use crate::description::declared::{Plugin, float, vector};
use crate::error::Result;
use crate::interaction::{Hit, Interaction, Ray, offset};
use crate::lanes::{self, Doubles as _, Lanes, Mask as _, warp};
use crate::math::Frame;

/// A sphere in world space.
#[derive(Debug)]
pub struct Sphere {
    center: Vec3,
    radius: f32,
    /// From local to world directions; orthonormal, mirrored where `to_world` mirrors.
    rotation: Mat3,
    /// Normals point inward.
    flip_normals: bool,
}

pub(super) const PLUGIN: Plugin = Plugin {
    about: "a sphere",
    properties: &[
        super::COMMON,
        &[
            vector("center", [0.0; 3], "its centre"),
            float(
                "radius",
                1.0,
                "scene units, not 0; below 0 turns the sphere inside out",
            ),
            super::FLIP_NORMALS,
        ],
    ],
};

pub(super) fn build(properties: &Properties<'_>, to_world: &DMat4) -> Result<Shape> {
    let center = properties.vector("center")?;
    let radius = properties.float("radius")?;
    // A negative radius is a scale: it mirrors.
    let axes = [to_world.x_axis, to_world.y_axis, to_world.z_axis]
        .map(|axis| radius.signum() * axis.truncate());
    // Mitsuba's radius, whatever the other axes are.
    let scale = axes[0].length();
    let uneven = axes.iter().any(|a| (a.length() / scale - 1.0).abs() > 1e-4)
        || (0..3).any(|i| axes[i].dot(axes[(i + 1) % 3]).abs() > 1e-4 * scale * scale);
    let (center, radius) = (
        to_world.transform_point3(center).as_vec3(),
        (radius.abs() * scale) as f32,
    );
    if !(radius > 0.0 && radius.is_finite() && center.is_finite()) {
        return Err(properties.error("radius", "a sphere needs a finite radius other than 0"));
    }
    let turned = if uneven {
        right_angled(axes)
    } else {
        axes.map(|a| a / scale)
    };
    let [x, y, z] = turned.map(|a| a.as_vec3());
    // As in Mitsuba, a mirroring transform turns a sphere's normals over, and no other shape's here.
    let mirrored = axes[0].cross(axes[1]).dot(axes[2]) < 0.0;
    let flip_normals = properties.boolean("flip_normals")? != mirrored;
    let sphere = Sphere {
        center,
        radius,
        rotation: Mat3::from_cols(x, y, z),
        flip_normals,
    };
    let mut shape = Shape::from(Geometry::Sphere(sphere));
    if uneven {
        let message = format!(
            "a sphere cannot be stretched or sheared: it stays one, of radius {radius} as along the x axis, as in Mitsuba"
        );
        let warning = properties.error("to_world", message);
        let warning = warning.help("scale all axes alike");
        shape.warnings.extend_from_slice(warning.problems());
    }
    Ok(shape)
}

/// The nearest that axes of any lengths and angles come to three at right angles: the first stays, and the hands do.
fn right_angled([x, y, z]: [DVec3; 3]) -> [DVec3; 3] {
    let x = x.normalize();
    let across = |a: DVec3| (a - a.dot(x) * x).try_normalize();
    let y = across(y)
        .or_else(|| across(z).map(|z| z.cross(x)))
        .unwrap_or_else(|| x.any_orthonormal_vector());
    let right = x.cross(y);
    [x, y, if right.dot(z) < 0.0 { -right } else { right }]
}

impl Sphere {
    /// The square of the sine of the half angle under which a point sees the sphere; `None` from inside.
    fn cone(&self, from: Vec3) -> Option<f64> {
        let squared = (self.center.as_dvec3() - from.as_dvec3()).length_squared();
        let sin2 = f64::from(self.radius).powi(2) / squared;
        (sin2 < f64::from(WIDEST)).then_some(sin2)
    }

    /// 1 − cos of that angle, without the cancellation.
    fn drop(sin2: f64) -> f64 {
        sin2 / (1.0 + (1.0 - sin2).sqrt())
    }

    fn side(&self) -> f32 {
        if self.flip_normals { -1.0 } else { 1.0 }
    }

    /// The point in that direction from the centre, without a density.
    fn at(&self, outward: Vec3) -> SurfaceSample {
        SurfaceSample {
            position: self.center + self.radius * outward,
            normal: self.side() * outward,
            primitive: 0,
            barycentric: Vec2::ZERO,
            pdf: 0.0,
        }
    }

    /// Texture coordinates, by the direction from the centre in the sphere's own space.
    #[inline(always)]
    fn angles<F: Lanes>(local: lanes::Vec3<F>) -> lanes::Vec2<F> {
        let (turn, phi) = (F::splat(TAU), lanes::atan2(local.y, local.x));
        let phi = F::select(phi.lt(F::zero()), phi + turn, phi);
        let theta = lanes::acos(local.z);
        lanes::Vec2::new(phi / turn, theta * F::splat(FRAC_1_PI))
    }

    /// A direction in the sphere's own space.
    #[inline(always)]
    fn to_local<F: Lanes>(&self, outward: lanes::Vec3<F>) -> lanes::Vec3<F> {
        let axes = &self.rotation;
        lanes::Vec3::new(
            lanes::Vec3::all(axes.x_axis).dot(outward),
            lanes::Vec3::all(axes.y_axis).dot(outward),
            lanes::Vec3::all(axes.z_axis).dot(outward),
        )
    }

    /// A direction in the sphere's own space, a radius long, in the world.
    #[inline(always)]
    fn scaled<F: Lanes>(&self, local: lanes::Vec3<F>) -> lanes::Vec3<F> {
        let axes = self.rotation * self.radius;
        lanes::Vec3::all(axes.x_axis) * local.x
            + lanes::Vec3::all(axes.y_axis) * local.y
            + lanes::Vec3::all(axes.z_axis) * local.z
    }
}

impl Sphere {
    /// How far along rays the first hit is that is not beyond `t_max`; not a number where there is none.
    #[inline(always)]
    pub(crate) fn meet<F: Lanes>(
        &self,
        origin: lanes::Vec3<F>,
        direction: lanes::Vec3<F>,
        t_max: F,
    ) -> F {
        let (none, center) = (F::Double::splat(0.0), self.center.as_dvec3());
        let ox = origin.x.widen() - F::Double::splat(center.x);
        let oy = origin.y.widen() - F::Double::splat(center.y);
        let oz = origin.z.widen() - F::Double::splat(center.z);
        let dx = direction.x.widen();
        let dy = direction.y.widen();
        let dz = direction.z.widen();
        let (a, b) = (dx * dx + dy * dy + dz * dz, ox * dx + oy * dy + oz * dz);
        let r2 = F::Double::splat(f64::from(self.radius).powi(2));
        // The distance of the line from the centre, without the cancellation of b² − ac.
        let nearest = b / a;
        let (nx, ny, nz) = (ox - dx * nearest, oy - dy * nearest, oz - dz * nearest);
        let discriminant = a * (r2 - (nx * nx + ny * ny + nz * nz));
        let meets = !discriminant.lt(none);
        if !meets.any() {
            return F::splat(f32::NAN);
        }
        let root = discriminant.sqrt();
        let q = F::Double::select(b.lt(none), root, -root) - b;
        let c = ox * ox + oy * oy + oz * oz - r2;
        let t0 = q / a;
        let t1 = F::Double::select(q.lt(none) | none.lt(q), c / q, t0);
        let (near, far) = (t0.min(t1).narrow(), t0.max(t1).narrow());
        let t = F::select(F::zero().lt(near), near, far);
        let meets = meets & F::zero().lt(t) & t.le(t_max);
        F::select(meets, t, F::splat(f32::NAN))
    }

    /// The points of hits, which are about at these places.
    #[inline(always)]
    pub(crate) fn points<F: Lanes>(&self, places: lanes::Vec3<F>) -> SurfacePoints<F> {
        let center = lanes::Vec3::<F>::all(self.center);
        let radius = F::splat(self.radius);
        let outward = ((places - center) / radius).normalize();
        let normal = outward * F::splat(self.side());
        let local = self.to_local(outward);
        let rim = (local.x * local.x + local.y * local.y).sqrt();
        // At the poles u goes nowhere, and v goes anywhere.
        let pole = rim.eq(F::zero());
        let cos = F::select(pole, F::one(), local.x / rim);
        let sin = F::select(pole, F::zero(), local.y / rim);
        let around = lanes::Vec3::new(-local.y, local.x, F::zero());
        let down = lanes::Vec3::new(local.z * cos, local.z * sin, -rim);
        let dp_du = self.scaled(around * F::splat(TAU));
        SurfacePoints {
            position: center + outward * radius,
            error: (center.abs() + outward.abs() * radius) * F::splat(offset::gamma(5)),
            normal,
            frame: lanes::Frame::along(normal, dp_du),
            uv: Self::angles(local),
            dp_du,
            dp_dv: self.scaled(down * F::splat(PI)),
        }
    }

    /// [`Surface::sample`] in lanes.
    #[inline(always)]
    pub(super) fn sample_lanes<F: Lanes>(
        &self,
        from: lanes::Vec3<F>,
        u: lanes::Vec2<F>,
        active: F::Mask,
    ) -> SurfaceSamples<F> {
        let (zero, one) = (F::zero(), F::one());
        let center = lanes::Vec3::all(self.center);
        let way = center - from;
        let squared = way.length_squared();
        let widest = F::splat(self.radius * self.radius) / squared;
        let outside = widest.lt(F::splat(WIDEST));
        let whole = widest / (one + (one - widest).max(zero).sqrt());
        let drop = u.x * whole;
        let sin2 = drop * (one + one - drop);
        let cos_alpha =
            sin2 / widest.sqrt() + (one - drop) * (one - sin2 / widest).max(zero).sqrt();
        let sin_alpha = (one - cos_alpha * cos_alpha).max(zero).sqrt();
        let (sin, cos) = lanes::sin_cos_turns(u.y);
        let frame = lanes::Frame::around(way * (one / squared.sqrt()));
        let local = lanes::Vec3::new(sin_alpha * cos, sin_alpha * sin, -cos_alpha);
        let mut outward = frame.to_world(local).normalize();
        let mut pdf = warp::uniform_cone_pdf(whole);
        if (active & !outside).any() {
            let other = warp::uniform_sphere(u);
            outward = lanes::Vec3::select(outside, outward, other);
            let position = center + other * F::splat(self.radius);
            let by_area = area_to_solid_angles(self.area(), from, position, other);
            pdf = F::select(outside, pdf, by_area);
        }
        let drawn = active & zero.lt(pdf) & pdf.is_finite();
        SurfaceSamples {
            position: center + outward * F::splat(self.radius),
            normal: outward * F::splat(self.side()),
            pdf: F::select(drawn, pdf, zero),
        }
    }
}

/// From where the square of the sine of the half angle is this, the sphere is sampled by area: the cone's map has no
/// precision left.
const WIDEST: f32 = 0.9999;

impl Surface for Sphere {
    fn primitive_count(&self) -> u32 {
        1
    }

    fn bounds(&self, _primitive: u32) -> Bounds {
        let reach = Vec3::splat(self.radius) + (self.center.abs() + self.radius) * offset::gamma(5);
        Bounds {
            min: self.center - reach,
            max: self.center + reach,
        }
    }

    fn intersect(&self, _primitive: u32, ray: &Ray) -> Option<(f32, f32, f32)> {
        let t = self.meet::<f32>(ray.origin.into(), ray.direction.into(), ray.t_max);
        (!t.is_nan()).then_some((t, 0.0, 0.0))
    }

    fn interaction(&self, ray: &Ray, hit: &Hit) -> Interaction<'_> {
        let met = ray.at(hit.t);
        self.points::<f32>(met.into()).interaction(None, ray, hit)
    }

    fn area(&self) -> f64 {
        4.0 * std::f64::consts::PI * f64::from(self.radius).powi(2)
    }

    fn sample(&self, from: Vec3, u: Vec2) -> Option<SurfaceSample> {
        let Some(widest) = self.cone(from) else {
            let outward = Vec3::from(warp::uniform_sphere(u.into()));
            let sample = self.at(outward);
            let pdf = area_to_solid_angle(self.area(), from, sample.position, outward);
            return (pdf > 0.0).then_some(SurfaceSample { pdf, ..sample });
        };
        // A direction at an angle θ from the axis meets the sphere where, at its centre, the angle to the eye
        // is α; in double precision, for both angles may be tiny (PBRT 4th ed., 6.2.4).
        let drop = f64::from(u.x) * Self::drop(widest);
        let sin2 = drop * (2.0 - drop);
        let cos_alpha = sin2 / widest.sqrt() + (1.0 - drop) * (1.0 - sin2 / widest).max(0.0).sqrt();
        let sin_alpha = (1.0 - cos_alpha * cos_alpha).max(0.0).sqrt();
        let (sin, cos) = (TAU * u.y).sin_cos();
        let sin_alpha = sin_alpha as f32;
        let frame = Frame::around((self.center - from).normalize());
        let outward = frame
            .to_world(Vec3::new(
                sin_alpha * cos,
                sin_alpha * sin,
                -cos_alpha as f32,
            ))
            .normalize();
        Some(SurfaceSample {
            pdf: warp::uniform_cone_pdf(Self::drop(widest) as f32),
            ..self.at(outward)
        })
    }

    fn uv(&self, point: &SurfaceSample) -> Vec2 {
        let outward = self.side() * point.normal;
        Self::angles(self.to_local::<f32>(outward.into())).into()
    }

    fn pdf(&self, from: Vec3, at: &Interaction<'_>) -> f32 {
        match self.cone(from) {
            Some(widest) => warp::uniform_cone_pdf(Self::drop(widest) as f32),
            None => area_to_solid_angle(self.area(), from, at.position, at.normal),
        }
    }

    /// By texture coordinates.
    fn chart(&self, parameters: Vec2) -> Option<Chart> {
        let (sin_phi, cos_phi) = (TAU * parameters.x).sin_cos();
        let (sin, cos) = (PI * parameters.y).sin_cos();
        let outward = self.rotation * Vec3::new(sin * cos_phi, sin * sin_phi, cos);
        Some(Chart {
            point: self.at(outward),
            stretch: f64::from(TAU * PI * sin.abs()) * f64::from(self.radius).powi(2),
        })
    }

    fn bytes(&self) -> usize {
        size_of::<Self>()
    }
}
