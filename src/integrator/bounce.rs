//! The random numbers of a path's bounces. A bounce makes a number of decisions, one for each light that is sampled and
//! one for the way on, and each has four dimensions: two for a point or a direction, one for which light or lobe, one
//! for whether the path goes on. So what is decided together is placed together, and what one decision draws does not
//! shift the next.

use glam::Vec2;

use super::FIRST_DIMENSION;
use crate::lanes::{self, Lanes, MAX_LANES};
use crate::sampler::{Sampler, Stream};

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
pub(super) struct Decisions<'a> {
    sampler: &'a Sampler,
    /// Of each path, from the first lane on.
    streams: &'a [Stream],
    /// The decision's first dimension.
    first: u32,
}

impl<'a> Decisions<'a> {
    /// Those of decision `number` of a bounce whose first dimension is `first`.
    pub(super) fn new(
        sampler: &'a Sampler,
        streams: &'a [Stream],
        first: u32,
        number: u32,
    ) -> Self {
        Self {
            sampler,
            streams,
            first: first + number * DIMENSIONS,
        }
    }

    /// For a point or a direction.
    #[inline(always)]
    pub(super) fn u2<F: Lanes>(&self) -> lanes::Vec2<F> {
        let mut pairs = [Vec2::ZERO; MAX_LANES];
        let pairs = &mut pairs[..self.streams.len()];
        self.sampler.fill_2d(self.streams, self.first, pairs);
        let mut rows = [F::ROW; 2];
        for (lane, pair) in pairs.iter().enumerate() {
            (rows[0][lane], rows[1][lane]) = (pair.x, pair.y);
        }
        lanes::Vec2::<F>::load(&rows)
    }

    /// For which light or lobe.
    #[inline(always)]
    pub(super) fn u1<F: Lanes>(&self) -> F {
        self.number(2)
    }

    /// The number for whether the path goes on.
    #[inline(always)]
    pub(super) fn survival<F: Lanes>(&self) -> F {
        self.number(3)
    }

    #[inline(always)]
    fn number<F: Lanes>(&self, dimension: u32) -> F {
        let mut numbers = [0.0; MAX_LANES];
        let numbers = &mut numbers[..self.streams.len()];
        let dimension = self.first + dimension;
        self.sampler.fill_1d(self.streams, dimension, numbers);
        let mut row = F::ROW;
        for (lane, number) in numbers.iter().enumerate() {
            row[lane] = *number;
        }
        F::load(&row)
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
                let decision = Decisions::new(&sampler, &[], first, number);
                assert_eq!(decision.first, next);
                next += DIMENSIONS;
            }
        }
        assert!(bounces.first(u32::MAX / 12).is_none());
    }
}
