//! A fractal landscape of any size: h(p) = Σᵢ 2⁻ⁱ noise(2ⁱ Rⁱ p), fractional Brownian motion in octaves of value
//! noise (Musgrave, Kolb and Mace, *The synthesis and rendering of eroded fractal terrains*, 1989), interpolated
//! with Perlin's quintic (*Improving noise*, 2002). R turns each octave, so that no two lattices are aligned.

use glam::{DMat2, DVec2};
use rayon::prelude::*;

use crate::math::random;
use crate::mesh::Mesh;

/// The height of the first octave, from its mean.
const AMPLITUDE: f64 = 0.2;
/// Lattice cells of the first octave in a unit of length.
const FREQUENCY: f64 = 2.0;
/// By 0.6 rad from one octave to the next. Not computed, for no two systems have the same cosine.
const TURN: DMat2 = DMat2::from_cols_array(&[
    0.825_335_614_909_678_3,
    0.564_642_473_395_035_4,
    -0.564_642_473_395_035_4,
    0.825_335_614_909_678_3,
]);

/// Hills over [−1, 1]², seen from +Z, with heights z in ±0.4: a square grid of about `triangles` triangles (two a
/// cell; at least one cell), whose smallest hills are a few cells wide. `seed` chooses the hills. No
/// texture coordinates; its normals are left to be computed. 18 bytes of memory a triangle.
pub fn terrain(triangles: u32, seed: u64) -> Mesh {
    let cells = (f64::from(triangles) / 2.0).sqrt().round().max(1.0) as u32;
    // Octaves down to four cells a lattice cell: finer ones would be steps between neighbours.
    let octaves = f64::from(cells / 8).max(1.0).log2() as u64 + 1;
    let keys: Vec<u64> = (0..octaves).map(|i| random::key(seed, i)).collect();
    let vertices = cells + 1;
    let at = |i: u32| 2.0 * f64::from(i) / f64::from(cells) - 1.0;
    let place = |index: u32| {
        let p = DVec2::new(at(index % vertices), at(index / vertices));
        p.extend(height(p, &keys)).as_vec3()
    };
    let cell = |index: u32| {
        let a = index / cells * vertices + index % cells;
        let b = a + vertices;
        [[a, a + 1, b + 1], [a, b + 1, b]]
    };
    Mesh {
        positions: (0..vertices * vertices)
            .into_par_iter()
            .map(place)
            .collect(),
        triangles: flat(cells * cells, cell),
        ..Mesh::default()
    }
}

/// The triangles of all cells, in the cells' order.
fn flat(cells: u32, cell: impl Fn(u32) -> [[u32; 3]; 2] + Sync) -> Vec<[u32; 3]> {
    let mut triangles = vec![[0; 3]; 2 * cells as usize];
    (triangles.par_chunks_exact_mut(2).zip(0..cells)).for_each(|(two, i)| {
        two.copy_from_slice(&cell(i));
    });
    triangles
}

fn height(p: DVec2, keys: &[u64]) -> f64 {
    let turn_and_shrink = 2.0 * TURN;
    let (mut sum, mut amplitude, mut p) = (0.0, AMPLITUDE, FREQUENCY * p);
    for &key in keys {
        sum += amplitude * noise(p, key);
        amplitude *= 0.5;
        p = turn_and_shrink * p;
    }
    sum
}

/// In [−1, 1]: random at whole numbers, and between them smooth to the second derivative.
fn noise(p: DVec2, key: u64) -> f64 {
    let corner = p.floor();
    let f = p - corner;
    let weight = f * f * f * (f * (6.0 * f - 15.0) + 10.0);
    let (x, y) = (corner.x as i32, corner.y as i32);
    let value = |x: i32, y: i32| {
        let bits = random::mix(key ^ (u64::from(x as u32) << 32 | u64::from(y as u32)));
        2.0 * f64::from(random::unit(bits)) - 1.0
    };
    let mix = |a: f64, b: f64, w: f64| a + w * (b - a);
    mix(
        mix(value(x, y), value(x + 1, y), weight.x),
        mix(value(x, y + 1), value(x + 1, y + 1), weight.x),
        weight.y,
    )
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn terrains_have_about_as_many_triangles_as_wanted() {
        for wanted in [0, 1, 2, 50, 12_345, 100_000] {
            let mesh = terrain(wanted, 1);
            let (count, wanted) = (mesh.triangles.len() as f64, f64::from(wanted.max(2)));
            assert!(
                (count - wanted).abs() <= 2.0 * (2.0 * wanted).sqrt(),
                "{count}"
            );
            assert_eq!(
                mesh.positions.len() as f64,
                ((count / 2.0).sqrt() + 1.0).powi(2)
            );
        }
    }

    #[test]
    fn terrains_are_one_sheet_with_hills_that_looks_up() {
        let mesh = terrain(20_000, 3);
        let (low, high) = mesh.bounds().unwrap();
        assert_eq!(
            (low.truncate(), high.truncate()),
            (-glam::Vec2::ONE, glam::Vec2::ONE)
        );
        assert!(low.z >= -0.4 && high.z <= 0.4 && high.z - low.z > 0.2);
        let mut flat = 0.0;
        for t in &mesh.triangles {
            let [a, b, c] = mesh.corners(t);
            let up = (b - a).cross(c - a).dot(Vec3::Z);
            assert!(up > 0.0);
            flat += up / 2.0;
        }
        assert!((flat - 4.0).abs() < 1e-3);
        // Neighbours are near each other: the surface has no steps.
        let steepest = |t: &[u32; 3]| {
            let heights = mesh.corners(t).map(|p| p.z);
            heights[0].max(heights[1]).max(heights[2]) - heights[0].min(heights[1]).min(heights[2])
        };
        assert!(mesh.triangles.iter().map(steepest).fold(0.0, f32::max) < 0.1);
    }

    #[test]
    fn a_seed_gives_one_terrain() {
        assert_eq!(terrain(5_000, 7), terrain(5_000, 7));
        assert_ne!(terrain(5_000, 7), terrain(5_000, 8));
    }
}
