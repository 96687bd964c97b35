//! The tree against brute force, to the bit, and closed meshes without a hole.

use std::path::Path;

use super::*;
use crate::description::{Description, Kind, Options, Properties};
use crate::lanes::warp;
use crate::math::{Transform, random};
use crate::mesh::{self, Mesh};
use crate::shape::{self, TriangleMesh};
use glam::{DMat4, DVec3, Vec2, Vec3};

fn uniform(seed: u64, i: u32) -> f32 {
    random::unit(random::bits(seed, i))
}

pub(super) fn direction(seed: u64, i: u32) -> Vec3 {
    Vec3::from(warp::uniform_sphere(
        Vec2::new(uniform(seed, 2 * i), uniform(seed, 2 * i + 1)).into(),
    ))
}

/// Rays from points in and around the unit ball, some along axes and some aimed at vertices.
fn rays(count: u32, targets: &[Vec3]) -> Vec<Ray> {
    (0..count)
        .map(|i| {
            let origin = direction(1, i) * 2.5 * uniform(2, i);
            let direction = match i % 4 {
                0 => (targets[i as usize % targets.len()] - origin).normalize(),
                1 => Vec3::from_array(std::array::from_fn(|a| {
                    if a == i as usize / 4 % 3 { -1.0 } else { 0.0 }
                })),
                _ => direction(3, i),
            };
            Ray {
                origin,
                direction,
                t_max: f32::INFINITY,
                time: 0.0,
            }
        })
        .collect()
}

/// Brute force, and the tree walked by every kernel.
pub(super) fn all(shapes: &[Arc<Geometry>], groups: &[u32], instances: &[Instance]) -> Vec<Tracer> {
    let tracer = |method, kernel| {
        let recipe = Recipe {
            method,
            build: Build::Medium,
            kernel,
            ..Recipe::default()
        };
        let mut tracer = Tracer::new(shapes.to_vec(), groups, instances.to_vec(), recipe);
        // So that small scenes try single rays too; packets are asked for by their order.
        tracer.is_small = false;
        tracer
    };
    let walked = Kernel::all().into_iter();
    let trees = walked.map(|kernel| tracer(Method::Tree, kernel));
    [tracer(Method::Brute, Kernel::default())]
        .into_iter()
        .chain(trees)
        .collect()
}

/// What all find alike: how many rays meet something.
pub(super) fn agree(tracers: &[Tracer], rays: &[Ray]) -> usize {
    let limited = rays.iter().enumerate().map(|(i, r)| Ray {
        t_max: r.t_max.min(uniform(9, i as u32) * 3.0),
        ..*r
    });
    let limited: Vec<Ray> = limited.collect();
    let found = |tracer: &Tracer, order: Order| {
        let (mut hits, mut limited_hits, mut blocked) = (Vec::new(), Vec::new(), Vec::new());
        let mut counts = Counts::default();
        tracer.closest(rays, order, &mut hits, &mut counts);
        tracer.closest(&limited, order, &mut limited_hits, &mut counts);
        tracer.occluded(&limited, order, &mut blocked, &mut counts);
        for (hit, blocked) in limited_hits.iter().zip(&blocked) {
            assert_eq!(*blocked, !hit.is_miss());
        }
        let bits = |hit: &Hit| {
            let distances = [hit.t, hit.u, hit.v].map(f32::to_bits);
            (distances, [hit.instance, hit.shape, hit.primitive])
        };
        let bits: Vec<_> = hits.iter().chain(&limited_hits).map(bits).collect();
        let met = hits.iter().filter(|h| !h.is_miss()).count();
        (bits, met, counts)
    };
    let brute = found(&tracers[0], Order::Any);
    for order in [Order::Any, Order::Coherent] {
        let trees: Vec<_> = tracers[1..].iter().map(|t| found(t, order)).collect();
        for (tracer, (bits, _, counts)) in tracers[1..].iter().zip(&trees) {
            let name = tracer.kernel.name();
            for (i, (a, b)) in brute.0.iter().zip(bits).enumerate() {
                assert_eq!(a, b, "{name} and brute force, ray {i}, {order:?}");
            }
            assert_eq!(*counts, trees[0].2, "{name}, {order:?}");
        }
    }
    brute.1
}

#[test]
fn the_tree_and_brute_force_find_the_same_hits_to_the_bit() {
    let mesh = mesh::bumpy_sphere(3, 7);
    let targets = mesh.positions.clone();
    // The same mesh twice: every hit is a tie.
    let shapes =
        [mesh.clone(), mesh, mesh::cube()].map(|m| Arc::new(Geometry::Mesh(TriangleMesh::new(m))));
    let transform = DMat4::from_translation(DVec3::new(0.3, 0.2, -1.0))
        * DMat4::from_scale(DVec3::new(0.5, -2.0, 1.0));
    let to_world = Moving::Still(Transform::new(&transform).unwrap());
    let instances = [
        Instance { to_world, group: 1 },
        Instance {
            to_world: Moving::IDENTITY,
            group: 1,
        },
    ];
    let tracers = all(&shapes, &[0, 0, 1], &instances);
    assert!(agree(&tracers, &rays(6000, &targets)) > 3000);
}

#[test]
fn exhaustive_rays_are_held_against_everything_and_find_the_same() {
    let mesh = mesh::bumpy_sphere(2, 7);
    let (rays, primitives) = (rays(500, &mesh.positions), mesh.triangles.len() as u64);
    let shapes = [Arc::new(Geometry::Mesh(TriangleMesh::new(mesh)))];
    let asked = [Method::Brute, Method::Exhaustive].map(|method| {
        let tracer = Tracer::new(shapes.to_vec(), &[0], Vec::new(), method);
        let (mut blocked, mut counts) = (Vec::new(), Counts::default());
        tracer.occluded(&rays, Order::Any, &mut blocked, &mut counts);
        (blocked, counts.primitive_tests)
    });
    assert!(asked[0].0.contains(&true) && asked[0].0 == asked[1].0);
    assert!(asked[0].1 < asked[1].1);
    assert_eq!(asked[1].1, rays.len() as u64 * primitives);
}

#[test]
fn the_work_on_a_tree_changes_no_hit() {
    let mesh = mesh::bumpy_sphere(5, 7);
    let rays = rays(20_000, &mesh.positions);
    let shapes = [Arc::new(Geometry::Mesh(TriangleMesh::new(mesh)))];
    let works = [Build::Quick, Build::Fast, Build::Medium, Build::Slow];
    let found = works.map(|build| {
        let method = Method::Tree;
        let tracer = Tracer::new(
            shapes.to_vec(),
            &[0],
            Vec::new(),
            Recipe {
                method,
                build,
                ..Recipe::default()
            },
        );
        let (mut hits, mut counts) = (Vec::new(), Counts::default());
        tracer.closest(&rays, Order::Any, &mut hits, &mut counts);
        (hits, counts.node_steps)
    });
    assert!(found.iter().all(|(hits, _)| *hits == found[0].0));
    assert!(found[0].1 != found[3].1, "the trees are one");
}

#[test]
fn the_work_on_a_tree_follows_the_rays() {
    let rays = [0, 1_000, 50_000, 200_000, 1_000_000];
    let work = rays.map(|rays| Build::suited(1000, rays));
    use Build::{Fast, Medium, Quick, Slow};
    assert_eq!(work, [Quick, Quick, Fast, Medium, Slow]);
    assert_eq!(Build::suited(0, u64::MAX), Build::Slow);
}

#[test]
fn surfaces_with_equations_are_found_alike_in_the_world_and_in_instances() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("curves.txt");
    let point = |i: u32| {
        let at = Vec3::new(i as f32 * 0.2 - 1.0, uniform(5, i), uniform(6, i)) - Vec3::splat(0.3);
        format!("{} {} {} {}\n", at.x, at.y, at.z, 0.1 * uniform(7, i))
    };
    std::fs::write(&file, (0..12).map(point).collect::<String>()).unwrap();
    let curves = ["bsplinecurve", "linearcurve"].map(|plugin| {
        let file = file.display();
        format!(r#"<shape type="{plugin}"><string name="filename" value="{file}"/></shape>"#)
    });
    let text = r#"<scene version="3.0.0"><shape type="sphere"><float name="radius" value="0.7"/></shape>
        <shape type="disk"/><shape type="cylinder"><float name="radius" value="0.4"/></shape>
        <shape type="plane"><transform name="to_world"><rotate x="1" angle="20"/><translate z="-0.9"/></transform>
        </shape>"#;
    let text = [text, &curves.concat(), "</scene>"].concat();
    let scene = Description::parse(&text, Path::new("test.xml"), &Options::default()).unwrap();
    let build = |p: &Properties<'_>| Arc::new(shape::build(p).unwrap().geometry);
    let shapes: Vec<_> = scene
        .root()
        .children(Kind::Shape)
        .iter()
        .map(build)
        .collect();
    let twice: Vec<_> = shapes.iter().chain(&shapes).cloned().collect();
    let transform = DMat4::from_rotation_x(1.0) * DMat4::from_scale(DVec3::new(1.0, -0.5, 2.0));
    let to_world = Moving::Still(Transform::new(&transform).unwrap());
    let instances = [Instance { to_world, group: 1 }];
    let tracers = all(&twice, &[0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1], &instances);
    let rays = rays(20_000, &[Vec3::ZERO, Vec3::X, Vec3::new(0.0, 0.4, 0.5)]);
    assert!(agree(&tracers, &rays) > 10_000);
    for tracer in &tracers {
        let Bounds { min, max } = tracer.bounds();
        assert!((max - min).max_element() < 3.0, "the plane is left out");
    }
}

#[test]
fn spheres_that_touch_and_coincide_are_found_alike_among_triangles() {
    let sphere = |center: Vec3, radius: f32| {
        let text = format!(
            r#"<scene version="3.0.0"><shape type="sphere"><float name="radius" value="{radius}"/>
            <point name="center" x="{}" y="{}" z="{}"/></shape></scene>"#,
            center.x, center.y, center.z
        );
        let options = Options::default();
        let scene = Description::parse(&text, Path::new("test.xml"), &options).unwrap();
        let children = scene.root().children(Kind::Shape);
        Arc::new(shape::build(&children[0]).unwrap().geometry)
    };
    let scattered =
        (0..40).map(|i| sphere(direction(50, i) * uniform(51, i), 0.3 * uniform(52, i)));
    let mut shapes: Vec<_> = scattered.collect();
    // Ties of spheres with one another and with triangles.
    shapes.extend([
        sphere(Vec3::ZERO, 0.5),
        sphere(Vec3::ZERO, 0.5),
        sphere(Vec3::new(1.0, 0.0, 0.0), 0.5),
        sphere(Vec3::new(0.0, 0.0, 1e4), 1e4),
        sphere(Vec3::new(0.3, 0.0, 0.0), 1e-6),
    ]);
    let meshes = [mesh::rectangle(), mesh::cube(), mesh::bumpy_sphere(2, 5)];
    shapes.extend(meshes.map(|m| Arc::new(Geometry::Mesh(TriangleMesh::new(m)))));
    let tracers = all(&shapes, &vec![0; shapes.len()], &[]);
    let targets = [Vec3::ZERO, Vec3::X * 0.5, Vec3::new(0.3, 0.0, 0.0)];
    assert!(agree(&tracers, &rays(20_000, &targets)) > 15_000);
    assert!(agree(&tracers, &odd_rays()) > 800);
}

#[test]
fn packets_in_small_trees_visit_what_single_rays_visit() {
    for (subdivisions, is_small) in [(1, true), (5, false)] {
        let mesh = mesh::bumpy_sphere(subdivisions, 7);
        let rays = rays(1000, &mesh.positions);
        let shapes = vec![Arc::new(Geometry::Mesh(TriangleMesh::new(mesh)))];
        let mut tracer = Tracer::new(shapes, &[0], Vec::new(), Method::Tree);
        assert_eq!(tracer.is_small, is_small);
        if !is_small {
            continue;
        }
        let [single, packets] = [false, true].map(|is_small| {
            tracer.is_small = is_small;
            let (mut hits, mut blocked) = (Vec::new(), Vec::new());
            let mut counts = [Counts::default(); 2];
            tracer.closest(&rays, Order::Any, &mut hits, &mut counts[0]);
            tracer.occluded(&rays, Order::Any, &mut blocked, &mut counts[1]);
            (hits, blocked, counts)
        });
        assert_eq!(single, packets);
    }
}

#[test]
fn scenes_of_nothing_and_of_one_triangle_can_be_traced() {
    let targets = [Vec3::ZERO];
    assert_eq!(agree(&all(&[], &[], &[]), &rays(100, &targets)), 0);
    let mut one = mesh::rectangle();
    one.triangles.truncate(1);
    let shapes = [one, Mesh::default()].map(|m| Arc::new(Geometry::Mesh(TriangleMesh::new(m))));
    assert!(agree(&all(&shapes, &[0, 0], &[]), &rays(1000, &targets)) > 10);
}

/// Along axes and nearly so, from zero and from far off, with ends and directions of every size.
fn odd_rays() -> Vec<Ray> {
    let numbers = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        1e-30,
        -1e-30,
        1e-42,
        0.3,
        1e6,
        f32::NAN,
        f32::INFINITY,
    ];
    let ends = [f32::INFINITY, 1.0, 0.0, -1.0, 1e-30, f32::NAN];
    let mut rays = Vec::new();
    for i in 0..8000 {
        let pick = |seed: u64| {
            // Mostly numbers that can hit something.
            let count = if uniform(seed + 20, i) < 0.05 {
                numbers.len()
            } else {
                8
            };
            numbers[(uniform(seed, i) * count as f32) as usize]
        };
        rays.push(Ray {
            origin: Vec3::new(pick(10), pick(11), pick(12)),
            direction: Vec3::new(pick(13), pick(14), pick(15)),
            t_max: ends[(uniform(16, i).powi(3) * ends.len() as f32) as usize],
            time: 0.0,
        });
    }
    rays
}

#[test]
fn odd_rays_are_answered_alike_by_all() {
    let sphere = mesh::bumpy_sphere(2, 5);
    let grid: Vec<_> = [sphere, mesh::cube(), mesh::rectangle()]
        .map(|m| Arc::new(Geometry::Mesh(TriangleMesh::new(m))))
        .into();
    let to_world = Transform::new(&DMat4::from_scale(DVec3::new(-1.0, 0.5, 0.25))).unwrap();
    let to_world = Moving::Still(to_world);
    let instances = [Instance { to_world, group: 1 }];
    assert!(agree(&all(&grid, &[0, 0, 1], &instances), &odd_rays()) > 800);
}

#[test]
fn degenerate_triangles_and_sizes_of_all_kinds_are_traced_alike_by_all() {
    let mut soup = Mesh::default();
    for i in 0..2000 {
        let size = 10f32.powi((i % 19) as i32 - 12);
        let centre = direction(40, i) * uniform(41, i);
        let corner = |k: u32| match i % 5 {
            // Points, lines, flat ones, and triangles as they should be.
            0 => centre,
            1 => centre + (k as f32) * size * Vec3::X,
            2 => centre + size * direction(42, 3 * i + k) * Vec3::new(1.0, 1.0, 0.0),
            _ => centre + size * direction(42, 3 * i + k),
        };
        soup.positions.extend([0, 1, 2].map(corner));
        soup.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    let targets = soup.positions.clone();
    for scale in [1e-18, 1.0, 1e15] {
        let mut soup = soup.clone();
        soup.transform(&DMat4::from_scale(DVec3::splat(scale)));
        let rays: Vec<Ray> = (rays(1000, &targets).into_iter())
            .map(|ray| Ray {
                origin: ray.origin * scale as f32,
                ..ray
            })
            .collect();
        let shapes = [Arc::new(Geometry::Mesh(TriangleMesh::new(soup)))];
        assert!(
            agree(&all(&shapes, &[0], &[]), &rays) > 500,
            "scale {scale}"
        );
    }
}

#[test]
fn nested_triangles_by_the_thousand_make_no_deep_tree() {
    let mut nested = Mesh::default();
    for i in 0..20_000 {
        let size = 1.0 + 1e-3 * i as f32;
        nested.positions.extend([
            Vec3::new(-size, -size, 0.0),
            Vec3::new(size, -size, 0.0),
            Vec3::new(size, size, 0.0),
        ]);
        nested.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    let shapes = vec![Arc::new(Geometry::Mesh(TriangleMesh::new(nested)))];
    let tracer = Tracer::new(shapes, &[0], Vec::new(), Method::Tree);
    assert!(tracer.groups[0].tree().levels() < 20);
}

#[test]
fn equal_triangles_by_the_hundred_thousand_build_in_a_moment() {
    let mut mesh = mesh::rectangle();
    mesh.triangles = vec![mesh.triangles[0]; 320_000];
    let shapes = vec![Arc::new(Geometry::Mesh(TriangleMesh::new(mesh)))];
    let tracer = Tracer::new(shapes, &[0], Vec::new(), Method::Tree);
    let ray = Ray {
        origin: Vec3::new(0.5, -0.6, 1.0),
        direction: Vec3::NEG_Z,
        t_max: f32::INFINITY,
        time: 0.0,
    };
    let (mut hits, mut counts) = (Vec::new(), Counts::default());
    tracer.closest(&[ray], Order::Any, &mut hits, &mut counts);
    assert_eq!(hits[0].primitive, 0, "ties go to the lowest primitive");
}

#[test]
fn a_closed_mesh_has_no_hole_at_vertices_and_edges() {
    let mesh = mesh::bumpy_sphere(4, 3);
    let (positions, triangles) = (mesh.positions.clone(), mesh.triangles.clone());
    let tracer = Tracer::new(
        vec![Arc::new(Geometry::Mesh(TriangleMesh::new(mesh)))],
        &[0],
        Vec::new(),
        Method::Tree,
    );
    let n = 2_000_000;
    let rays: Vec<Ray> = (0..n)
        .map(|i| {
            let corners = triangles[i as usize % triangles.len()].map(|v| positions[v as usize]);
            let share = if i % 2 == 0 { 0.0 } else { uniform(5, i) };
            let target = corners[0] + share * (corners[1] - corners[0]);
            let origin = direction(6, i) * 0.1;
            Ray {
                origin,
                direction: (target - origin).normalize(),
                t_max: f32::INFINITY,
                time: 0.0,
            }
        })
        .collect();
    let (mut hits, mut counts) = (Vec::new(), Counts::default());
    tracer.closest(&rays, Order::Any, &mut hits, &mut counts);
    assert_eq!(hits.iter().filter(|h| h.is_miss()).count(), 0);
}

/// Rays that leave a large, nearly flat surface at every angle, at scales from 10⁻⁵ to 10⁵ and away from
/// the origin: the surface must not shadow itself.
#[test]
fn a_ray_never_meets_the_surface_that_it_leaves() {
    for decade in -5..=5 {
        let scale = 10f64.powi(decade);
        for (turn, shift) in [
            (0.0, 0.0),
            (1e-7, 0.0),
            (0.3, 0.0),
            (0.7, 3.0),
            (1e-7, -20.0),
        ] {
            let place = DMat4::from_translation(DVec3::splat(shift * scale))
                * DMat4::from_rotation_x(turn)
                * DMat4::from_rotation_z(turn * 0.7)
                * DMat4::from_scale(DVec3::splat(scale));
            let mut floor = mesh::rectangle();
            floor.transform(&place);
            let shapes = vec![Arc::new(Geometry::Mesh(TriangleMesh::new(floor)))];
            let tracer = Tracer::new(shapes, &[0], Vec::new(), Method::Tree);
            let n = 4000;
            let mut again = 0;
            for i in 0..n {
                let place = Transform::new(&place).unwrap();
                let above = place.point(Vec3::new(uniform(1, i) - 0.5, uniform(2, i) - 0.5, 1.0));
                let down = place.vector(Vec3::NEG_Z).normalize();
                let ray = Ray {
                    origin: above,
                    direction: down,
                    t_max: f32::INFINITY,
                    time: 0.0,
                };
                let (mut hits, mut counts) = (Vec::new(), Counts::default());
                tracer.closest(&[ray], Order::Any, &mut hits, &mut counts);
                assert!(!hits[0].is_miss());
                let at = tracer.interaction(&ray, &hits[0]);
                // Upward, half of them within a thousandth of the horizon.
                let up = Vec3::from(warp::cosine_hemisphere(
                    Vec2::new(uniform(3, i), uniform(4, i)).into(),
                ));
                let up = if i % 2 == 0 {
                    up
                } else {
                    Vec3::new(up.x, up.y, 1e-3 * up.z).normalize()
                };
                let leaving = at.spawn(at.frame.to_world(up));
                tracer.closest(&[leaving], Order::Any, &mut hits, &mut counts);
                again += usize::from(!hits[0].is_miss());
            }
            assert_eq!(again, 0, "scale 1e{decade}, turn {turn}, shift {shift}");
        }
    }
}
