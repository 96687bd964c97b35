//! `ldsampler`: Sobol's first two sequences with a random number added to the digits (Kollig and Keller,
//! *Efficient multidimensional sampling*, 2002), visited in random order. A set of 4^k points puts one into
//! each interval of length 4⁻ᵏ and, in pairs, one into each box of area 4⁻ᵏ whose sides are powers of two.
//! `sobol` does better: its scrambling breaks the alignments that remain here.

use glam::Vec2;

use super::digits::{fraction, second};
use super::{PointSet, Sampler, place, sample_count};
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::math::random;

/// A set is the whole sample count, rounded up to a power of four.
#[derive(Clone, Debug)]
pub struct LdSampler {
    count: u32,
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
        Self {
            // Mitsuba's least count is 4.
            count: (power << (power.trailing_zeros() % 2)).max(4),
        }
    }
}

impl PointSet for LdSampler {
    fn sample_count(&self) -> u32 {
        self.count
    }

    fn set_size(&self) -> u32 {
        self.count
    }

    fn counts(&self) -> &'static str {
        "powers of four"
    }

    fn with_count(&self, count: u32) -> Sampler {
        Sampler::LdSampler(Self::new(count))
    }

    #[inline]
    fn get_1d(&self, key: u64, index: u32, dimension: u32) -> f32 {
        let (key, index) = place(key, index, self.count, dimension);
        let index = random::permute(index, self.count, key);
        fraction(index ^ random::mix(key) as u32)
    }

    #[inline]
    fn get_2d(&self, key: u64, index: u32, dimension: u32) -> Vec2 {
        let (key, index) = place(key, index, self.count, dimension);
        let index = random::permute(index, self.count, key);
        let added = random::mix(key);
        Vec2::new(
            fraction(index ^ added as u32),
            fraction(second(index) ^ (added >> 32) as u32),
        )
    }
}
