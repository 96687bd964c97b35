//! `stratified`: jittered strata (Cook, *Stochastic sampling in computer graphics*, 1986). A set of n
//! points puts one into each of n intervals of every dimension and, in pairs, one into each cell of a
//! grid of √n × √n; each dimension visits its strata in a permutation of its own.

use glam::Vec2;

use super::{PointSet, Sampler, below_one, place, sample_count, units};
use crate::description::Properties;
use crate::description::declared::Plugin;
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

impl Stratified {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "jittered: one point in each cell of a grid",
        properties: &[super::COMMON, &[super::JITTER]],
    };

    pub(super) fn build(properties: &Properties<'_>, _context: &()) -> Result<Self> {
        let count = sample_count(properties)?;
        Ok(Self::new(count, properties.boolean("jitter")?))
    }

    pub(super) fn new(count: u32, jitter: bool) -> Self {
        let root = count.isqrt();
        Self {
            side: root + u32::from(root * root < count),
            jitter,
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

    fn counts(&self) -> &'static str {
        "squares"
    }

    fn with_count(&self, count: u32) -> Sampler {
        Sampler::Stratified(Self::new(count, self.jitter))
    }

    #[inline]
    fn get_1d(&self, key: u64, index: u32, dimension: u32) -> f32 {
        jittered(key, index, dimension, self.set_size(), self.jitter)
    }

    #[inline]
    fn get_2d(&self, key: u64, index: u32, dimension: u32) -> Vec2 {
        let n = self.set_size();
        let (key, index) = place(key, index, n, dimension);
        // One stratum is neither looked for nor scaled.
        if n == 1 {
            return offset(key, 0, self.jitter);
        }
        let stratum = random::permute(index, n, key);
        let cell = Vec2::new((stratum % self.side) as f32, (stratum / self.side) as f32);
        let within = offset(key, stratum, self.jitter);
        ((cell + within) / self.side as f32).min(Vec2::splat(below_one()))
    }
}

/// One coordinate in a stratum of its own for each of the `n` points of a set.
#[inline]
pub(super) fn jittered(key: u64, index: u32, dimension: u32, n: u32, jitter: bool) -> f32 {
    let (key, index) = place(key, index, n, dimension);
    if n == 1 {
        return offset(key, 0, jitter).x;
    }
    let stratum = random::permute(index, n, key);
    ((stratum as f32 + offset(key, stratum, jitter).x) / n as f32).min(below_one())
}

/// Where a point lies within its stratum.
#[inline]
pub(super) fn offset(key: u64, stratum: u32, jitter: bool) -> Vec2 {
    if jitter {
        units(random::bits(key, stratum))
    } else {
        Vec2::splat(0.5)
    }
}
