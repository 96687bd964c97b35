//! `independent`: every coordinate a random number of its own; converges with variance 1/n.

use glam::Vec2;

use super::{PointSet, Sampler, sample_count};
use crate::description::Properties;
use crate::error::Result;
use crate::math::random;

/// Independent uniform points; a set is one point.
#[derive(Clone, Debug)]
pub struct Independent {
    count: u32,
}

impl Independent {
    pub(super) fn build(properties: &Properties<'_>, _context: &()) -> Result<Self> {
        properties.ignore("seed"); // the render's seed is the command line's
        Ok(Self {
            count: sample_count(properties)?,
        })
    }
}

impl PointSet for Independent {
    fn sample_count(&self) -> u32 {
        self.count
    }

    fn set_size(&self) -> u32 {
        1
    }

    fn sized(&self, count: u32) -> Sampler {
        Sampler::Independent(Self { count })
    }

    #[inline]
    fn get_1d(&self, key: u64, index: u32, dimension: u32) -> f32 {
        random::unit(random::bits(random::key(key, u64::from(index)), dimension))
    }

    #[inline]
    fn get_2d(&self, key: u64, index: u32, dimension: u32) -> Vec2 {
        let key = random::key(key, u64::from(index));
        Vec2::new(
            random::unit(random::bits(key, dimension)),
            random::unit(random::bits(key, dimension + 1)),
        )
    }
}
