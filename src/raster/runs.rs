//! Triangles by runs, each of which a task takes: which corners they have, and a box around them, so that a run that is not in
//! a picture is passed over. They are small enough for their corners to stay in a processor's cache.

use std::ops::RangeInclusive;

use glam::Vec3;

use crate::lanes::{Kernel, Lanes, Task};
use crate::shape::Bounds;

/// How many triangles a run has, but for a shape's last.
pub(super) const LENGTH: usize = 1 << 13;

/// What is known of a run.
#[derive(Clone, Debug)]
pub(super) struct Run {
    /// From the first of its corners to the last, if these are not many more than it has.
    pub(super) corners: Option<RangeInclusive<u32>>,
    /// Around all of them that are numbers.
    pub(super) bounds: Bounds,
}

impl Run {
    /// That of some triangles.
    pub(super) fn of(kernel: Kernel, positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let corners = kernel.run(Span(triangles));
        let is_dense = ((corners.end() - corners.start()) as usize) < 3 * triangles.len();
        let bounds = match is_dense {
            true => around(&positions[*corners.start() as usize..=*corners.end() as usize]),
            false => around(
                triangles
                    .as_flattened()
                    .iter()
                    .map(|i| &positions[*i as usize]),
            ),
        };
        Self {
            corners: is_dense.then_some(corners),
            bounds,
        }
    }
}

/// A box around those of the positions that are numbers.
fn around<'a>(positions: impl IntoIterator<Item = &'a Vec3>) -> Bounds {
    // What is no number is not the lesser, and so is passed over on this side.
    let with = |bounds: Bounds, position: &Vec3| Bounds {
        min: position.min(bounds.min),
        max: position.max(bounds.max),
    };
    positions.into_iter().fold(Bounds::EMPTY, with)
}

/// The first and the last corner of some triangles.
struct Span<'a>(&'a [[u32; 3]]);

impl Task for Span<'_> {
    type Output = RangeInclusive<u32>;

    /// As a loop that the instructions have many lanes for.
    #[inline(always)]
    fn run<F: Lanes>(self) -> Self::Output {
        let (mut first, mut last) = (u32::MAX, 0);
        for i in self.0.as_flattened() {
            first = first.min(*i);
            last = last.max(*i);
        }
        first..=last
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_knows_its_corners_and_what_is_around_them() {
        let count = 4 * LENGTH as u32;
        let at = |i: u32| Vec3::new(i as f32, if i == 5 { f32::NAN } else { 1.0 }, -2.0);
        let positions: Vec<Vec3> = (0..count).map(at).collect();
        // The second run has corners all over the mesh.
        let near = (0..LENGTH as u32).map(|i| [i, i + 2, i + 1]);
        let far = (0..10).map(|i| [i + 3, i + 1, count - 1 - i]);
        let triangles: Vec<[u32; 3]> = near.chain(far).collect();
        for kernel in Kernel::all() {
            let chunks = triangles.chunks(LENGTH);
            let runs: Vec<Run> = chunks
                .map(|part| Run::of(kernel, &positions, part))
                .collect();
            assert_eq!(runs.len(), 2);
            let last = LENGTH as u32 + 1;
            assert_eq!(runs[0].corners, Some(0..=last));
            assert_eq!(runs[1].corners, None);
            for (run, [first, last]) in runs.iter().zip([[0, last], [1, count - 1]]) {
                assert_eq!(run.bounds.min, Vec3::new(first as f32, 1.0, -2.0));
                assert_eq!(run.bounds.max, Vec3::new(last as f32, 1.0, -2.0));
            }
        }
    }
}
