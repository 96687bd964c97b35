//! `sobol`: sixteen of Sobol's sequences, Owen-scrambled and padded (Burley, *Practical hash-based Owen
//! scrambling*, JCGT 2020). Sixteen dimensions make a block and are sampled jointly: the first has pixel,
//! lens, time, wavelength and all of the first bounce, each later one two bounces. Blocks have shuffles of
//! their own. The first 2^k points of a set, and every following 2^k, put one into each interval of length
//! 2⁻ᵏ and, in the pixel, into each box of 2⁻ⁱ × 2ⁱ⁻ᵏ: a (0, 2)-sequence. Other pairs come close to that.
//!
//! On `scenes/soft-shadow.xml` with 256 samples the squared error is 1/14 of that of independent samples; with
//! blocks of four dimensions it is 1/4, and with pairs on their own (`ldsampler`) 1/5.

use glam::Vec2;

use super::digits::{SEQUENCES, fraction, scramble, shuffle, sobol};
use super::{PointSet, Sampler, place, sample_count};
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::math::random;

/// Which sequence each dimension of a block takes. Pixel, lens, light and direction have pairs that are good
/// nets themselves (of 16 to 1,024 points, t ≤ 2) and, by trial, no worse than random points for what they do
/// together, which neighbouring sequences can be fivefold at 16 points.
const COLUMNS: [usize; SEQUENCES] = [0, 1, 4, 9, 8, 14, 5, 13, 2, 3, 10, 15, 7, 12, 6, 11];

/// Dimensions that are sampled jointly.
const BLOCK: u32 = COLUMNS.len() as u32;

/// A set is the whole sample count, rounded up to a power of two.
#[derive(Clone, Debug)]
pub struct Sobol {
    count: u32,
}

impl Sobol {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "Sobol' points with Owen's scrambling, sixteen dimensions jointly",
        properties: &[super::COMMON],
    };

    pub(super) fn build(properties: &Properties<'_>, _context: &()) -> Result<Self> {
        Ok(Self::new(sample_count(properties)?))
    }

    fn new(count: u32) -> Self {
        Self {
            count: count.next_power_of_two(),
        }
    }

    /// The key of the block, and which element of the sequences the point is in it.
    #[inline]
    fn element(&self, key: u64, index: u32, dimension: u32) -> (u64, u32) {
        let (key, index) = place(key, index, self.count, dimension / BLOCK);
        (key, shuffle(index, self.count, key as u32))
    }

    #[inline]
    fn coordinate(&self, index: u32, column: u32, seed: u32) -> f32 {
        let sequence = COLUMNS[column as usize];
        fraction(scramble(sobol(sequence, index, self.count.ilog2()), seed))
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
        let (key, index) = self.element(key, index, dimension);
        let column = dimension % BLOCK;
        self.coordinate(index, column, random::bits(key, column) as u32)
    }

    #[inline]
    fn get_2d(&self, key: u64, index: u32, dimension: u32) -> Vec2 {
        let (key, index) = self.element(key, index, dimension);
        let column = dimension % BLOCK;
        let seeds = random::bits(key, column);
        Vec2::new(
            self.coordinate(index, column, seeds as u32),
            self.coordinate(index, column + 1, (seeds >> 32) as u32),
        )
    }
}
