//! What motion costs: the same rays through a mesh that stands, that stands as an instance, that moves and turns, and
//! that deforms, in turns, by one thread, in its processor time. Each but the first is met alone in its world, and beside
//! a triangle that rays from the camera pass by: rays begin in the tree of an instance that is all there is.
//!
//!     cargo bench --bench motion -- dragon.ply
//!
//! Without a file the mesh is a bumpy sphere. Motion is small against the mesh, so that rays meet much the same.

#![allow(clippy::print_stdout)] // a bench's business

use std::path::Path;
use std::sync::Arc;

use etendue::accel::{Counts, Instance, Method, Order, Tracer};
use etendue::budget::Budget;
use etendue::interaction::{Hit, Ray};
use etendue::lanes::warp;
use etendue::math::{Moving, random};
use etendue::mesh::{self, Mesh, ReadOptions};
use etendue::shape::{Bounds, DeformingMesh, Geometry, TriangleMesh};
use glam::{DMat4, DVec3, Vec2, Vec3};

/// Rays along a side of the picture.
const SIDE: u32 = 512;
/// Times that each is measured.
const ROUNDS: usize = 15;

fn unit(seed: u64, i: u32) -> f32 {
    random::unit(random::bits(seed, i))
}

fn load() -> Mesh {
    let file = std::env::args()
        .skip(1)
        .find(|argument| !argument.starts_with('-'));
    let mut mesh = match &file {
        Some(file) => {
            let read = mesh::read(Path::new(file), &ReadOptions::default(), &Budget::default());
            read.unwrap_or_else(|e| panic!("{e}")).mesh
        }
        None => mesh::bumpy_sphere(7, 1),
    };
    let (low, high) = mesh.bounds().expect("a mesh with vertices");
    let center = (0.5 * (low + high)).as_dvec3();
    let size = 1.0 / f64::from((high - low).max_element());
    mesh.transform(&(DMat4::from_scale(DVec3::splat(size)) * DMat4::from_translation(-center)));
    mesh
}

/// Motions of a hundredth of the mesh's size, and of a turn of two degrees.
fn moving() -> Moving {
    let end = DMat4::from_translation(DVec3::new(0.01, 0.004, 0.0)) * DMat4::from_rotation_y(0.035);
    Moving::new(&[(0.0, DMat4::IDENTITY), (1.0, end)]).expect("a motion")
}

fn deforming(mesh: &Mesh) -> Geometry {
    let mut later = mesh.clone();
    for p in &mut later.positions {
        *p += 0.01 * Vec3::new((9.0 * p.y).sin(), (7.0 * p.z).cos(), 0.3);
    }
    let sets = [mesh.clone(), later].map(TriangleMesh::new);
    let deforming = DeformingMesh::new(sets.into(), vec![0.0, 1.0]);
    Geometry::Deforming(deforming.unwrap_or_else(|(_, why)| panic!("{why}")))
}

fn tracer(geometry: Geometry, instance: Option<Moving>, company: Option<Geometry>) -> Tracer {
    let instances = instance.map(|to_world| Instance { to_world, group: 1 });
    let mut groups = vec![instances.is_some() as u32];
    groups.extend(company.iter().map(|_| 0));
    let shapes = std::iter::once(geometry).chain(company).map(Arc::new);
    Tracer::new(
        shapes.collect(),
        &groups,
        instances.into_iter().collect(),
        Method::Tree,
    )
}

/// A triangle below the mesh and all rays from the camera.
fn triangle() -> Option<Geometry> {
    let mut mesh = mesh::rectangle();
    mesh.triangles.truncate(1);
    let place = DVec3::new(0.0, -1.2, -0.5);
    mesh.transform(&(DMat4::from_translation(place) * DMat4::from_scale(DVec3::splat(0.01))));
    Some(Geometry::Mesh(TriangleMesh::new(mesh)))
}

/// From one point side by side, at random times.
fn primary() -> Vec<Ray> {
    let place = |i: u32| (i as f32 + 0.5) / SIDE as f32 - 0.5;
    let ray = |i: u32| {
        let origin = Vec3::new(0.3, 0.4, 2.0);
        let target = Vec3::new(place(i % SIDE), place(i / SIDE), 0.0);
        Ray {
            origin,
            direction: (target - origin).normalize(),
            t_max: f32::INFINITY,
            time: unit(7, i),
        }
    };
    (0..SIDE * SIDE).map(ray).collect()
}

/// From where those end, in all directions.
fn bounces(tracer: &Tracer, rays: &[Ray]) -> Vec<Ray> {
    let mut hits = Vec::new();
    tracer.closest(rays, Order::Any, &mut hits, &mut Counts::default());
    let met = rays.iter().zip(&hits).filter(|(_, hit)| !hit.is_miss());
    let turned = met.enumerate().map(|(i, (ray, hit))| {
        let u = Vec2::new(unit(8, 2 * i as u32), unit(8, 2 * i as u32 + 1));
        let direction = warp::uniform_sphere::<f32>(u.into()).into();
        tracer.interaction(ray, hit).spawn(direction)
    });
    turned.collect()
}

/// Seconds of this thread.
fn cpu() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

fn main() {
    let mesh = load();
    let triangles = mesh.triangles.len();
    let still = || Geometry::Mesh(TriangleMesh::new(mesh.clone()));
    let deforms = deforming(&mesh);
    let bytes = [still().bytes(), deforms.bytes()];
    let tracers = [
        ("stands", tracer(still(), None, None)),
        (
            "stands as an instance",
            tracer(still(), Some(Moving::IDENTITY), None),
        ),
        ("moves", tracer(still(), Some(moving()), None)),
        (
            "deforms",
            tracer(deforming(&mesh), Some(Moving::IDENTITY), None),
        ),
        (
            "stands so, not alone",
            tracer(still(), Some(Moving::IDENTITY), triangle()),
        ),
        (
            "moves, not alone",
            tracer(still(), Some(moving()), triangle()),
        ),
        (
            "deforms, not alone",
            tracer(deforms, Some(Moving::IDENTITY), triangle()),
        ),
    ];
    let memory = |which: usize, geometry: usize| bytes[geometry] + tracers[which].1.tree_bytes();
    println!("{triangles} triangles, {}", tracers[0].1.kernel().name());
    println!(
        "memory: deforms / stands = {:.2}",
        memory(3, 1) as f64 / memory(0, 0) as f64
    );
    let bounds = tracers[0].1.bounds();
    assert!(bounds != Bounds::EMPTY);
    let primary = primary();
    let bounces = bounces(&tracers[0].1, &primary);
    let sets = [
        ("primary", &primary, Order::Any),
        (
            "primary, in packets where they can be",
            &primary,
            Order::Coherent,
        ),
        ("bounces", &bounces, Order::Any),
    ];
    for (name, rays, order) in sets {
        let mut seconds = vec![Vec::new(); tracers.len()];
        let mut hits: Vec<Hit> = Vec::new();
        let mut met = vec![0; tracers.len()];
        for _ in 0..ROUNDS {
            for (i, (_, tracer)) in tracers.iter().enumerate() {
                let begin = cpu();
                tracer.closest(rays, order, &mut hits, &mut Counts::default());
                seconds[i].push(cpu() - begin);
                met[i] = hits.iter().filter(|hit| !hit.is_miss()).count();
            }
        }
        println!("{name}: {} rays", rays.len());
        for (i, (what, _)) in tracers.iter().enumerate() {
            let mut ratios: Vec<f64> = seconds[i]
                .iter()
                .zip(&seconds[0])
                .map(|(a, b)| a / b)
                .collect();
            ratios.sort_by(f64::total_cmp);
            seconds[i].sort_by(f64::total_cmp);
            let median = |sorted: &[f64]| sorted[sorted.len() / 2];
            let nanoseconds = median(&seconds[i]) * 1e9 / rays.len() as f64;
            let share = 100.0 * met[i] as f64 / rays.len() as f64;
            println!(
                "  {what:<24} {nanoseconds:7.0} ns  {:.2}  {share:.1} % met",
                median(&ratios)
            );
        }
    }
}
