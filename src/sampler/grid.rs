//! `grid`: the centres of n × n equal cells, the same in every pixel and every pair of dimensions. What is
//! regular in the image aliases against it: it stands here to be compared with. Only the order in which
//! cells are visited is random, so that a cell of the pixel does not always meet the same cell of the lens.
//! No other sampler here is biased, at its full count or before it.

use super::stratified::Stratified;
use super::{PointSet, Sampler, Streams};
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::lanes::{Lanes, Vec2};

/// Strata without jitter; a set is the whole sample count, rounded up to a square.
#[derive(Clone, Debug)]
pub struct Grid {
    cells: Stratified,
}

impl Grid {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a regular grid, which aliases",
        properties: &[super::COMMON],
    };

    pub(super) fn build(properties: &Properties<'_>, _context: &()) -> Result<Self> {
        let count = super::sample_count(properties)?;
        Ok(Self::new(count))
    }

    fn new(count: u32) -> Self {
        Self {
            cells: Stratified::new(count, false),
        }
    }
}

impl PointSet for Grid {
    fn sample_count(&self) -> u32 {
        self.cells.sample_count()
    }

    fn set_size(&self) -> u32 {
        self.cells.set_size()
    }

    fn counts(&self) -> &'static str {
        self.cells.counts()
    }

    fn with_count(&self, count: u32) -> Sampler {
        Sampler::Grid(Self::new(count))
    }

    #[inline(always)]
    fn number<F: Lanes>(&self, streams: Streams<F>, dimension: u32) -> F {
        self.cells.number(streams, dimension)
    }

    #[inline(always)]
    fn pair<F: Lanes>(&self, streams: Streams<F>, dimension: u32) -> Vec2<F> {
        self.cells.pair(streams, dimension)
    }
}
