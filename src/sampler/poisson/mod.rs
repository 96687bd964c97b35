//! `poisson`: Poisson discs. The n points of a set keep in every pair of dimensions, across its edges too, a
//! distance of at least 0.7 times that of a hexagonal lattice, √(2 / (√3·n)), the largest there can be; in
//! single dimensions they are stratified. Patterns are made once and few ([`pattern`]); a pixel's pair takes
//! one by chance, moves it around the torus, which makes every point uniform, mirrors and transposes it,
//! none of which changes a distance, and visits the points in random order. More than 1,024 samples are
//! several sets, each with patterns of its own choice.

mod pattern;

use std::sync::Arc;

use glam::Vec2;

use super::stratified::jittered;
use super::{PointSet, Sampler, below_one, place, sample_count, units};
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::math::random;

/// The most points of a pattern: half a million bytes of patterns would leave the caches.
const MAX_POINTS: u32 = 1024;

/// The patterns to choose from: a power of two.
const PATTERNS: u32 = 8;

/// A set is the sample count, or an equal part of it.
#[derive(Clone, Debug)]
pub struct Poisson {
    count: u32,
    size: u32,
    /// The points of all patterns, one pattern after another.
    points: Arc<[Vec2]>,
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
        Self {
            count: sets * size,
            size,
            points: points.collect(),
        }
    }
}

impl PointSet for Poisson {
    fn sample_count(&self) -> u32 {
        self.count
    }

    fn set_size(&self) -> u32 {
        self.size
    }

    fn counts(&self) -> &'static str {
        "numbers up to 1024 and multiples of such"
    }

    fn with_count(&self, count: u32) -> Sampler {
        Sampler::Poisson(Self::new(count))
    }

    #[inline]
    fn get_1d(&self, key: u64, index: u32, dimension: u32) -> f32 {
        jittered(key, index, dimension, self.size, true)
    }

    #[inline]
    fn get_2d(&self, key: u64, index: u32, dimension: u32) -> Vec2 {
        let (key, index) = place(key, index, self.size, dimension);
        let place = random::permute(index, self.size, key);
        let chance = random::mix(key);
        let pattern = (chance >> 3) as u32 % PATTERNS;
        let mut point = self.points[(pattern * self.size + place) as usize];
        if chance & 1 != 0 {
            point.x = -point.x;
        }
        if chance & 2 != 0 {
            point.y = -point.y;
        }
        if chance & 4 != 0 {
            point = Vec2::new(point.y, point.x);
        }
        let moved = point + units(random::bits(key, 0));
        (moved - moved.floor()).min(Vec2::splat(below_one()))
    }
}
