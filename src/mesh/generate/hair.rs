//! Hair-like ribbons: long, thin and curled triangles whose boxes overlap everywhere, a bad day for any tree
//! over boxes. A strand walks from a ball's surface outward, its direction turned a little at random at each
//! step, and carries its width along.

use std::array::from_fn;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::math::{Frame, random};
use crate::mesh::Mesh;

/// Pieces of a strand, of two triangles each.
const SEGMENTS: usize = 16;
/// Of a segment; the ball that the hair grows on has radius 1.
const LENGTH: f32 = 0.3;
/// Of a ribbon, from its middle line.
const HALF_WIDTH: f32 = 0.0035;
/// How far a segment's direction leaves that of the one before.
const CURL: f32 = 0.25;

const VERTICES: usize = 2 * (SEGMENTS + 1);

/// About `triangles` triangles (a strand has 32; at least one strand) of flat strands, 0.007 wide and 4.8 long,
/// that stand at random on the unit sphere, without it. `seed` chooses them. No texture
/// coordinates; its normals are left to be computed. 25 bytes of memory a triangle.
pub fn hair(triangles: u32, seed: u64) -> Mesh {
    let strands = (f64::from(triangles) / (2 * SEGMENTS) as f64)
        .round()
        .max(1.0) as usize;
    let mut positions = vec![Vec3::ZERO; strands * VERTICES];
    (positions.par_chunks_exact_mut(VERTICES).enumerate())
        .for_each(|(i, strand)| grow(strand, random::key(seed, i as u64)));
    let quads = (0..strands).flat_map(|strand| {
        (0..SEGMENTS).flat_map(move |segment| {
            let a = (strand * VERTICES + 2 * segment) as u32;
            [[a, a + 1, a + 2], [a + 1, a + 3, a + 2]]
        })
    });
    Mesh {
        positions,
        triangles: quads.collect(),
        ..Mesh::default()
    }
}

/// Places a strand's vertices: left and right of its middle line, from the root on.
fn grow(vertices: &mut [Vec3], key: u64) {
    let mut numbers = (0..).map(|i| random::unit(random::bits(key, i)));
    let mut next = || numbers.next().unwrap_or_default();
    let mut direction = on_sphere(&mut next);
    let mut middle = direction;
    let mut width = on_sphere(&mut next);
    for pair in vertices.chunks_exact_mut(2) {
        // At right angles to the strand, as near to the width before as that allows.
        width = Frame::along(direction, width).s * HALF_WIDTH;
        pair.copy_from_slice(&[middle - width, middle + width]);
        middle += LENGTH * direction;
        let turn = Vec3::from_array(from_fn(|_| 2.0 * next() - 1.0));
        direction = (direction + CURL * turn).normalize();
    }
}

/// A direction, uniformly (Marsaglia, *Choosing a point from the surface of a sphere*, 1972): it needs no sine, of which
/// every system has another.
fn on_sphere(next: &mut impl FnMut() -> f32) -> Vec3 {
    loop {
        let p = 2.0 * Vec2::new(next(), next()) - 1.0;
        let squared = p.length_squared();
        if squared < 1.0 {
            return (2.0 * (1.0 - squared).sqrt() * p).extend(1.0 - 2.0 * squared);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hair_has_about_as_many_triangles_as_wanted_all_long_and_thin() {
        for wanted in [0, 32, 1_000, 40_000] {
            let mesh = hair(wanted, 1);
            assert!(mesh.triangles.len().abs_diff(wanted as usize) <= 32);
            assert_eq!(mesh.positions.len() % VERTICES, 0);
            for t in &mesh.triangles {
                let [a, b, c] = mesh.corners(t);
                let sides = [a.distance(b), b.distance(c), c.distance(a)];
                let long = sides.into_iter().fold(0.0, f32::max);
                let area = 0.5 * (b - a).cross(c - a).length();
                assert!((0.28..0.32).contains(&long), "{long}");
                assert!(
                    (0.7..1.3).contains(&(area / (LENGTH * HALF_WIDTH))),
                    "{area}"
                );
            }
        }
    }

    #[test]
    fn strands_begin_on_the_unit_sphere_and_stay_within_their_length() {
        let mesh = hair(20_000, 2);
        for strand in mesh.positions.chunks_exact(VERTICES) {
            assert!((strand[0].midpoint(strand[1]).length() - 1.0).abs() < 1e-5);
            for p in strand {
                assert!(p.is_finite() && p.length() < 1.01 + LENGTH * SEGMENTS as f32);
            }
        }
    }

    #[test]
    fn a_seed_gives_one_head_of_hair() {
        assert_eq!(hair(5_000, 7), hair(5_000, 7));
        assert_ne!(hair(5_000, 7), hair(5_000, 8));
    }
}
