//! `poisson`: Poisson discs. The n points of a set keep in every pair of dimensions, across its edges too, a
//! distance of at least 0.7 times that of a hexagonal lattice, √(2 / (√3·n)), the largest there can be; in
//! single dimensions they are stratified. Patterns are made once and few ([`pattern`]); a pixel's pair takes
//! one by chance, moves it around the torus, which makes every point uniform, mirrors and transposes it,
//! none of which changes a distance, and visits the points in random order. More than 1,024 samples are
//! several sets, each with patterns of its own choice.

mod pattern;

use std::sync::Arc;

use super::stratified::jittered;
use super::{PointSet, Sampler, Streams, below_one, place, sample_count, units};
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::lanes::{Divisor, Ints as _, Lanes, Vec2, random};

/// The most points of a pattern: half a million bytes of patterns would leave the caches.
const MAX_POINTS: u32 = 1024;

/// The patterns to choose from: a power of two.
const PATTERNS: u32 = 8;

/// A set is the sample count, or an equal part of it.
#[derive(Clone, Debug)]
pub struct Poisson {
    count: u32,
    set: Divisor,
    /// The x and the y of the points of all patterns, one pattern after another.
    points: Arc<[Vec<f32>; 2]>,
}

impl Poisson {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "points that keep a distance",
        properties: &[super::COMMON],
    };

    pub(super) fn build(properties: &Properties<'_>, _context: &()) -> Result<Self> {
        Ok(Self::new(sample_count(properties)?))
    }

    fn new(count: u32) -> Self {
        let sets = count.div_ceil(MAX_POINTS);
        let size = count.div_ceil(sets);
        let points = (0..PATTERNS).flat_map(|seed| pattern::discs(size, u64::from(seed)));
        let (x, y) = points.map(|point| (point.x, point.y)).unzip();
        Self {
            count: sets * size,
            set: Divisor::new(size),
            points: Arc::new([x, y]),
        }
    }
}

impl PointSet for Poisson {
    fn sample_count(&self) -> u32 {
        self.count
    }

    fn set_size(&self) -> u32 {
        self.set.value()
    }

    fn counts(&self) -> &'static str {
        "numbers up to 1024 and multiples of such"
    }

    fn with_count(&self, count: u32) -> Sampler {
        Sampler::Poisson(Self::new(count))
    }

    #[inline(always)]
    fn number<F: Lanes>(&self, streams: Streams<F>, dimension: u32) -> F {
        jittered(streams, dimension, self.set, true)
    }

    #[inline(always)]
    fn pair<F: Lanes>(&self, streams: Streams<F>, dimension: u32) -> Vec2<F> {
        let Streams { key, index } = place(streams, self.set, dimension);
        let place = random::permute::<F>(index, self.set, key);
        let chance = random::mix(key).low;
        let pattern = chance.shr::<3>() & F::Int::splat(PATTERNS - 1);
        let point = pattern * F::Int::splat(self.set.value()) + place;
        let [x, y] = &*self.points;
        let (x, y) = (F::gather(x, point), F::gather(y, point));
        let bit = F::Int::splat(1);
        let x: F = (x.to_bits() ^ (chance & bit).shl::<31>()).from_bits();
        let y: F = (y.to_bits() ^ (chance.shr::<1>() & bit).shl::<31>()).from_bits();
        let turned = (chance.shr::<2>() & bit).eq(bit);
        let moved = units::<F>(random::bits(key, 0));
        let x_moved = F::select(turned, y, x) + moved.x;
        let y_moved = F::select(turned, x, y) + moved.y;
        Vec2::new(
            below_one(x_moved - x_moved.floor()),
            below_one(y_moved - y_moved.floor()),
        )
    }
}
