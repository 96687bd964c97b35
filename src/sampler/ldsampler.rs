//! `ldsampler`: Sobol's first two sequences with a random number added to the digits (Kollig and Keller,
//! *Efficient multidimensional sampling*, 2002), visited in random order. A set of 4^k points puts one into
//! each interval of length 4⁻ᵏ and, in pairs, one into each box of area 4⁻ᵏ whose sides are powers of two.
//! `sobol` does better: its scrambling breaks the alignments that remain here.

use super::digits::{fraction, second};
use super::{PointSet, Sampler, Streams, place, sample_count};
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::lanes::{Divisor, Lanes, Vec2, random};

/// A set is the whole sample count, rounded up to a power of four.
#[derive(Clone, Debug)]
pub struct LdSampler {
    set: Divisor,
}

impl LdSampler {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a (0, 2)-sequence, every pair of dimensions by itself",
        properties: &[super::COMMON],
    };

    pub(super) fn build(properties: &Properties<'_>, _context: &()) -> Result<Self> {
        Ok(Self::new(sample_count(properties)?))
    }

    fn new(count: u32) -> Self {
        let power = count.next_power_of_two();
        // Mitsuba's least count is 4.
        let count = (power << (power.trailing_zeros() % 2)).max(4);
        Self {
            set: Divisor::new(count),
        }
    }
}

impl PointSet for LdSampler {
    fn sample_count(&self) -> u32 {
        self.set.value()
    }

    fn set_size(&self) -> u32 {
        self.set.value()
    }

    fn counts(&self) -> &'static str {
        "powers of four"
    }

    fn with_count(&self, count: u32) -> Sampler {
        Sampler::LdSampler(Self::new(count))
    }

    #[inline(always)]
    fn number<F: Lanes>(&self, streams: Streams<F>, dimension: u32) -> F {
        let Streams { key, index } = place(streams, self.set, dimension);
        let index = random::permute::<F>(index, self.set, key);
        fraction(index ^ random::mix(key).low)
    }

    #[inline(always)]
    fn pair<F: Lanes>(&self, streams: Streams<F>, dimension: u32) -> Vec2<F> {
        let Streams { key, index } = place(streams, self.set, dimension);
        let index = random::permute::<F>(index, self.set, key);
        let added = random::mix(key);
        Vec2::new(
            fraction(index ^ added.low),
            fraction(second(index) ^ added.high),
        )
    }
}
