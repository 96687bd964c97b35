//! Menger's sponge (*Allgemeine Räume und Cartesische Räume*, 1926): a cube cut in 27 of which the middle one and the
//! six in the middles of the sides are taken out, the twenty others cut in the same way, and so on. A surface of all but
//! endless area around next to no volume, with 2·20ⁿ + 4·8ⁿ little squares, in many narrow shafts.

use glam::{UVec3, Vec3};
use rayon::prelude::*;

use crate::mesh::Mesh;

/// Triangles of a sponge of that level; `None` beyond 64 bits.
pub fn menger_triangles(level: u32) -> Option<u64> {
    let squares = 20_u64.checked_pow(level)?.checked_mul(2)?;
    let squares = squares.checked_add(8_u64.checked_pow(level)?.checked_mul(4)?)?;
    squares.checked_mul(2)
}

/// The sponge [−1, 1]³ of that level, at most 6: level 0 is the cube. Closed, with shared vertices, without texture
/// coordinates or normals, for faces are flat. 30 bytes of memory a triangle.
///
/// # Panics
/// Beyond level 6, whose vertices are the last that 32 bits number.
pub fn menger(level: u32) -> Mesh {
    assert!(level <= 6, "32 bits do not number the corners");
    let side = 3_u32.pow(level);
    // Slice by slice along z: for each side the squares where it is solid here and not there.
    let slices: Vec<Vec<[u32; 4]>> = (0..side).into_par_iter().map(|z| slice(z, side)).collect();
    let corners = (side as usize + 1).pow(3);
    let mut used = vec![0_u64; corners.div_ceil(64)];
    for corner in slices.iter().flatten().flatten() {
        used[*corner as usize / 64] |= 1 << (corner % 64);
    }
    // How many are used before each word.
    let before: Vec<u32> = (used.iter())
        .scan(0, |sum, word| {
            let before = *sum;
            *sum += word.count_ones();
            Some(before)
        })
        .collect();
    let rank = |corner: u32| {
        let (word, bit) = (corner as usize / 64, corner % 64);
        before[word] + (used[word] & ((1 << bit) - 1)).count_ones()
    };
    let row = side + 1;
    let positions = used.iter().zip(0_u32..).flat_map(|(&word, i)| {
        let bits = (0..64).filter(move |bit| word >> bit & 1 == 1);
        bits.map(move |bit| {
            let corner = 64 * i + bit;
            let at = UVec3::new(corner % row, corner / row % row, corner / row / row);
            // Symmetric to the bit.
            (2 * at.as_ivec3() - side as i32).as_vec3() / side as f32
        })
    });
    let positions: Vec<Vec3> = positions.collect();
    let mut triangles = Vec::with_capacity(2 * slices.iter().map(Vec::len).sum::<usize>());
    for slice in slices {
        triangles.extend(slice.iter().flat_map(|square| {
            let [a, b, c, d] = square.map(rank);
            [[a, b, c], [a, c, d]]
        }));
    }
    Mesh {
        positions,
        triangles,
        ..Mesh::default()
    }
}

/// The squares around the little cubes at height `z`, by the numbers of their corners, counter-clockwise from outside.
fn slice(z: u32, side: u32) -> Vec<[u32; 4]> {
    let row = side + 1;
    let mut squares = Vec::new();
    for y in 0..side {
        for x in 0..side {
            if !solid([x, y, z], side) {
                continue;
            }
            for axis in 0..3 {
                for step in [0, 1] {
                    let mut beside = [x, y, z];
                    // Below 0 is far outside.
                    beside[axis] = beside[axis].wrapping_add(2 * step).wrapping_sub(1);
                    if solid(beside, side) {
                        continue;
                    }
                    let [i, j] = [(axis + 1) % 3, (axis + 2) % 3];
                    let corner = |along: u32, up: u32| {
                        let mut at = [x, y, z];
                        at[axis] += step;
                        at[i] += along;
                        at[j] += up;
                        at[0] + row * (at[1] + row * at[2])
                    };
                    let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                    squares.push(if step == 1 {
                        [a, b, c, d]
                    } else {
                        [a, d, c, b]
                    });
                }
            }
        }
    }
    squares
}

/// Whether a little cube is there: at no scale two of its digits in base 3 are 1.
fn solid(mut at: [u32; 3], side: u32) -> bool {
    if at.iter().any(|c| *c >= side) {
        return false;
    }
    while at != [0; 3] {
        if at.iter().filter(|c| **c % 3 == 1).count() > 1 {
            return false;
        }
        at = at.map(|c| c / 3);
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Report;

    #[test]
    fn sponges_have_the_area_the_volume_and_the_holes_of_a_sponge() {
        for level in 0..=3 {
            let report = Report::of(&menger(level));
            assert_eq!(report.triangles as u64, menger_triangles(level).unwrap());
            assert!(report.closed && report.components == 1);
            let n = level as i32;
            let volume = 8.0 * (20.0_f64 / 27.0).powi(n);
            assert!((report.volume.unwrap() / volume - 1.0).abs() < 1e-6);
            let area = 4.0 * (2.0 * (20.0_f64 / 9.0).powi(n) + 4.0 * (8.0_f64 / 9.0).powi(n));
            assert!((report.area / area - 1.0).abs() < 1e-6, "{}", report.area);
            // Handles (OEIS A135918).
            let genus = [0, 5, 81, 1409][level as usize];
            assert_eq!(report.euler_characteristic, 2 - 2 * genus);
            assert_eq!(
                (report.degenerate_triangles, report.unreferenced_vertices),
                (0, 0)
            );
        }
        assert_eq!(menger_triangles(0), Some(12));
        assert_eq!(menger_triangles(60), None);
    }
}
