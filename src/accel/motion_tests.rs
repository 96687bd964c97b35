//! What moves: the walk through trees against brute force, to the bit, and against the same shapes as they stand at the
//! time of a ray.

use std::sync::Arc;

use glam::{DAffine3, DMat4, DVec3, Vec3};

use super::surface_tests::{surface, uniform};
use super::tests::{agree, all, direction};
use super::*;
use crate::mesh::{self, Mesh};
use crate::shape::{DeformingMesh, TriangleMesh};

fn geometry(mesh: Mesh) -> Arc<Geometry> {
    Arc::new(Geometry::Mesh(TriangleMesh::new(mesh)))
}

/// From all around toward points near the origin, at times of a shutter that is open from 0 to 1.
fn rays(seed: u64, count: u32) -> Vec<Ray> {
    let ray = |i: u32| {
        let origin = direction(seed, i) * 6.0;
        let target = direction(seed + 2, i) * 2.0 * uniform(seed + 3, i);
        Ray {
            origin,
            direction: (target - origin).normalize(),
            t_max: f32::INFINITY,
            time: uniform(seed + 4, i),
        }
    };
    (0..count).map(ray).collect()
}

fn moving(keyframes: &[(f64, DMat4)]) -> Moving {
    Moving::new(keyframes).expect("keyframes that make a motion")
}

/// Two and a half turns in the time of a shutter.
fn blade() -> Moving {
    let keyframe = |i: u32| {
        let angle = f64::from(i) / 8.0 * 2.5 * std::f64::consts::TAU;
        (f64::from(i) / 8.0, DMat4::from_rotation_z(angle))
    };
    moving(&(0..=8).map(keyframe).collect::<Vec<_>>())
}

/// Straight on, growing and tumbling, a blade, and a blade on what goes straight.
fn motions() -> Vec<Moving> {
    let shift = |x: f64| DMat4::from_translation(DVec3::new(x, 0.2 * x, 0.0));
    let tumble = |angle: f64, size: f64| {
        DMat4::from_axis_angle(DVec3::new(1.0, 2.0, -1.0).normalize(), angle)
            * DMat4::from_scale(DVec3::new(size, 0.4, 0.5))
    };
    let straight = moving(&[(0.0, shift(-1.0)), (1.0, shift(1.5))]);
    let tumbling = moving(&[
        (-0.5, shift(0.5) * tumble(0.0, 0.5)),
        (0.2, shift(-0.7) * tumble(2.5, 1.0)),
        (0.9, tumble(4.0, 0.3)),
    ]);
    let arm = DMat4::from_translation(DVec3::X * 0.5);
    let carried = Moving::product(Some(&straight), &arm, Some(&blade())).expect("invertible");
    vec![straight, tumbling, blade(), carried]
}

fn parts() -> (Vec<Arc<Geometry>>, Vec<u32>, Vec<Instance>) {
    let place = DAffine3::from_translation(DVec3::new(0.3, 0.0, 0.2));
    let mut long = mesh::cube();
    long.transform(&DMat4::from_scale(DVec3::new(1.6, 0.1, 0.05)));
    let shapes = vec![
        geometry(mesh::bumpy_sphere(3, 5)),
        geometry(mesh::rectangle()),
        geometry(mesh::cube()),
        Arc::new(surface(r#"type="sphere""#, &place)),
        geometry(long),
        geometry(mesh::bumpy_sphere(2, 6)),
        Arc::new(surface(r#"type="disk""#, &place)),
    ];
    let instance = |(number, to_world): (u32, Moving)| Instance {
        to_world,
        group: number + 1,
    };
    let instances = (0..).zip(motions()).map(instance).collect();
    (shapes, vec![0, 1, 2, 2, 3, 4, 4], instances)
}

#[test]
fn what_moves_is_met_alike_by_every_kernel_and_by_brute_force() {
    let (shapes, groups, instances) = parts();
    let tracers = all(&shapes, &groups, &instances);
    assert!(tracers[0].moves());
    assert!(agree(&tracers, &rays(300, 20_000)) > 5000);
    for (i, moving) in (0..).zip(motions()) {
        let alone = [Instance {
            to_world: moving,
            group: 1,
        }];
        let blade = [shapes[4].clone()];
        assert!(agree(&all(&blade, &[1], &alone), &rays(310 + i, 5000)) > 200);
        let both = &shapes[2..4];
        assert!(agree(&all(both, &[1, 1], &alone), &rays(315 + i, 5000)) > 200);
    }
}

#[test]
fn a_shutter_that_is_known_changes_no_hit() {
    let (shapes, groups, instances) = parts();
    let rays = rays(320, 10_000);
    let found = [(0.0, 1.0), (f32::NEG_INFINITY, f32::INFINITY)].map(|shutter| {
        let recipe = Recipe {
            shutter,
            ..Recipe::default()
        };
        let tracer = Tracer::new(shapes.clone(), &groups, instances.clone(), recipe);
        let (mut hits, mut counts) = (Vec::new(), Counts::default());
        tracer.closest(&rays, Order::Any, &mut hits, &mut counts);
        (hits, counts.node_steps)
    });
    // All hits lie in their boxes, so that which boxes they are decides nothing.
    assert!(found[0].0 == found[1].0);
    assert!(
        found[0].1 < found[1].1,
        "closer boxes are entered less often"
    );
}

#[test]
fn at_its_time_a_ray_meets_what_stands_there() {
    let (shapes, groups, instances) = parts();
    let moving = Tracer::new(shapes.clone(), &groups, instances.clone(), Method::Tree);
    for (seed, time) in (330..).zip([0.0, 0.31, 0.5, 0.87, 1.0]) {
        let there = instances
            .iter()
            .map(|Instance { to_world, group }| Instance {
                to_world: Moving::Still(to_world.at(time)),
                group: *group,
            });
        let still = Tracer::new(shapes.clone(), &groups, there.collect(), Method::Tree);
        let rays = rays(seed, 3000).into_iter().map(|ray| Ray { time, ..ray });
        let rays: Vec<Ray> = rays.collect();
        let [a, b] = [&moving, &still].map(|tracer| {
            let mut hits = Vec::new();
            tracer.closest(&rays, Order::Any, &mut hits, &mut Counts::default());
            hits
        });
        let (mut met, mut apart) = (0, 0);
        for ((a, b), ray) in a.iter().zip(&b).zip(&rays) {
            // Where a ray enters a box decides of the last place alone.
            if a.shape != b.shape || a.primitive != b.primitive {
                apart += 1;
            } else if !a.is_miss() {
                met += 1;
                let [a, b] =
                    [(&moving, a), (&still, b)].map(|(tracer, hit)| tracer.interaction(ray, hit));
                assert!(a.position.distance(b.position) < 1e-4);
                assert!(a.normal.distance(b.normal) < 1e-4);
                assert_eq!(a.time, time);
            }
        }
        assert!(met > 700 && apart < 3, "{time}: {met} met, {apart} apart");
    }
}

#[test]
fn a_point_is_found_again_at_other_times() {
    let (shapes, groups, instances) = parts();
    let tracer = Tracer::new(shapes, &groups, instances.clone(), Method::Tree);
    let rays = rays(340, 2000);
    let mut hits = Vec::new();
    tracer.closest(&rays, Order::Any, &mut hits, &mut Counts::default());
    let mut moved = 0;
    for (ray, hit) in rays.iter().zip(&hits).filter(|(_, hit)| !hit.is_miss()) {
        let at = tracer.interaction(ray, hit);
        let now = tracer.position_at(hit, &at, at.time);
        assert!(now.distance(at.position) < 1e-4);
        let later = tracer.position_at(hit, &at, 1.0);
        match instances.get(hit.instance as usize) {
            Some(Instance { to_world, .. }) => {
                let local = to_world.at(ray.time).inverse().point(at.position);
                assert!(to_world.at(1.0).point(local).distance(later) < 1e-5);
                moved += usize::from(later.distance(at.position) > 0.01);
            }
            None => assert_eq!(later, at.position),
        }
    }
    assert!(moved > 300, "{moved}");
    assert_eq!(Vec3::ZERO, Moving::IDENTITY.at(3.0).point(Vec3::ZERO));
}

/// In the shutter of the rays, which begins before and ends with them.
const TIMES: [f32; 3] = [0.1, 0.4, 1.0];

/// A ball that swells, leans and is carried on, with its vertices at these times.
fn deforming(seed: u64, times: &[f32]) -> Arc<Geometry> {
    let at = |time: f32| {
        let mut mesh = mesh::bumpy_sphere(3, seed);
        for (i, position) in (0..).zip(&mut mesh.positions) {
            let wave = direction(seed + 1, i) * 0.1 * time;
            let swollen = *position * (1.0 + 0.5 * (3.0 * position.x + 2.0 * time).sin());
            *position = swollen + wave + Vec3::new(0.8 * time * position.y, time * time - 1.0, 0.0);
        }
        mesh.compute_normals();
        TriangleMesh::new(mesh)
    };
    let times = times.to_vec();
    let meshes = times.iter().map(|time| at(*time)).collect();
    Arc::new(Geometry::Deforming(
        DeformingMesh::new(meshes, times).unwrap(),
    ))
}

#[test]
fn what_deforms_is_met_alike_by_every_kernel_and_by_brute_force() {
    let (mut shapes, mut groups, mut instances) = parts();
    for (number, to_world) in [(5, Moving::IDENTITY), (6, motions().remove(1))] {
        shapes.push(deforming(number.into(), &TIMES));
        groups.push(number);
        instances.push(Instance {
            to_world,
            group: number,
        });
    }
    let tracers = all(&shapes, &groups, &instances);
    assert!(agree(&tracers, &rays(350, 20_000)) > 8000);
    let alone = [Instance {
        to_world: Moving::IDENTITY,
        group: 1,
    }];
    assert!(agree(&all(&shapes[7..8], &[1], &alone), &rays(360, 20_000)) > 3000);
    let two = [deforming(7, &[0.2, 0.9])];
    assert!(agree(&all(&two, &[1], &alone), &rays(365, 20_000)) > 3000);
}

#[test]
fn what_deforms_is_at_its_times_what_the_meshes_are() {
    let geometry = deforming(3, &TIMES);
    let Geometry::Deforming(mesh) = &*geometry else {
        panic!("it deforms")
    };
    let alone = vec![Instance {
        to_world: Moving::IDENTITY,
        group: 1,
    }];
    let moving = Tracer::new(vec![geometry.clone()], &[1], alone, Method::Tree);
    for (seed, time) in (370..).zip([0.1, 0.25, 0.4, 0.8, 1.0]) {
        let mut still = mesh.mesh().clone();
        for (number, triangle) in (0..).zip(&mesh.mesh().triangles) {
            let corners = mesh.corners(number, mesh.moment(time));
            for (index, corner) in triangle.iter().zip(corners) {
                still.positions[*index as usize] = corner;
            }
        }
        let still = Tracer::new(vec![self::geometry(still)], &[0], Vec::new(), Method::Tree);
        let rays = rays(seed, 4000).into_iter().map(|ray| Ray { time, ..ray });
        let rays: Vec<Ray> = rays.collect();
        let [a, b] = [&moving, &still].map(|tracer| {
            let mut hits = Vec::new();
            tracer.closest(&rays, Order::Any, &mut hits, &mut Counts::default());
            hits
        });
        let mut met = 0;
        for ((a, b), ray) in a.iter().zip(&b).zip(&rays) {
            assert_eq!((a.t, a.u, a.v, a.primitive), (b.t, b.u, b.v, b.primitive));
            if a.is_miss() {
                continue;
            }
            met += 1;
            let [p, q] =
                [(&moving, a), (&still, b)].map(|(tracer, hit)| tracer.interaction(ray, hit));
            assert!(p.position.distance(q.position) < 1e-5 && p.normal.distance(q.normal) < 1e-4);
            // The mesh that stands has the normals of the first time.
            assert!(time != 0.1 || p.frame.n.distance(q.frame.n) < 1e-4);
            let again = moving.position_at(a, &p, time);
            assert!(again.distance(p.position) < 1e-4);
        }
        assert!(met > 500, "{time}: {met}");
    }
}

#[test]
fn memory_of_what_deforms_is_less_than_twice_that_of_what_stands() {
    let mesh = || {
        let mut mesh = mesh::bumpy_sphere(6, 1);
        mesh.compute_normals();
        TriangleMesh::new(mesh)
    };
    let still = Geometry::Mesh(mesh());
    let moving = DeformingMesh::new(vec![mesh(), mesh()], vec![0.0, 1.0]).unwrap();
    let moving = Geometry::Deforming(moving);
    let bytes = |geometry: Geometry, group: u32| {
        let own = geometry.bytes();
        let instances = (0..group).map(|_| Instance {
            to_world: Moving::IDENTITY,
            group,
        });
        let instances = instances.collect();
        let tracer = Tracer::new(vec![Arc::new(geometry)], &[group], instances, Method::Tree);
        own + tracer.tree_bytes()
    };
    let ratio = bytes(moving, 1) as f64 / bytes(still, 0) as f64;
    assert!(ratio < 1.9, "{ratio}");
}
