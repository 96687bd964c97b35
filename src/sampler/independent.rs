//! `independent`: every coordinate a random number of its own; converges with variance 1/n.

use glam::Vec2;

use super::{PointSet, Sampler, sample_count, units};
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::math::random;

/// Independent uniform points; a set is one point.
#[derive(Clone, Debug)]
pub struct Independent {
    count: u32,
}

impl Independent {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "random points",
        properties: &[super::COMMON],
    };

    /// So many a pixel.
    pub(super) fn new(count: u32) -> Self {
        Self { count }
    }

    pub(super) fn build(properties: &Properties<'_>, _context: &()) -> Result<Self> {
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

    fn counts(&self) -> &'static str {
        "every number"
    }

    fn with_count(&self, count: u32) -> Sampler {
        Sampler::Independent(Self { count })
    }

    #[inline]
    fn get_1d(&self, key: u64, index: u32, dimension: u32) -> f32 {
        random::unit(random::bits(random::bits(key, dimension), index))
    }

    #[inline]
    fn get_2d(&self, key: u64, index: u32, dimension: u32) -> Vec2 {
        units(random::bits(random::bits(key, dimension), index))
    }
}
