//! Surfaces in grids: against Mitsuba's numbers, and against functions that are known everywhere.

use std::path::Path;

use glam::DVec3;

use super::*;
use crate::budget::Budget;
use crate::description::{Description, Options};
use crate::image::vol::{Grid, encode};
use crate::math::random;

/// A grid of a function of the unit cube.
fn grid(size: [u32; 3], f: impl Fn(DVec3) -> f64) -> Grid {
    let last = DVec3::from_array(size.map(|n| f64::from(n - 1)));
    let count = size.iter().product::<u32>();
    let point = |i: u32| {
        DVec3::new(
            f64::from(i % size[0]),
            f64::from(i / size[0] % size[1]),
            f64::from(i / size[0] / size[1]),
        )
    };
    Grid {
        size,
        channels: 1,
        bbox: [Vec3::ZERO, Vec3::ONE],
        values: (0..count).map(|i| f(point(i) / last) as f32).collect(),
    }
}

fn ball(p: DVec3) -> f64 {
    p.distance(DVec3::splat(0.5)) - 0.35
}

fn try_build(grid: &Grid, more: &str) -> Result<Geometry> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("grid.vol");
    std::fs::write(&path, encode(grid)).unwrap();
    let text = format!(
        r#"<scene version="3.0.0"><shape type="sdfgrid"><string name="filename" value="{}"/>{more}</shape></scene>"#,
        path.display()
    );
    let scene = Description::parse(&text, Path::new("test.xml"), &Options::default()).unwrap();
    build(&scene.root().children(Kind::Shape)[0]).map(|shape| shape.geometry)
}

fn surface(grid: &Grid, more: &str) -> Geometry {
    try_build(grid, more).unwrap()
}

fn ray(origin: impl Into<Vec3>, direction: impl Into<Vec3>) -> Ray {
    Ray {
        origin: origin.into(),
        direction: direction.into().normalize(),
        t_max: f32::INFINITY,
        time: 0.0,
    }
}

fn meet<'g>(geometry: &'g Geometry, ray: &Ray) -> Option<Interaction<'g>> {
    let hits = (0..geometry.primitive_count()).filter_map(|primitive| {
        let (t, u, v) = geometry.intersect(primitive, ray)?;
        let (bounds, place) = (geometry.bounds(primitive), ray.at(t));
        let room = 1e-5 * (1.0 + t);
        assert!(place.cmpge(bounds.min - room).all() && place.cmple(bounds.max + room).all());
        Some(Hit {
            t,
            u,
            v,
            instance: Hit::NONE,
            shape: 0,
            primitive,
        })
    });
    let hit = hits.min_by(|a, b| a.t.total_cmp(&b.t))?;
    Some(geometry.interaction(ray, &hit))
}

const DOWN: [f32; 3] = [0.0, 0.0, -1.0];

#[test]
fn hits_and_both_kinds_of_normal_are_those_of_mitsuba() {
    let ball = grid([6; 3], ball);
    let analytic = surface(&ball, r#"<string name="normals" value="analytic"/>"#);
    let smooth = surface(&ball, "");
    let rows = [
        (
            [0.4, 0.45, 5.0],
            DOWN,
            4.180_487,
            [0.0, 0.0, 1.0],
            [-0.257_49, -0.125_23, 0.958_13],
            68,
        ),
        (
            [0.4, 0.45, 5.0],
            [0.01, 0.02, -1.0],
            4.181_532,
            [0.0, 0.0, 1.0],
            [-0.149_52, 0.085_21, 0.985_08],
            69,
        ),
        (
            [-3.0, 0.3, 0.4],
            [1.0, 0.0, 0.0],
            3.251_432,
            [-0.743_39, -0.668_86, 0.0],
            [-0.739_3, -0.623_53, -0.254_24],
            13,
        ),
        (
            [0.5, 0.5, 0.5],
            [0.0, 0.1, 1.0],
            0.321_106,
            [0.0, 0.0, 1.0],
            [0.0, 0.081_28, 0.996_69],
            69,
        ),
        (
            [0.5, 0.5, 0.5],
            [1.0, 0.3, 0.2],
            0.339_647,
            [1.0, 0.0, 0.0],
            [0.955_85, 0.245_81, 0.161],
            37,
        ),
        (
            [0.25, 0.5, 0.5],
            [-1.0, 0.0, 0.0],
            0.069_513,
            [-1.0, 0.0, 0.0],
            [-1.0, 0.0, 0.0],
            36,
        ),
    ];
    for (origin, direction, t, normal, shading, primitive) in rows {
        let ray = ray(origin, direction);
        // On a face between two voxels either may be the one.
        let on_face = origin[0] == 0.4 || origin[2] == 0.4;
        for (shape, shading) in [(&analytic, normal), (&smooth, shading)] {
            let at = meet(shape, &ray).unwrap();
            assert!((at.t - t).abs() < 1e-5, "{origin:?}: {}", at.t);
            if on_face {
                continue;
            }
            assert!(
                at.normal.distance(normal.into()) < 1e-4,
                "{origin:?}: {}",
                at.normal
            );
            assert!(
                at.frame.n.distance(shading.into()) < 1e-4,
                "{origin:?}: {}",
                at.frame.n
            );
            assert_eq!(at.primitive, primitive);
        }
        let at = meet(&smooth, &ray).unwrap();
        assert!(
            at.frame.n.distance(shading.into()) < 1e-4,
            "{origin:?}: {}",
            at.frame.n
        );
    }
    let scaled =
        r#"<transform name="to_world"><scale value="2, 1, 1"/><translate x="1"/></transform>"#;
    let scaled = surface(&ball, scaled);
    let at = meet(&scaled, &ray([-3.0, 0.3, 0.4], [1.0, 0.0, 0.0])).unwrap();
    assert!((at.t - 4.502_865).abs() < 1e-5);
    assert!(
        at.frame
            .n
            .distance(Vec3::new(-0.481_22, -0.811_72, -0.330_97))
            < 1e-4
    );
    // A surface that leaves the grid is open there, and met from behind.
    let open = surface(
        &grid([6; 3], |p| p.distance(DVec3::new(0.0, 0.5, 0.5)) - 0.5),
        "",
    );
    for (x, direction, t) in [(-1.0, 1.0, 1.478_819), (2.0, -1.0, 1.521_181)] {
        let at = meet(&open, &ray([x, 0.5, 0.5], [direction, 0.0, 0.0])).unwrap();
        assert!((at.t - t).abs() < 1e-5 && at.normal.distance(Vec3::X) < 1e-4);
    }
}

/// Mitsuba 3.9.1 takes the sizes of such grids in the wrong order, and meets nothing.
#[test]
fn grids_of_three_sizes_are_met_where_the_function_is_0_under_any_transform() {
    for matrix in [
        "1 0 0 0 0 1 0 0 0 0 1 0",
        "0 -2 0 1 1 0 0 0 0 0.3 1 4",
        "-3 0.5 0 0 0 1 0.2 7 0.1 0 -2 0",
    ] {
        let more =
            format!(r#"<transform name="to_world"><matrix value="{matrix} 0 0 0 1"/></transform>"#);
        let rows: Vec<f64> = matrix.split(' ').map(|n| n.parse().unwrap()).collect();
        let to_world = |p: DVec3| {
            let row = |i: usize| {
                rows[4 * i] * p.x + rows[4 * i + 1] * p.y + rows[4 * i + 2] * p.z + rows[4 * i + 3]
            };
            DVec3::new(row(0), row(1), row(2))
        };
        let plane = |p: DVec3| p.dot(DVec3::new(0.3, 0.5, 0.7)) - 0.7;
        let shape = surface(&grid([8, 5, 3], plane), &more);
        let mut met = 0;
        for i in 0..500 {
            let number = |n: u32| f64::from(random::unit(random::bits(5, 8 * i + n)));
            let (a, b) = (
                DVec3::new(number(0), number(1), number(2)),
                DVec3::new(number(3), number(4), number(5)),
            );
            let part = plane(a) / (plane(a) - plane(b));
            let expected = (0.0..=1.0)
                .contains(&part)
                .then(|| to_world(a.lerp(b, part)));
            let (from, to) = (to_world(a), to_world(b));
            let mut ray = ray(from.as_vec3(), (to - from).as_vec3());
            ray.t_max = from.distance(to) as f32;
            let found = meet(&shape, &ray);
            let (Some(expected), Some(found)) = (expected, &found) else {
                let gap = plane(a).abs().min(plane(b).abs());
                assert!(
                    expected.is_none() && found.is_none() || gap < 1e-5,
                    "{a} {b}"
                );
                continue;
            };
            met += 1;
            assert!(
                found.position.as_dvec3().distance(expected) < 1e-5,
                "{a} {b}"
            );
            assert!(found.position.distance(ray.at(found.t)) < 1e-5);
        }
        assert!(met > 100, "{met}");
    }
}

#[test]
fn no_ray_slips_through_between_voxels_and_none_meets_the_surface_it_leaves() {
    let shape = surface(&grid([9, 7, 8], ball), "");
    for i in 0..3000 {
        let number = |n: u32| random::unit(random::bits(6, 8 * i + n)) - 0.5;
        let direction = Vec3::new(number(0), number(1), number(2));
        // Every other ray runs along faces of voxels.
        let direction = match i % 2 {
            0 => direction,
            _ => Vec3::new(0.0, direction.y, direction.z),
        };
        let inside = Vec3::new(0.5, 0.5 + 0.1 * number(3), 0.5 + 0.1 * number(4));
        let at = meet(&shape, &ray(inside, direction)).expect("the ball is closed");
        assert!(at.wi.z < 0.0 || at.normal.dot(direction) > 0.0);
        let away = meet(&shape, &at.spawn(direction.normalize()));
        assert!(
            away.is_none(),
            "{direction} left, and met it {}",
            away.unwrap().t
        );
        let back = meet(&shape, &at.spawn(-direction.normalize())).expect("the other side");
        assert!(back.t > 0.4);
    }
}

#[test]
fn grids_that_hold_no_surface_are_refused() {
    let plain = grid([4; 3], |_| 1.0);
    let said = |grid: &Grid, more: &str| try_build(grid, more).unwrap_err().to_string();
    assert!(said(&plain, "").contains("same sign all over"));
    let colored = Grid {
        channels: 3,
        size: [2; 3],
        values: vec![0.5; 24],
        ..plain.clone()
    };
    assert!(said(&colored, "").contains("has 3 channels"));
    assert!(said(&grid([1, 1, 2], |_| 0.0), "").contains("has no voxels"));
    let flat = r#"<transform name="to_world"><scale z="0"/></transform>"#;
    assert!(said(&grid([4; 3], ball), flat).contains("keep its volume"));
    let path = Path::new("/nowhere.vol");
    assert!(crate::image::vol::read(path, &Budget::default()).is_err());
}
