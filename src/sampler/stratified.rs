//! `stratified`: jittered strata (Cook, *Stochastic sampling in computer graphics*, 1986). A set of n
//! points puts one into each of n intervals of every dimension and, in pairs, one into each cell of a
//! grid of √n × √n; each dimension visits its strata in a permutation of its own.

use glam::Vec2;

use super::{PointSet, Sampler, sample_count};
use crate::description::Properties;
use crate::error::Result;
use crate::math::random;

/// Jittered points; a set is the whole sample count, rounded up to a square.
#[derive(Clone, Debug)]
pub struct Stratified {
    /// Strata along each axis of a pair.
    side: u32,
    /// Whether points lie anywhere in their stratum, or at its centre.
    jitter: bool,
}

/// The side of the smallest square of at least `count` cells.
fn side(count: u32) -> u32 {
    let side = count.isqrt();
    side + u32::from(side.pow(2) < count)
}

impl Stratified {
    pub(super) fn build(properties: &Properties<'_>, _context: &()) -> Result<Self> {
        properties.ignore("seed"); // the render's seed is the command line's
        Ok(Self {
            side: side(sample_count(properties)?),
            jitter: properties.boolean("jitter")?.unwrap_or(true),
        })
    }

    /// The set's key for a dimension, and the point's place in the set's permutation of the strata.
    #[inline]
    fn stratum(&self, key: u64, index: u32, dimension: u32) -> (u64, u32) {
        let n = self.set_size();
        let key = random::bits(random::key(key, u64::from(index / n)), dimension);
        (key, random::permute(index % n, n, key))
    }

    #[inline]
    fn jitter(&self, key: u64, stratum: u32, axis: u32) -> f32 {
        if self.jitter {
            random::unit(random::bits(random::key(key, u64::from(stratum)), axis))
        } else {
            0.5
        }
    }
}

impl PointSet for Stratified {
    fn sample_count(&self) -> u32 {
        self.set_size()
    }

    fn set_size(&self) -> u32 {
        self.side * self.side
    }

    fn sized(&self, count: u32) -> Sampler {
        let side = side(count);
        Sampler::Stratified(Self { side, ..*self })
    }

    #[inline]
    fn get_1d(&self, key: u64, index: u32, dimension: u32) -> f32 {
        let (key, stratum) = self.stratum(key, index, dimension);
        let x = (stratum as f32 + self.jitter(key, stratum, 0)) / self.set_size() as f32;
        x.min(1f32.next_down())
    }

    #[inline]
    fn get_2d(&self, key: u64, index: u32, dimension: u32) -> Vec2 {
        let (key, stratum) = self.stratum(key, index, dimension);
        let cell = Vec2::new((stratum % self.side) as f32, (stratum / self.side) as f32);
        let within = Vec2::new(self.jitter(key, stratum, 0), self.jitter(key, stratum, 1));
        ((cell + within) / self.side as f32).min(Vec2::splat(1f32.next_down()))
    }
}
