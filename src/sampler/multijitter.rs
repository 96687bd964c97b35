//! `multijitter`: correlated multi-jittered points (Kensler, *Correlated multi-jittered sampling*, Pixar
//! technical memo 13-01, 2013). A set of m × n points puts one into each cell of a grid of m × n and also
//! one into each of m·n columns and rows: the cell in column i and row j has its point in the column's part
//! σ(j) and in the row's part τ(i), where the permutations σ and τ are the same for all cells, which keeps
//! neighbours apart.

use glam::Vec2;

use super::stratified::{jittered, offset};
use super::{PointSet, Sampler, below_one, place, sample_count};
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::math::random;

/// A set is the whole sample count, rounded up to a product of near equals.
#[derive(Clone, Debug)]
pub struct MultiJitter {
    columns: u32,
    rows: u32,
    /// Whether points lie anywhere in the smallest strata, or at their centres.
    jitter: bool,
}

impl MultiJitter {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "one point in each cell of a grid, and in each column and row",
        properties: &[super::COMMON, &[super::JITTER]],
    };

    pub(super) fn build(properties: &Properties<'_>, _context: &()) -> Result<Self> {
        let count = sample_count(properties)?;
        Ok(Self::new(count, properties.boolean("jitter")?))
    }

    fn new(count: u32, jitter: bool) -> Self {
        let columns = count.isqrt();
        Self {
            columns,
            rows: count.div_ceil(columns),
            jitter,
        }
    }
}

impl PointSet for MultiJitter {
    fn sample_count(&self) -> u32 {
        self.set_size()
    }

    fn set_size(&self) -> u32 {
        self.columns * self.rows
    }

    fn counts(&self) -> &'static str {
        "products of two near equals"
    }

    fn with_count(&self, count: u32) -> Sampler {
        Sampler::MultiJitter(Self::new(count, self.jitter))
    }

    #[inline]
    fn get_1d(&self, key: u64, index: u32, dimension: u32) -> f32 {
        jittered(key, index, dimension, self.set_size(), self.jitter)
    }

    #[inline]
    fn get_2d(&self, key: u64, index: u32, dimension: u32) -> Vec2 {
        let size = self.set_size();
        let (key, index) = place(key, index, size, dimension);
        let cell = random::permute(index, size, key);
        let (i, j) = (cell % self.columns, cell / self.columns);
        let part = Vec2::new(
            random::permute(j, self.rows, random::bits(key, u32::MAX)) as f32,
            random::permute(i, self.columns, random::bits(key, u32::MAX - 1)) as f32,
        );
        let grid = Vec2::new(self.columns as f32, self.rows as f32);
        let within = (part + offset(key, cell, self.jitter)) / Vec2::new(grid.y, grid.x);
        ((Vec2::new(i as f32, j as f32) + within) / grid).min(Vec2::splat(below_one()))
    }
}
