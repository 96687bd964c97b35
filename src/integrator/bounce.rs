//! The random numbers of a path's bounces. A bounce makes a number of decisions, one for each light that is sampled and
//! one for the way on, and each has four dimensions: two for a point or a direction, one for which light or lobe, one
//! for whether the path goes on. So what is decided together is placed together, and what one decision draws does not
//! shift the next.

use super::FIRST_DIMENSION;
use crate::color::ColorModel;
use crate::lanes::{Lanes, Vec2};
use crate::material::Surface;
use crate::sampler::{Sampler, Streams};

/// Dimensions of a decision.
const DIMENSIONS: u32 = 4;

/// How many decisions every bounce makes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounces {
    pub(super) decisions: u32,
}

impl Bounces {
    /// The first dimension of the bounce at `depth`; `None` where the path has used up all that there are.
    pub(super) fn first(&self, depth: u32) -> Option<u32> {
        let size = self.decisions.checked_mul(DIMENSIONS)?;
        let first = depth.checked_mul(size)?.checked_add(FIRST_DIMENSION)?;
        first.checked_add(size)?;
        Some(first)
    }
}

/// The numbers of a decision of paths in lanes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Decisions<'a, F: Lanes> {
    sampler: &'a Sampler,
    /// Of the paths.
    streams: Streams<F>,
    /// The decision's first dimension.
    first: u32,
}

impl<'a, F: Lanes> Decisions<'a, F> {
    /// Those of decision `number` of a bounce whose first dimension is `first`.
    #[inline(always)]
    pub(super) fn new(sampler: &'a Sampler, streams: Streams<F>, first: u32, number: u32) -> Self {
        Self {
            sampler,
            streams,
            first: first + number * DIMENSIONS,
        }
    }

    /// For a point or a direction.
    #[inline(always)]
    pub(super) fn u2(&self) -> Vec2<F> {
        self.sampler.pair(self.streams, self.first)
    }

    /// For which light or lobe.
    #[inline(always)]
    pub(super) fn u1(&self) -> F {
        self.sampler.number(self.streams, self.first + 2)
    }

    /// For which lobe; 0 where there is but one.
    #[inline(always)]
    pub(super) fn lobe<C: ColorModel>(&self, surface: &Surface<'_, C, F>) -> F {
        match surface.has_one_lobe() {
            true => F::zero(),
            false => self.u1(),
        }
    }

    /// The number for whether the path goes on.
    #[inline(always)]
    pub(super) fn survival(&self) -> F {
        self.sampler.number(self.streams, self.first + 3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_decisions_of_a_path_share_a_dimension() {
        let (sampler, bounces) = (Sampler::default(), Bounces { decisions: 3 });
        let mut next = FIRST_DIMENSION;
        for depth in 0..5 {
            let first = bounces.first(depth).unwrap();
            for number in 0..3 {
                let decision = Decisions::<f32>::new(&sampler, Streams::of(&[]), first, number);
                assert_eq!(decision.first, next);
                next += DIMENSIONS;
            }
        }
        assert!(bounces.first(u32::MAX / 12).is_none());
    }
}
