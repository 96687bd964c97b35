//! Which vertices stand at one place: files repeat a vertex where its normal or its texture coordinates differ on two
//! sides, and a surface is whole there nevertheless. Places are the same where their coordinates are equal, to the bit
//! (−0 is 0).

use glam::Vec3;
use rayon::prelude::*;

use super::GRAIN;

/// For each vertex the first vertex at its place.
pub(super) fn first_at_place(positions: &[Vec3]) -> Vec<u32> {
    // Coordinates above the index: equal places are neighbours, the first vertex first.
    let mut keys: Vec<u128> = (positions.par_iter().with_min_len(GRAIN).enumerate())
        .map(|(i, p)| {
            let [x, y, z] = (*p + 0.0).to_array().map(|c| u128::from(c.to_bits()));
            x << 96 | y << 64 | z << 32 | i as u128
        })
        .collect();
    keys.par_sort_unstable();
    let mut first = vec![0; positions.len()];
    for place in keys.chunk_by(|a, b| a >> 32 == b >> 32) {
        for key in place {
            first[*key as u32 as usize] = place[0] as u32;
        }
    }
    first
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_at_one_place_share_the_first_of_them() {
        let (a, b) = (Vec3::new(0.0, -1.0, 2.0), Vec3::new(0.0, -1.0, 2.0000002));
        let positions = [b, a, Vec3::new(-0.0, -1.0, 2.0), b, Vec3::NAN, Vec3::ZERO];
        assert_eq!(first_at_place(&positions), [0, 1, 1, 0, 4, 5]);
        assert!(first_at_place(&[]).is_empty());
    }
}
