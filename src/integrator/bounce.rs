//! The random numbers of a path's bounces. A bounce makes a number of decisions, one for each light that is sampled and
//! one for the way on, and each has four dimensions: two for a point or a direction, one for which light or lobe, one
//! for whether the path goes on. So what is decided together is placed together, and what one decision draws does not
//! shift the next.

use glam::Vec2;

use super::FIRST_DIMENSION;
use crate::sampler::{Sampler, Stream};

/// Dimensions of a decision.
const DIMENSIONS: u32 = 4;

/// How many decisions every bounce makes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounces {
    pub(super) decisions: u32,
}

impl Bounces {
    /// Goes on to the numbers of the bounce at `depth`; `None` where the path has used up all that there are.
    #[inline]
    pub(super) fn begin(&self, stream: &mut Stream, depth: u32) -> Option<()> {
        let size = self.decisions.checked_mul(DIMENSIONS)?;
        let first = depth.checked_mul(size)?.checked_add(FIRST_DIMENSION)?;
        first.checked_add(size)?;
        stream.seek(first);
        Some(())
    }
}

/// The numbers of a decision.
#[derive(Clone, Copy, Debug)]
pub(super) struct Decision {
    /// For a point or a direction.
    pub(super) u2: Vec2,
    /// For which light or lobe.
    pub(super) u1: f32,
}

impl Decision {
    /// The next one of the bounce; the number for whether the path goes on is the stream's next.
    #[inline]
    pub(super) fn next(stream: &mut Stream, sampler: &Sampler) -> Self {
        stream.align(DIMENSIONS);
        Self {
            u2: stream.next_2d(sampler),
            u1: stream.next_1d(sampler),
        }
    }
}
