//! Which triangles of a run may have samples. Of a mesh that is finer than the picture most lie between samples, and nothing
//! need be set up to see that: the pixels that the box around a triangle begins and ends in have no sample between them.

use super::setup::Reach;
use crate::lanes::{Lanes, Task};

/// Finds the triangles of a run that may have samples, or have to be cut.
pub(super) struct Sift<'a> {
    pub(super) reaches: &'a [Reach],
    /// Of corners among these.
    pub(super) triangles: &'a [[u32; 3]],
    /// What is taken from their indices.
    pub(super) first: u32,
    /// Where the places within the run go of those that are found; as many as there are triangles.
    pub(super) found: &'a mut [u32],
}

impl Task for Sift<'_> {
    /// How many there are.
    type Output = usize;

    /// Without lanes, which would have to gather: a register holds a corner's four numbers.
    #[inline(always)]
    fn run<F: Lanes>(self) -> usize {
        let mut count = 0;
        for (place, triangle) in (0..).zip(self.triangles) {
            let [i, j, k] = *triangle;
            let a = &self.reaches[(i - self.first) as usize];
            let b = &self.reaches[(j - self.first) as usize];
            let c = &self.reaches[(k - self.first) as usize];
            let mut least = [0; 4];
            for axis in 0..4 {
                least[axis] = a[axis].min(b[axis]).min(c[axis]);
            }
            let meets = (least[0] + least[2] <= 0) & (least[1] + least[3] <= 0);
            // All are written, and those that are not kept written over.
            self.found[count] = place;
            count += usize::from(meets);
        }
        count
    }
}

#[cfg(test)]
mod tests {
    use super::super::Pattern;
    use super::super::pattern::COUNTS;
    use super::super::setup::{Corner, Grid};
    use super::*;
    use crate::lanes::Kernel;
    use crate::math::random;
    use crate::sensor::Window;

    #[test]
    fn what_is_sifted_out_has_no_samples_and_the_rest_may_have() {
        let window = Window {
            x: 20,
            y: 10,
            width: 30,
            height: 25,
        };
        for samples in COUNTS {
            let grid = Grid::new([80, 60], &window, &Pattern::of(samples).unwrap());
            // Small triangles in and around the window, some with a corner that lies anywhere.
            let corner = |i: u32| match i % 97 {
                96 => Corner::outside(1),
                _ => {
                    let [x, y] = [0, 1].map(|axis| {
                        let unit = |n: u64, key: u32| random::unit(random::bits(n, 2 * key + axis));
                        let near = unit(1, i / 3) * 40.0 - 5.0 + unit(2, i) * 1.5;
                        (f64::from(near) * grid.scale()) as i32
                    });
                    Corner { x, y }
                }
            };
            let corners: Vec<Corner> = (0..3000).map(corner).collect();
            let reach = |corner: &Corner| match corner.beyond() != 0 {
                true => Grid::EVERYWHERE,
                false => grid.reach(corner),
            };
            let reaches: Vec<Reach> = corners.iter().map(reach).collect();
            let first = 7;
            let of = |i: u32| [3 * i, 3 * i + 2, 3 * i + 1].map(|corner| corner + first);
            let triangles: Vec<[u32; 3]> = (0..1000).map(of).collect();
            let may_have = |triangle: &[u32; 3]| {
                let three = triangle.map(|i| corners[(i - first) as usize]);
                three.iter().any(|corner| corner.beyond() != 0) || grid.triangle(three).is_some()
            };
            let places = (0..).zip(&triangles);
            let expected: Vec<u32> = places
                .filter_map(|(place, triangle)| may_have(triangle).then_some(place))
                .collect();
            assert!((200..900).contains(&expected.len()), "{}", expected.len());
            for kernel in Kernel::all() {
                let mut found = vec![0; triangles.len()];
                let count = kernel.run(Sift {
                    reaches: &reaches,
                    triangles: &triangles,
                    first,
                    found: &mut found,
                });
                assert_eq!(found[..count], expected, "{samples} {}", kernel.name());
            }
        }
    }
}
