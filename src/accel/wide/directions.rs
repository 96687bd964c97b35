//! Rays sorted by their directions, so that those of a packet see boxes from the same side and triangles along the same
//! axis, however mixed they come.

use crate::accel::triangle::GREATEST;
use crate::interaction::Ray;

/// Octants, each with the axis along which a ray mostly goes.
const KINDS: usize = 8 * 3;

/// The octant of a ray's direction, a bit an axis along which it goes backwards.
#[inline(always)]
pub(super) fn octant(ray: &Ray) -> usize {
    ray.direction.is_negative_bitmask() as usize
}

/// The kind of a ray's direction.
#[inline(always)]
fn kind(ray: &Ray) -> u8 {
    let [a, b, c] = ray.direction.abs().to_array();
    // Looked up, not branched on: nobody can foretell it.
    let axis = GREATEST[usize::from(a > b) | usize::from(a > c) << 1 | usize::from(b > c) << 2];
    (octant(ray) * 3 + axis) as u8
}

/// The indices of rays by the kinds of their directions, octant by octant; those of one kind in their order.
pub(super) fn sorted(rays: &[Ray]) -> Vec<u32> {
    let kinds: Vec<u8> = rays.iter().map(kind).collect();
    let mut next = [0_u32; KINDS];
    for kind in &kinds {
        next[usize::from(*kind)] += 1;
    }
    let mut before = 0;
    for next in &mut next {
        (*next, before) = (before, before + *next);
    }
    let mut indices = vec![0; rays.len()];
    for (index, kind) in (0..).zip(kinds) {
        let next = &mut next[usize::from(kind)];
        indices[*next as usize] = index;
        *next += 1;
    }
    indices
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn rays_of_a_kind_stand_together_and_none_is_lost() {
        let directions = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::new(3.0, 1.0, 2.0)];
        let ray = |i: usize| Ray {
            origin: Vec3::ZERO,
            direction: directions[i * 7 % 5 % directions.len()],
            t_max: 1.0,
            time: 0.0,
        };
        let rays: Vec<Ray> = (0..100).map(ray).collect();
        let sorted = sorted(&rays);
        let kinds: Vec<u8> = sorted.iter().map(|i| kind(&rays[*i as usize])).collect();
        assert!(kinds.is_sorted());
        let mut all = sorted.clone();
        all.sort_unstable();
        assert_eq!(all, (0..100).collect::<Vec<_>>());
        let pairs = sorted.windows(2).zip(kinds.windows(2));
        assert!(
            pairs
                .filter(|(_, kinds)| kinds[0] == kinds[1])
                .all(|(indices, _)| indices[0] < indices[1])
        );
    }
}
