//! `sobol`: Sobol's first two sequences, Owen-scrambled and padded (Burley, *Practical hash-based Owen
//! scrambling*, JCGT 2020). Each dimension and each pair has a shuffle of the indices and a scrambling of its
//! own. The first 2^k points of a set, and every following 2^k, put one into each interval of length 2⁻ᵏ
//! and, in pairs, one into each of the 2^k boxes of every shape 2⁻ⁱ × 2ⁱ⁻ᵏ: a (0, 2)-sequence.

use glam::Vec2;

use super::digits::{fraction, scramble, second, shuffle};
use super::{PointSet, Sampler, place, sample_count};
use crate::description::Properties;
use crate::error::Result;
use crate::math::random;

/// A set is the whole sample count, rounded up to a power of two.
#[derive(Clone, Debug)]
pub struct Sobol {
    count: u32,
}

impl Sobol {
    pub(super) fn build(properties: &Properties<'_>, _context: &()) -> Result<Self> {
        Ok(Self::new(sample_count(properties)?))
    }

    fn new(count: u32) -> Self {
        Self {
            count: count.next_power_of_two(),
        }
    }
}

impl PointSet for Sobol {
    fn sample_count(&self) -> u32 {
        self.count
    }

    fn set_size(&self) -> u32 {
        self.count
    }

    fn counts(&self) -> &'static str {
        "powers of two"
    }

    fn with_count(&self, count: u32) -> Sampler {
        Sampler::Sobol(Self::new(count))
    }

    #[inline]
    fn get_1d(&self, key: u64, index: u32, dimension: u32) -> f32 {
        let (key, index) = place(key, index, self.count, dimension);
        let index = shuffle(index, self.count, key as u32);
        fraction(scramble(index, (key >> 32) as u32))
    }

    #[inline]
    fn get_2d(&self, key: u64, index: u32, dimension: u32) -> Vec2 {
        let (key, index) = place(key, index, self.count, dimension);
        let index = shuffle(index, self.count, key as u32);
        Vec2::new(
            fraction(scramble(index, (key >> 32) as u32)),
            fraction(scramble(second(index), random::mix(key) as u32)),
        )
    }
}
