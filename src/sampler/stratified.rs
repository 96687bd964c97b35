//! `stratified`: jittered strata (Cook, *Stochastic sampling in computer graphics*, 1986). A set of n
//! points puts one into each of n intervals of every dimension and, in pairs, one into each cell of a
//! grid of √n × √n; each dimension visits its strata in a permutation of its own.

use super::{PointSet, Sampler, Streams, below_one, count, place, sample_count, units};
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::lanes::{Divisor, Ints as _, Lanes, Long, Vec2, random};

/// Jittered points; a set is the whole sample count, rounded up to a square.
#[derive(Clone, Debug)]
pub struct Stratified {
    /// Strata along each axis of a pair.
    side: Divisor,
    set: Divisor,
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
        let side = root + u32::from(root * root < count);
        Self {
            side: Divisor::new(side),
            set: Divisor::new(side * side),
            jitter,
        }
    }
}

impl PointSet for Stratified {
    fn sample_count(&self) -> u32 {
        self.set_size()
    }

    fn set_size(&self) -> u32 {
        self.set.value()
    }

    fn counts(&self) -> &'static str {
        "squares"
    }

    fn with_count(&self, count: u32) -> Sampler {
        Sampler::Stratified(Self::new(count, self.jitter))
    }

    #[inline(always)]
    fn number<F: Lanes>(&self, streams: Streams<F>, dimension: u32) -> F {
        jittered(streams, dimension, self.set, self.jitter)
    }

    #[inline(always)]
    fn pair<F: Lanes>(&self, streams: Streams<F>, dimension: u32) -> Vec2<F> {
        let Streams { key, index } = place(streams, self.set, dimension);
        let stratum = random::permute::<F>(index, self.set, key);
        let (row, column) = self.side.divide(stratum);
        let within = offset(key, stratum, self.jitter);
        let side = count::<F>(self.side);
        let (x, y): (F, F) = (column.to_float(), row.to_float());
        Vec2::new(
            below_one((x + within.x) / side),
            below_one((y + within.y) / side),
        )
    }
}

/// One coordinate in a stratum of its own for each of the points of a set.
#[inline(always)]
pub(super) fn jittered<F: Lanes>(
    streams: Streams<F>,
    dimension: u32,
    set: Divisor,
    jitter: bool,
) -> F {
    let Streams { key, index } = place(streams, set, dimension);
    let stratum = random::permute::<F>(index, set, key);
    let number: F = stratum.to_float();
    below_one((number + offset::<F>(key, stratum, jitter).x) / count::<F>(set))
}

/// Where a point lies within its stratum.
#[inline(always)]
pub(super) fn offset<F: Lanes>(key: Long<F::Int>, stratum: F::Int, jitter: bool) -> Vec2<F> {
    if jitter {
        units(random::bits_along(key, stratum))
    } else {
        Vec2::new(F::splat(0.5), F::splat(0.5))
    }
}
