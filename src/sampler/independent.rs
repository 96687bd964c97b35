//! `independent`: every coordinate a random number of its own; converges with variance 1/n.

use super::{PointSet, Sampler, Streams, sample_count, units};
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::lanes::{Lanes, Long, Vec2, random};

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

    #[inline(always)]
    fn number<F: Lanes>(&self, streams: Streams<F>, dimension: u32) -> F {
        random::unit(point(streams, dimension).high)
    }

    #[inline(always)]
    fn pair<F: Lanes>(&self, streams: Streams<F>, dimension: u32) -> Vec2<F> {
        units(point(streams, dimension))
    }
}

/// The random bits of a point.
#[inline(always)]
fn point<F: Lanes>(Streams { key, index }: Streams<F>, dimension: u32) -> Long<F::Int> {
    random::bits_along(random::bits(key, dimension), index)
}
