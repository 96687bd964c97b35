//! `ellipsoids` and `ellipsoidsmesh`: ellipsoids from the PLY file `filename`, such as a cloud of Gaussians, each `extent`
//! times as large as its half axes say; the second stands for each by a hull of triangles, its `shell`. Only outsides are
//! met. `to_world` turns and moves them, and scales all axes alike, as in Mitsuba.

mod read;
mod shell;

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3, Vec2, Vec3};

use super::{Bounds, Geometry, Shape, Surface};
use crate::description::Properties;
use crate::description::declared::{Plugin, Row, boolean, choice, file, float};
use crate::error::Result;
use crate::interaction::{Hit, Interaction, Ray, offset};
use crate::math::Frame;
use shell::Shell;

/// Ellipsoids in world space, a primitive each.
#[derive(Debug)]
pub struct Ellipsoids {
    ellipsoids: Vec<Ellipsoid>,
    /// What each is taken for, if not for itself.
    shell: Option<Shell>,
}

/// One ellipsoid.
#[derive(Clone, Copy, Debug)]
struct Ellipsoid {
    center: DVec3,
    /// Half axes; above 0.
    axes: DVec3,
    /// From its own axes to the world.
    rotation: DQuat,
}

const FILE: &[Row] = &[
    file("filename", "a PLY file with centres, scales and rotations"),
    float("scale_factor", 1.0, "factor on the half axes").positive(),
    float(
        "extent",
        3.0,
        "another factor: how far what they stand for reaches",
    )
    .positive(),
    boolean(
        "extent_adaptive_clamping",
        false,
        "whether those that are less opaque reach less far",
    ),
];

pub(super) const PLUGIN: Plugin = Plugin {
    about: "ellipsoids, such as a cloud of Gaussians",
    properties: &[super::COMMON, FILE],
};

pub(super) const MESH_PLUGIN: Plugin = Plugin {
    about: "ellipsoids as hulls of triangles",
    properties: &[
        super::COMMON,
        FILE,
        &[choice(
            "shell",
            &["default", "ico_sphere", "uv_sphere", "box"],
            "the hull: 20 triangles by default",
        )],
    ],
};

pub(super) fn build(properties: &Properties<'_>, to_world: &DMat4) -> Result<Shape> {
    load(properties, to_world, None)
}

pub(super) fn build_mesh(properties: &Properties<'_>, to_world: &DMat4) -> Result<Shape> {
    let shell = Shell::named(properties.choice("shell")?);
    load(properties, to_world, Some(shell))
}

/// What is least opaque reaches nowhere.
const FAINTEST: f64 = 0.01;

fn load(properties: &Properties<'_>, to_world: &DMat4, shell: Option<Shell>) -> Result<Shape> {
    let path = properties.file("filename")?;
    let read = read::read(&path, properties.budget());
    let read = read.map_err(|e| e.named_at(properties.location()))?;
    let to_world = DAffine3::from_mat4(*to_world);
    let Some((turned, scaled, uneven)) = parts(to_world.matrix3) else {
        let message = "the transform of ellipsoids must be finite and invertible";
        return Err(properties.error("to_world", message));
    };
    let scale = scaled * properties.float("scale_factor")?;
    let extent = properties.float("extent")?;
    let adaptive = properties.boolean("extent_adaptive_clamping")?;
    let transparent = read.iter().any(|(_, opacity)| opacity.is_some());
    let ellipsoids = read.into_iter().map(|(ellipsoid, opacity)| {
        let reach = match opacity.filter(|_| adaptive) {
            Some(opacity) => (2.0 * (opacity / FAINTEST).ln()).max(0.0).sqrt() / 3.0,
            None => 1.0,
        };
        Ellipsoid {
            center: to_world.transform_point3(ellipsoid.center),
            axes: ellipsoid.axes * scale * (extent * reach),
            rotation: (turned * ellipsoid.rotation).normalize(),
        }
    });
    // Those that reach nowhere are not there.
    let ellipsoids: Vec<_> = ellipsoids.filter(|e| e.axes.min_element() > 0.0).collect();
    if !ellipsoids.iter().all(Ellipsoid::is_finite) {
        return Err(properties.error("filename", "an ellipsoid is too large or too far away"));
    }
    let mut shape = Shape::from(Geometry::Ellipsoids(Ellipsoids { ellipsoids, shell }));
    let mut warn = |name: &str, message: &str| {
        let warning = properties.error(name, message);
        shape.warnings.extend_from_slice(warning.problems());
    };
    if uneven {
        warn(
            "to_world",
            "ellipsoids cannot be stretched, sheared or mirrored: they are scaled by the mean of the three axes, as in Mitsuba",
        );
    }
    if adaptive && !transparent {
        warn(
            "extent_adaptive_clamping",
            "the file has no opacities: all ellipsoids reach as far",
        );
    }
    Ok(shape)
}

/// A matrix as a rotation and the mean of what stretches before it, and whether that is uneven: the polar decomposition
/// (Higham, *Computing the polar decomposition, with applications*, 1986).
fn parts(matrix: DMat3) -> Option<(DQuat, f64, bool)> {
    let mut turned = matrix;
    for _ in 0..40 {
        turned = 0.5 * (turned + turned.inverse().transpose());
    }
    if !turned.is_finite() || turned.determinant() == 0.0 {
        return None;
    }
    let turned = if turned.determinant() < 0.0 {
        -turned
    } else {
        turned
    };
    let stretch = turned.transpose() * matrix;
    let mean = (stretch.x_axis.x + stretch.y_axis.y + stretch.z_axis.z) / 3.0;
    let uneven = !stretch.abs_diff_eq(DMat3::IDENTITY * mean, 1e-4 * mean.abs()) || mean < 0.0;
    Some((DQuat::from_mat3(&turned), mean.abs(), uneven))
}

impl Ellipsoid {
    fn is_finite(&self) -> bool {
        let sound = |v: DVec3| v.as_vec3().is_finite();
        sound(self.center) && sound(self.axes) && self.rotation.is_finite()
    }

    /// A ray as the unit ball sees it; t keeps its meaning.
    #[inline]
    fn seen_by(self, ray: &Ray) -> (DVec3, DVec3) {
        let back = self.rotation.conjugate();
        let o = back * (ray.origin.as_dvec3() - self.center) / self.axes;
        (o, back * ray.direction.as_dvec3() / self.axes)
    }

    /// A place of the unit ball, in the world.
    fn placed(self, place: DVec3) -> DVec3 {
        self.center + self.rotation * (place * self.axes)
    }

    /// A normal of the unit ball, in the world.
    fn normal(&self, normal: DVec3) -> Vec3 {
        (self.rotation * (normal / self.axes)).normalize().as_vec3()
    }
}

/// Where a line comes into the unit ball.
#[inline]
fn enter(o: DVec3, d: DVec3) -> Option<f64> {
    let squared = d.length_squared();
    let near = -o.dot(d) / squared;
    let inside = 1.0 - (o + near * d).length_squared();
    (inside >= 0.0).then(|| near - (inside / squared).sqrt())
}

impl Surface for Ellipsoids {
    fn primitive_count(&self) -> u32 {
        self.ellipsoids.len() as u32
    }

    fn bounds(&self, primitive: u32) -> Bounds {
        let ellipsoid = &self.ellipsoids[primitive as usize];
        let m = DMat3::from_quat(ellipsoid.rotation) * DMat3::from_diagonal(ellipsoid.axes);
        let reach = match &self.shell {
            None => DVec3::new(m.row(0).length(), m.row(1).length(), m.row(2).length()),
            Some(shell) => shell.reach(m),
        };
        let bounds = Bounds {
            min: (ellipsoid.center - reach).as_vec3(),
            max: (ellipsoid.center + reach).as_vec3(),
        };
        let room = (ellipsoid.center.abs() + reach).as_vec3() * offset::gamma(4);
        Bounds {
            min: bounds.min - room,
            max: bounds.max + room,
        }
    }

    fn intersect(&self, primitive: u32, ray: &Ray) -> Option<(f32, f32, f32)> {
        let (o, d) = self.ellipsoids[primitive as usize].seen_by(ray);
        let t = match &self.shell {
            None => enter(o, d)?,
            Some(shell) => shell.enter(o, d)?.0,
        } as f32;
        (t > 0.0 && t <= ray.t_max).then_some((t, 0.0, 0.0))
    }

    fn interaction(&self, ray: &Ray, hit: &Hit) -> Interaction<'_> {
        let ellipsoid = &self.ellipsoids[hit.primitive as usize];
        let (o, d) = ellipsoid.seen_by(ray);
        let met = self.shell.as_ref().map(|shell| shell.meet(o, d));
        let (place, normal, uv, tangents) = match met {
            None => {
                let place =
                    (o + enter(o, d).unwrap_or(f64::from(hit.t)) * d).normalize_or(DVec3::Z);
                (place, place, Vec2::ZERO, [DVec3::ZERO; 2])
            }
            Some(met) => (met.place, met.normal, met.uv, met.tangents),
        };
        let position = ellipsoid.placed(place);
        let normal = ellipsoid.normal(normal);
        let [dp_du, dp_dv] =
            tangents.map(|tangent| (ellipsoid.rotation * (tangent * ellipsoid.axes)).as_vec3());
        let frame = Frame::along(normal, dp_du);
        let reach = position.abs().max(ellipsoid.center.abs());
        Interaction {
            t: hit.t,
            position: position.as_vec3(),
            error: (reach * f64::from(offset::gamma(2)) * (1.0 + 1e-4)).as_vec3(),
            normal,
            frame,
            uv,
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

    fn bytes(&self) -> usize {
        self.ellipsoids.len() * size_of::<Ellipsoid>()
    }
}
