//! Instances: against the same shapes moved there, and the walk through many trees against brute force, to the bit.

use std::sync::Arc;

use glam::{DMat3, DMat4, DVec3, Vec3};

use super::surface_tests::{skew, surface, uniform};
use super::tests::{agree, all, direction};
use super::*;
use crate::math::Transform;
use crate::mesh::{self, Mesh};
use crate::shape::TriangleMesh;

fn geometry(mesh: Mesh) -> Arc<Geometry> {
    Arc::new(Geometry::Mesh(TriangleMesh::new(mesh)))
}

fn instance(group: u32, matrix: &DMat4) -> Instance {
    let to_world = Transform::new(matrix).expect("a matrix with an inverse");
    Instance {
        to_world: Moving::Still(to_world),
        group,
    }
}

/// Turns, shears, stretches unevenly and, every other time, mirrors.
fn affine(i: u32) -> DMat4 {
    let place = skew(i);
    DMat4::from_mat3_translation(place.matrix3, place.translation)
}

/// From all around toward points near the origin, some along axes.
fn rays(seed: u64, count: u32) -> Vec<Ray> {
    let ray = |i: u32| {
        let origin = direction(seed, i) * 4.0 * uniform(seed + 1, i);
        let target = direction(seed + 2, i) * uniform(seed + 3, i);
        let direction = match i % 8 {
            0 => Vec3::AXES[i as usize / 8 % 3],
            _ => (target - origin).normalize(),
        };
        Ray {
            origin,
            direction,
            t_max: f32::INFINITY,
            time: 0.0,
        }
    };
    (0..count).map(ray).collect()
}

fn closest(tracer: &Tracer, rays: &[Ray]) -> Vec<Hit> {
    let (mut hits, mut counts) = (Vec::new(), Counts::default());
    tracer.closest(rays, Order::Any, &mut hits, &mut counts);
    hits
}

/// A ball with normals of its own.
fn smooth(seed: u64) -> Mesh {
    let mut mesh = mesh::bumpy_sphere(2, seed);
    mesh.compute_normals();
    mesh
}

#[test]
fn instances_and_moved_meshes_are_one_under_every_affine_map() {
    for i in 0..32 {
        let (matrix, mesh) = (affine(i), smooth(u64::from(i)));
        let mut moved = mesh.clone();
        moved.transform(&matrix);
        let there = instance(1, &matrix);
        // As long as they become: normals of unit length between which is interpolated would be others.
        moved.normals = (mesh.normals.iter())
            .map(|n| there.to_world.at(0.0).normal(*n))
            .collect();
        let alone = Tracer::new(vec![geometry(moved)], &[0], Vec::new(), Method::Tree);
        // A moved mesh keeps its winding, an instance its front: as in Mitsuba.
        let side = if there.to_world.at(0.0).mirrors() {
            -1.0
        } else {
            1.0
        };
        let instanced = Tracer::new(vec![geometry(mesh)], &[1], vec![there], Method::Tree);
        let rays = rays(100 + u64::from(i), 2000);
        let pairs = closest(&alone, &rays).into_iter();
        let (mut met, mut apart) = (0, 0);
        for ((a, b), ray) in pairs.zip(closest(&instanced, &rays)).zip(&rays) {
            if a.is_miss() && b.is_miss() {
                continue;
            }
            // Where a ray passes by an edge, rounding decides.
            if a.primitive != b.primitive || a.is_miss() != b.is_miss() {
                apart += 1;
                continue;
            }
            met += 1;
            let (a, b) = (alone.interaction(ray, &a), instanced.interaction(ray, &b));
            assert!((a.t - b.t).abs() < 1e-4, "{i}: {} and {}", a.t, b.t);
            assert!((a.position - b.position).length() < 1e-4);
            assert!((a.normal - side * b.normal).length() < 1e-3, "{i}");
            assert!((a.frame.n - b.frame.n).length() < 1e-3, "{i}");
            let along = ray.at(b.t) - b.position;
            assert!(along.length() < 1e-4);
        }
        assert!(met > 500 && apart < 10, "{i}: {met} met, {apart} apart");
    }
}

#[test]
fn instances_and_moved_surfaces_are_one_under_every_map_that_both_take() {
    let shapes = [
        r#"type="sphere""#,
        r#"type="disk""#,
        r#"type="cylinder""#,
        r#"type="cone""#,
    ];
    for (i, what) in (0..).zip(shapes.repeat(4)) {
        let angle = f64::from(uniform(1, i)) * 6.0;
        let mut place = skew(i);
        place.matrix3 = DMat3::from_rotation_y(angle) * (0.4 + 0.1 * f64::from(i));
        let matrix = DMat4::from_mat3_translation(place.matrix3, place.translation);
        let moved = vec![Arc::new(surface(what, &place))];
        let alone = Tracer::new(moved, &[0], Vec::new(), Method::Tree);
        let shapes = vec![Arc::new(surface(what, &glam::DAffine3::IDENTITY))];
        let instanced = Tracer::new(shapes, &[1], vec![instance(1, &matrix)], Method::Tree);
        let rays = rays(200 + u64::from(i), 2000);
        let pairs = closest(&alone, &rays).into_iter();
        let (mut met, mut apart) = (0, 0);
        for ((a, b), ray) in pairs.zip(closest(&instanced, &rays)).zip(&rays) {
            if a.is_miss() != b.is_miss() {
                apart += 1;
            } else if !a.is_miss() {
                met += 1;
                let (a, b) = (alone.interaction(ray, &a), instanced.interaction(ray, &b));
                // A grazed ball is met anywhere along the graze.
                let slack = 1e-4 / a.normal.dot(ray.direction).abs().max(1e-3);
                assert!((a.t - b.t).abs() < slack, "{what}: {} and {}", a.t, b.t);
                assert!((a.normal - b.normal).length() < 10.0 * slack, "{what}");
                assert!((a.frame.n - b.frame.n).length() < 10.0 * slack);
            }
        }
        assert!(met > 50 && apart < 10, "{what}: {met} met, {apart} apart");
    }
}

#[test]
fn of_instances_in_one_place_the_first_is_met() {
    let shapes = [geometry(smooth(1)), geometry(smooth(1))];
    for matrix in [DMat4::IDENTITY, affine(3)] {
        let there = [1, 2, 1].map(|group| instance(group, &matrix));
        let tracers = all(&shapes, &[1, 2], &there);
        let rays = rays(300, 1000);
        assert!(agree(&tracers, &rays) > 300);
        for tracer in &tracers {
            let hits = closest(tracer, &rays).into_iter();
            assert!(
                hits.filter(|hit| !hit.is_miss())
                    .all(|hit| hit.instance == 0)
            );
        }
    }
    // An instance comes before the world.
    let first = [instance(1, &DMat4::IDENTITY)];
    for tracer in all(&shapes, &[0, 1], &first) {
        let hits = closest(&tracer, &rays(301, 1000)).into_iter();
        assert!(
            hits.filter(|hit| !hit.is_miss())
                .all(|hit| hit.instance == 0)
        );
    }
}

#[test]
fn thousands_of_instances_are_found_like_by_brute_force() {
    let shapes = [
        geometry(mesh::cube()),
        Arc::new(surface(r#"type="sphere""#, &glam::DAffine3::IDENTITY)),
    ];
    let there: Vec<Instance> = (0..3000)
        .map(|i| {
            let at = direction(400, i) * 1.5 * uniform(401, i);
            let matrix = DMat4::from_translation(at.as_dvec3())
                * affine(i)
                * DMat4::from_scale(DVec3::splat(0.05));
            instance(1 + i % 2, &matrix)
        })
        .collect();
    let tracers = all(&shapes, &[1, 2], &there);
    assert!(agree(&tracers, &rays(402, 400)) > 100);
}

/// A few groups of anything: meshes, surfaces, planes, nothing.
fn random_scene(seed: u64) -> (Vec<Arc<Geometry>>, Vec<u32>, Vec<Instance>) {
    let pick = |i: u32, count: u32| ((uniform(seed, i) * count as f32) as u32).min(count - 1);
    let groups = 1 + pick(0, 3);
    let (mut shapes, mut group_of) = (Vec::new(), Vec::new());
    for i in 0..1 + pick(1, 5) {
        let mut place = skew(pick(10 + i, 1000));
        let round = |what: &str| surface(what, &glam::DAffine3::IDENTITY);
        let shape = match pick(20 + i, 9) {
            0 => round(r#"type="sphere""#),
            1 => round(r#"type="disk""#),
            2 => round(r#"type="cylinder""#),
            3 if uniform(seed, 30 + i) < 0.2 => round(r#"type="plane""#),
            4 => Geometry::Mesh(TriangleMesh::new(Mesh::default())),
            kind => {
                let mut mesh = match kind {
                    5 => mesh::rectangle(),
                    6 => mesh::cube(),
                    _ => mesh::bumpy_sphere(1, seed),
                };
                place.matrix3 *= 0.6;
                mesh.transform(&DMat4::from_mat3_translation(
                    place.matrix3,
                    place.translation,
                ));
                Geometry::Mesh(TriangleMesh::new(mesh))
            }
        };
        shapes.push(Arc::new(shape));
        group_of.push(pick(40 + i, groups + 1));
    }
    let count = [0, 1, 2, 5, 20][pick(2, 5) as usize];
    let there = (0..count).map(|i| {
        // Some coincide, some are flat or tiny or far too large.
        let size = [1.0, 1.0, 1.0, 0.3, 1e-3, 1e4, 1e-30, 1e30][pick(100 + i, 8) as usize];
        let flat = [1.0, 1.0, 1e-6][pick(200 + i, 3) as usize];
        let place =
            affine(pick(300 + i, 4)) * DMat4::from_scale(DVec3::new(size, size, size * flat));
        instance(1 + pick(400 + i, groups), &place)
    });
    (shapes, group_of, there.collect())
}

#[test]
fn random_scenes_of_instances_are_found_like_by_brute_force() {
    let mut met = 0;
    for seed in 0..300 {
        let (shapes, group_of, there) = random_scene(1000 + seed);
        let tracers = all(&shapes, &group_of, &there);
        met += agree(&tracers, &rays(2000 + seed, 96));
    }
    assert!(met > 300 * 20, "{met} met");
}

#[test]
fn an_instance_s_box_holds_it_and_is_closer_than_its_group_s_box_turned() {
    let shapes = vec![geometry(mesh::bumpy_sphere(4, 1))];
    let corners = shapes[0].mesh().expect("a mesh").positions.clone();
    let (mut close, mut loose) = (0.0, 0.0);
    for i in 0..32 {
        let there = instance(1, &affine(i));
        let to_world = there.to_world.at(0.0);
        let tracer = Tracer::new(shapes.clone(), &[1], vec![there], Method::Tree);
        let bounds = tracer.bounds();
        for corner in &corners {
            let at = to_world.point(*corner);
            assert!(at.cmpge(bounds.min).all() && at.cmple(bounds.max).all());
        }
        let area = |b: Bounds| {
            let d = b.max - b.min;
            d.x * d.y + d.y * d.z + d.z * d.x
        };
        close += area(bounds);
        loose += area(tracer.groups[1].bounds().transformed(&to_world));
    }
    assert!(close < 0.8 * loose, "{close} of {loose}");
}

/// In an instance's own space the ray begins at infinity: it meets nothing there, and what is behind.
#[test]
fn a_ray_that_is_lost_in_an_instance_goes_on_outside() {
    let small = instance(1, &DMat4::from_scale(DVec3::splat(1e-36)));
    let mut wall = mesh::bumpy_sphere(1, 3);
    wall.transform(&DMat4::from_translation(DVec3::new(50.0, 0.0, 0.0)));
    let shapes = [geometry(smooth(2)), geometry(wall)];
    let ray = Ray {
        origin: Vec3::new(-1e3, 0.0, 0.0),
        direction: Vec3::X,
        t_max: f32::INFINITY,
        time: 0.0,
    };
    let tracers = all(&shapes, &[1, 0], &[small]);
    for tracer in &tracers {
        let [hit] = closest(tracer, &[ray])[..] else {
            unreachable!("one ray");
        };
        assert_eq!((hit.instance, hit.shape), (Hit::NONE, 1), "{hit:?}");
    }
}
