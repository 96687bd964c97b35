//! Meshes without a file: Mitsuba's `rectangle` and `cube`, a parametrised sphere, a grid of heights, and of
//! any size, a closed bumpy sphere, a terrain, hair, a sphere flake, a Menger sponge, and balls, blocks and bumps.

mod flake;
mod hair;
mod menger;
mod noise;
mod shapes;
mod terrain;

use std::collections::HashMap;
use std::f64::consts::PI;

use glam::{DVec2, DVec3, Vec2, Vec3};
use rand::RngExt;

pub use flake::{flake, flake_balls, flake_scene};
pub use hair::hair;
pub use menger::{menger, menger_triangles};
pub use shapes::{Bumps, add_bumps, ball, block};
pub use terrain::terrain;

use super::Mesh;
use crate::math::random;

/// [−1, 1]² at z = 0, facing +Z, with uv = (p + 1) / 2: two triangles.
pub fn rectangle() -> Mesh {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(Vec2::from);
    Mesh {
        positions: corners.map(|p| p.extend(0.0)).to_vec(),
        normals: vec![Vec3::Z; 4],
        uvs: corners.map(|p| 0.5 * (p + 1.0)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// [−1, 1]³ with 24 vertices, a normal and a uv square a face: the arrays of Mitsuba's `cube`.
pub fn cube() -> Mesh {
    // The outward normal and the directions of growing u and v.
    const FACES: [[Vec3; 3]; 6] = [
        [Vec3::NEG_Y, Vec3::Z, Vec3::X],
        [Vec3::Y, Vec3::NEG_X, Vec3::NEG_Z],
        [Vec3::X, Vec3::Y, Vec3::NEG_Z],
        [Vec3::Z, Vec3::Y, Vec3::X],
        [Vec3::NEG_X, Vec3::Y, Vec3::Z],
        [Vec3::NEG_Z, Vec3::NEG_Y, Vec3::X],
    ];
    const UVS: [Vec2; 4] = [Vec2::Y, Vec2::ONE, Vec2::X, Vec2::ZERO];
    let mut mesh = Mesh::default();
    for (first, [normal, u, v]) in (0..).step_by(4).zip(FACES) {
        for uv in UVS {
            let square = 2.0 * uv - 1.0;
            mesh.positions.push(normal + square.x * u + square.y * v);
            mesh.normals.push(normal);
            mesh.uvs.push(uv);
        }
        mesh.triangles
            .extend([[first, first + 1, first + 2], [first + 3, first, first + 2]]);
    }
    mesh
}

/// The unit sphere, `around` cells along u = φ/2π (at least 3) and `down` along v = θ/π from +Z (at least
/// 2), with exact normals. The seam and the poles have vertices of their own for each u.
pub fn sphere(around: u32, down: u32) -> Mesh {
    let (around, down) = (around.max(3), down.max(2));
    let mut mesh = patch(around, down, |uv| {
        // At the seam and at the lower pole the same places, to the bit.
        let (sin_phi, cos_phi) = (2.0 * PI * uv.x.fract()).sin_cos();
        let (sin_theta, cos_theta) = (PI * uv.y).sin_cos();
        let sin_theta = if uv.y < 1.0 { sin_theta } else { 0.0 };
        DVec3::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
    });
    // Of a cell at a pole one triangle has no area, and v runs down: the outside is on the other side.
    mesh.triangles.retain(|t| {
        let row = |i: u32| i / (around + 1);
        let pole = |i: u32| row(i) == 0 || row(i) == down;
        t.iter().filter(|&&i| pole(i)).count() < 2
    });
    mesh.flip_normals();
    mesh.normals = mesh
        .positions
        .iter()
        .map(|p| p.normalize_or(Vec3::Z))
        .collect();
    mesh
}

/// [−1, 1]² seen from +Z, of `columns` × `rows` cells (at least 1) of two triangles, with uv = (p + 1) / 2
/// and z = `height` of x and y. Its normals are left to be computed.
pub fn grid(columns: u32, rows: u32, height: impl Fn(f64, f64) -> f64) -> Mesh {
    patch(columns.max(1), rows.max(1), |uv| {
        let p = 2.0 * uv - 1.0;
        p.extend(height(p.x, p.y))
    })
}

/// A closed surface around the origin, about the unit sphere: an icosahedron of which each triangle is cut
/// in four `subdivisions` times (20 · 4ⁿ triangles; at most 12), its vertices moved along the radius by
/// smooth waves that `seed` chooses. No texture coordinates; its normals are left to be computed.
pub fn bumpy_sphere(subdivisions: u32, seed: u64) -> Mesh {
    let (mut directions, mut triangles) = icosahedron();
    for _ in 0..subdivisions.min(12) {
        (directions, triangles) = subdivide(directions, &triangles);
    }
    let waves = Wave::all(seed);
    let displaced = |d: &DVec3| {
        let radius = 1.0 + waves.iter().map(|w| w.at(*d)).sum::<f64>();
        (*d * radius).as_vec3()
    };
    Mesh {
        positions: directions.iter().map(displaced).collect(),
        triangles,
        ..Mesh::default()
    }
}

/// A grid over [0, 1]² mapped by `place`; counter-clockwise in (u, v).
fn patch(columns: u32, rows: u32, place: impl Fn(DVec2) -> DVec3) -> Mesh {
    let mut mesh = Mesh::default();
    for row in 0..=rows {
        for column in 0..=columns {
            let uv = DVec2::new(
                f64::from(column) / f64::from(columns),
                f64::from(row) / f64::from(rows),
            );
            mesh.positions.push(place(uv).as_vec3());
            mesh.uvs.push(uv.as_vec2());
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let a = row * (columns + 1) + column;
            let b = a + columns + 1;
            mesh.triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
        }
    }
    mesh
}

fn icosahedron() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let golden = (1.0 + 5_f64.sqrt()) / 2.0;
    let mut corners = Vec::new();
    for (a, b) in [
        (-1.0, golden),
        (1.0, golden),
        (-1.0, -golden),
        (1.0, -golden),
    ] {
        corners.extend([
            DVec3::new(a, b, 0.0),
            DVec3::new(0.0, a, b),
            DVec3::new(b, 0.0, a),
        ]);
    }
    // Its triangles are the triples of corners that are all neighbours, at distance 2.
    let near = |i: usize, j: usize| (corners[i].distance(corners[j]) - 2.0).abs() < 1e-9;
    let mut triangles = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if near(i, j) && near(j, k) && near(k, i) {
                    let outside = corners[i].dot(corners[j].cross(corners[k])) > 0.0;
                    let [j, k] = if outside { [j, k] } else { [k, j] };
                    triangles.push([i, j, k].map(|i| i as u32));
                }
            }
        }
    }
    (
        corners.into_iter().map(DVec3::normalize).collect(),
        triangles,
    )
}

fn subdivide(mut directions: Vec<DVec3>, triangles: &[[u32; 3]]) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut middles = HashMap::new();
    let mut finer = Vec::with_capacity(4 * triangles.len());
    for &[a, b, c] in triangles {
        let mut middle = |i: u32, j: u32| {
            *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                directions.push((directions[i as usize] + directions[j as usize]).normalize());
                directions.len() as u32 - 1
            })
        };
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        finer.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
    }
    (directions, finer)
}

/// A plane wave on the sphere's directions.
struct Wave {
    /// Radians a unit.
    vector: DVec3,
    phase: f64,
    amplitude: f64,
}

impl Wave {
    /// Twelve waves of growing frequency, with amplitudes that add up to less than a half.
    fn all(seed: u64) -> Vec<Self> {
        let mut numbers = random::Sequence::new(seed);
        let mut random = || numbers.random_range(-1.0..1.0);
        let wave = |i: i32| {
            let frequency = 2.0 * 1.4_f64.powi(i);
            Self {
                vector: DVec3::new(random(), random(), random()) * frequency,
                phase: PI * random(),
                amplitude: 0.2 / frequency,
            }
        };
        (0..12).map(wave).collect()
    }

    fn at(&self, direction: DVec3) -> f64 {
        self.amplitude * (self.vector.dot(direction) + self.phase).sin()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How many triangles border each directed edge, by the positions of its ends.
    fn is_closed(mesh: &Mesh) -> bool {
        let mut edges: HashMap<[[u32; 3]; 2], i32> = HashMap::new();
        let key = |i: u32| mesh.positions[i as usize].to_array().map(f32::to_bits);
        for t in &mesh.triangles {
            for i in 0..3 {
                let (a, b) = (key(t[i]), key(t[(i + 1) % 3]));
                *edges.entry([a, b]).or_default() += 1;
                *edges.entry([b, a]).or_default() -= 1;
            }
        }
        edges.values().all(|&n| n == 0)
    }

    fn volume(mesh: &Mesh) -> f64 {
        let six = mesh.triangles.iter().map(|t| {
            let [a, b, c] = mesh.corners(t).map(Vec3::as_dvec3);
            a.dot(b.cross(c))
        });
        six.sum::<f64>() / 6.0
    }

    #[test]
    fn the_cube_is_the_one_that_mitsuba_gives() {
        let cube = cube();
        let mitsuba = [
            [1, -1, -1],
            [1, -1, 1],
            [-1, -1, 1],
            [-1, -1, -1],
            [1, 1, -1],
            [-1, 1, -1],
            [-1, 1, 1],
            [1, 1, 1],
            [1, -1, -1],
            [1, 1, -1],
            [1, 1, 1],
            [1, -1, 1],
            [1, -1, 1],
            [1, 1, 1],
            [-1, 1, 1],
            [-1, -1, 1],
            [-1, -1, 1],
            [-1, 1, 1],
            [-1, 1, -1],
            [-1, -1, -1],
            [1, 1, -1],
            [1, -1, -1],
            [-1, -1, -1],
            [-1, 1, -1],
        ];
        let mitsuba = mitsuba.map(|p| Vec3::from_array(p.map(|x| x as f32)));
        assert_eq!(cube.positions, mitsuba);
        assert_eq!(
            cube.uvs[..4],
            [Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::X, Vec2::ZERO]
        );
        assert_eq!(
            cube.triangles[..4],
            [[0, 1, 2], [3, 0, 2], [4, 5, 6], [7, 4, 6]]
        );
        assert_eq!((cube.area(), volume(&cube)), (24.0, 8.0));
        assert!(is_closed(&cube));
        for t in &cube.triangles {
            let normal = super::super::normals::face_normal(cube.corners(t));
            assert_eq!(normal, cube.normals[t[0] as usize]);
        }
    }

    #[test]
    fn the_rectangle_and_the_grid_face_up_with_matching_texture_coordinates() {
        for mesh in [rectangle(), grid(7, 3, |_, _| 0.0)] {
            assert!((mesh.area() - 4.0).abs() < 1e-6);
            for (p, uv) in mesh.positions.iter().zip(&mesh.uvs) {
                assert!(uv.distance(0.5 * (p.truncate() + 1.0)) < 1e-6);
            }
            for t in &mesh.triangles {
                assert_eq!(super::super::normals::face_normal(mesh.corners(t)), Vec3::Z);
            }
        }
        assert_eq!(
            grid(7, 3, |x, y| x * y).bounds(),
            Some((Vec3::NEG_ONE, Vec3::ONE))
        );
    }

    #[test]
    fn the_sphere_is_round_and_looks_outwards() {
        let sphere = sphere(128, 64);
        assert_eq!(sphere.triangles.len(), 2 * 128 * 63);
        assert!((sphere.area() / (4.0 * PI) - 1.0).abs() < 2e-3);
        assert!((volume(&sphere) / (4.0 * PI / 3.0) - 1.0).abs() < 3e-3);
        for t in &sphere.triangles {
            let normal = super::super::normals::face_normal(sphere.corners(t));
            assert!(normal.dot(sphere.normals[t[0] as usize]) > 0.99);
        }
        let quarter = sphere
            .uvs
            .iter()
            .position(|uv| *uv == Vec2::new(0.25, 0.5))
            .unwrap();
        assert!(sphere.positions[quarter].distance(Vec3::Y) < 1e-6);
    }

    #[test]
    fn bumpy_spheres_are_closed_and_differ_by_seed() {
        for subdivisions in [0, 3] {
            let mesh = bumpy_sphere(subdivisions, 7);
            let count = 20 << (2 * subdivisions);
            assert_eq!(mesh.triangles.len(), count);
            assert_eq!(mesh.positions.len(), count / 2 + 2);
            assert!(is_closed(&mesh) && volume(&mesh) > 0.0);
            assert!(
                mesh.positions
                    .iter()
                    .all(|p| (0.4..1.6).contains(&p.length()))
            );
            assert_ne!(mesh, bumpy_sphere(subdivisions, 8));
        }
    }
}
