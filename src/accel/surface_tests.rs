//! Surfaces with an equation of their own, traced: against twins made of triangles, and against themselves.

use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3};

use super::*;
use crate::description::{Description, Kind, Options};
use crate::lanes::warp;
use crate::math::random;
use crate::mesh::Mesh;
use crate::shape::{self, TriangleMesh};

const CONE: &str = r#"type="cone""#;
const OPEN_CONE: &str = r#"type="cone"><boolean name="base" value="false"/"#;
const CYLINDER: &str = r#"type="cylinder""#;
const CLOSED_CYLINDER: &str = r#"type="cylinder"><boolean name="caps" value="true"/"#;
const DISK: &str = r#"type="disk""#;
const PLANE: &str = r#"type="plane""#;
const SPHERE: &str = r#"type="sphere""#;
/// An arrow head: concave, and given counter-clockwise.
const POLYGON: &str = r#"type="polygon"><point name="p0" value="-1, -1, 0"/><point name="p1" value="0, -0.5, 0"/>
    <point name="p2" value="1, -1, 0"/><point name="p3" value="0, 1, 0"/"#;
const TRIANGLE: &str = r#"type="triangle"><point name="p0" value="-1, -1, 0"/><point name="p1" value="1, -1, 0"/>
    <point name="p2" value="0, 1, 0"/"#;

pub(super) fn uniform(seed: u64, i: u32) -> f32 {
    random::unit(random::bits(seed, i))
}

fn square(seed: u64, i: u32) -> Vec2 {
    Vec2::new(uniform(seed, 2 * i), uniform(seed, 2 * i + 1))
}

/// A shape under a map.
pub(super) fn surface(what: &str, place: &DAffine3) -> Geometry {
    let [x, y, z] = [0, 1, 2].map(|i| {
        let row = place.matrix3.row(i);
        format!("{} {} {} {}", row.x, row.y, row.z, place.translation[i])
    });
    let text = format!(
        r#"<scene version="3.0.0"><shape {what}>
        <transform name="to_world"><matrix value="{x} {y} {z} 0 0 0 1"/></transform></shape></scene>"#
    );
    let scene = Description::parse(&text, Path::new("test.xml"), &Options::default()).unwrap();
    let shape = shape::build(&scene.root().children(Kind::Shape)[0]).unwrap();
    shape.geometry
}

fn tracer(geometry: Geometry) -> Tracer {
    Tracer::new(vec![Arc::new(geometry)], &[0], Vec::new(), Method::Tree)
}

fn ray(origin: Vec3, direction: Vec3) -> Ray {
    Ray {
        origin,
        direction: direction.normalize(),
        t_max: f32::INFINITY,
        time: 0.0,
    }
}

fn meet<'t>(tracer: &'t Tracer, ray: &Ray) -> Option<Interaction<'t>> {
    let (mut hits, mut counts) = (Vec::new(), Counts::default());
    tracer.closest(&[*ray], Order::Any, &mut hits, &mut counts);
    (!hits[0].is_miss()).then(|| tracer.interaction(ray, &hits[0]))
}

/// Stretches, shears and, every other time, mirrors.
pub(super) fn skew(i: u32) -> DAffine3 {
    let number = |n| f64::from(uniform(11, 32 * i + n)) - 0.5;
    let shear = DMat3::from_cols_array(&std::array::from_fn(|n| number(n as u32)));
    let mirror = if i.is_multiple_of(2) { 1.0 } else { -1.0 };
    let scale = DVec3::new(1.0, 0.7, 1.6 * mirror);
    DAffine3 {
        matrix3: DMat3::from_rotation_x(3.0 * number(10)) * (DMat3::from_diagonal(scale) + shear),
        translation: DVec3::new(number(11), number(12), number(13)),
    }
}

/// What a surface is made of: parameters in [0, 1]² to local points, with the cells of each.
type Patch = (fn(f64, f64) -> DVec3, [u32; 2]);

fn around(u: f64, radius: f64, z: f64) -> DVec3 {
    let (sin, cos) = (std::f64::consts::TAU * u).sin_cos();
    DVec3::new(radius * cos, radius * sin, z)
}

/// Triangles over the patches, their texture coordinates the parameters. Each is wound such that ∂p/∂u × ∂p/∂v
/// points outward where `mesh_too` says that the surface itself is no mesh.
fn twin(patches: &[Patch], place: &DAffine3, mesh_too: bool) -> Geometry {
    let mut mesh = Mesh::default();
    // A mirrored mesh keeps its winding, and every other surface its outside.
    let turn = !mesh_too && place.matrix3.determinant() < 0.0;
    for (point, [columns, rows]) in patches {
        let first = mesh.positions.len() as u32;
        for row in 0..=*rows {
            for column in 0..=*columns {
                let uv = [
                    f64::from(column) / f64::from(*columns),
                    f64::from(row) / f64::from(*rows),
                ];
                let p = place.transform_point3(point(uv[0], uv[1]));
                mesh.positions.push(p.as_vec3());
                mesh.uvs.push(Vec2::new(uv[0] as f32, uv[1] as f32));
            }
        }
        for cell in 0..columns * rows {
            let corner = first + cell % columns + cell / columns * (columns + 1);
            let above = corner + columns + 1;
            mesh.triangles
                .extend([[corner, corner + 1, above + 1], [corner, above + 1, above]]);
        }
    }
    if turn {
        mesh.flip_normals();
    }
    Geometry::Mesh(TriangleMesh::new(mesh))
}

#[test]
fn every_surface_is_met_where_its_twin_of_triangles_is_under_any_affine_map() {
    const N: u32 = 512;
    let cylinder: Patch = (|u, v| around(u, 1.0, v), [N, 1]);
    let cone: Patch = (|u, v| around(u, 1.0 - v, v), [N, 1]);
    let sphere: Patch = (
        |u, v| {
            around(
                u,
                (std::f64::consts::PI * v).sin(),
                -(std::f64::consts::PI * v).cos(),
            )
        },
        [N, N / 2],
    );
    // v grows inward, so that the outside is down or up.
    let bottom: Patch = (|u, v| around(u, v, 0.0), [N, 1]);
    let top: Patch = (|u, v| around(u, 1.0 - v, 1.0), [N, 1]);
    let disk: Patch = (|u, v| around(u, 1.0 - v, 0.0), [N, 1]);
    let plane: Patch = (
        |u, v| 1e3 * DVec3::new(2.0 * u - 1.0, 2.0 * v - 1.0, 0.0),
        [1, 1],
    );
    let triangle: Patch = (
        |u, v| DVec3::new((2.0 * u - 1.0) * (1.0 - v), 2.0 * v - 1.0, 0.0),
        [1, 1],
    );
    let left: Patch = (
        |u, v| DVec3::new(u - 1.0, 0.5 * u - 1.0 + v * (1.5 * u), 0.0),
        [1, 1],
    );
    let right: Patch = (
        |u, v| DVec3::new(u, -0.5 - 0.5 * u + v * (1.5 - 1.5 * u), 0.0),
        [1, 1],
    );
    let table: [(&str, Vec<Patch>); 9] = [
        (CYLINDER, vec![cylinder]),
        (CLOSED_CYLINDER, vec![cylinder, bottom, top]),
        (CONE, vec![cone, bottom]),
        (OPEN_CONE, vec![cone]),
        (DISK, vec![disk]),
        (PLANE, vec![plane]),
        (POLYGON, vec![left, right]),
        (SPHERE, vec![sphere]),
        (TRIANGLE, vec![triangle]),
    ];
    for (what, patches) in table {
        let (mut compared, mut apart) = (0, 0);
        for i in 0..if what == SPHERE { 0 } else { 12 } {
            let place = skew(i);
            let surface = surface(what, &place);
            let twin = twin(&patches, &place, surface.mesh().is_some());
            if what != PLANE {
                let ratio = surface.area() / twin.area();
                assert!((ratio - 1.0).abs() < 1e-4, "{what}: area {ratio}");
            }
            let (surface, twin) = (tracer(surface), tracer(twin));
            for j in 0..400 {
                let inside = place.transform_point3(DVec3::new(
                    1.8 * f64::from(uniform(13, j)) - 0.9,
                    1.8 * f64::from(uniform(14, j)) - 0.9,
                    f64::from(uniform(15, j)),
                ));
                let way = Vec3::from(warp::uniform_sphere(square(16, j).into()));
                let ray = ray(inside.as_vec3() - 7.0 * way, way);
                let (Some(a), Some(b)) = (meet(&surface, &ray), meet(&twin, &ray)) else {
                    continue;
                };
                // Where the two bend apart a flat angle makes much of little, and an edge makes two of one.
                if a.normal.dot(way).abs() < 0.2 || (a.t - b.t).abs() > 0.02 {
                    continue;
                }
                compared += 1;
                if a.normal.dot(b.normal) < 0.999 {
                    apart += 1;
                    continue;
                }
                assert!((a.t - b.t).abs() < 2e-3, "{what} {i}: {} {}", a.t, b.t);
                assert!(a.position.distance(ray.at(a.t)) < 1e-5 * a.t, "{what}");
                let on_side =
                    patches.len() != 2 && ![DISK, TRIANGLE, CLOSED_CYLINDER].contains(&what);
                if on_side && a.uv.x > 0.02 && a.uv.x < 0.98 && what != PLANE {
                    assert!(a.uv.distance(b.uv) < 0.01, "{what}: {} {}", a.uv, b.uv);
                }
            }
        }
        assert!(what == SPHERE || compared > 100, "{what}: {compared}");
        assert!(100 * apart <= compared, "{what}: {apart} of {compared}");
    }
}

#[test]
fn a_ray_that_leaves_a_convex_surface_outward_meets_it_no_more_at_any_scale() {
    for what in [
        CONE,
        OPEN_CONE,
        CYLINDER,
        CLOSED_CYLINDER,
        DISK,
        PLANE,
        SPHERE,
        TRIANGLE,
    ] {
        let mut left = 0;
        for decade in -5..=5 {
            let scale = 10f64.powi(decade);
            for (i, shift) in [0.0, 3.0, -20.0].into_iter().enumerate() {
                let skewed = if what == SPHERE {
                    DAffine3::IDENTITY
                } else {
                    skew(i as u32)
                };
                let place = DAffine3::from_scale(DVec3::splat(scale))
                    * DAffine3::from_translation(DVec3::splat(shift))
                    * skewed;
                let tracer = tracer(surface(what, &place));
                for j in 0..300 {
                    let local = DVec3::new(
                        1.6 * f64::from(uniform(17, j)) - 0.8,
                        1.6 * f64::from(uniform(18, j)) - 0.8,
                        f64::from(uniform(19, j)),
                    );
                    let target = place.transform_point3(local).as_vec3();
                    let way = Vec3::from(warp::uniform_sphere(square(20, j).into()));
                    let ray = ray(target - 5.0 * scale as f32 * way, way);
                    let Some(at) = meet(&tracer, &ray).filter(|at| at.wi.z > 0.0) else {
                        continue;
                    };
                    // Half of them within a thousandth of the horizon.
                    let up = Vec3::from(warp::cosine_hemisphere(square(21, j).into()));
                    let up = match j % 2 {
                        0 => up,
                        _ => Vec3::new(up.x, up.y, 1e-3 * up.z).normalize(),
                    };
                    left += 1;
                    let again = meet(&tracer, &at.spawn(at.frame.to_world(up)));
                    let again = again.map(|again| again.t);
                    assert_eq!(
                        again, None,
                        "{what}: scale 1e{decade}, shift {shift}, ray {j}"
                    );
                }
            }
        }
        assert!(left > 200, "{what}: {left}");
    }
}
