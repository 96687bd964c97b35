//! `multijitter`: correlated multi-jittered points (Kensler, *Correlated multi-jittered sampling*, Pixar
//! technical memo 13-01, 2013). A set of m × n points puts one into each cell of a grid of m × n and also
//! one into each of m·n columns and rows: the cell in column i and row j has its point in the column's part
//! σ(j) and in the row's part τ(i), where the permutations σ and τ are the same for all cells, which keeps
//! neighbours apart.

use super::stratified::{jittered, offset};
use super::{PointSet, Sampler, Streams, below_one, count, place, sample_count};
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::lanes::{Divisor, Ints as _, Lanes, Vec2, random};

/// A set is the whole sample count, rounded up to a product of near equals.
#[derive(Clone, Debug)]
pub struct MultiJitter {
    set: Divisor,
    columns: Divisor,
    rows: Divisor,
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
        let rows = count.div_ceil(columns);
        Self {
            set: Divisor::new(columns * rows),
            columns: Divisor::new(columns),
            rows: Divisor::new(rows),
            jitter,
        }
    }
}

impl PointSet for MultiJitter {
    fn sample_count(&self) -> u32 {
        self.set_size()
    }

    fn set_size(&self) -> u32 {
        self.set.value()
    }

    fn counts(&self) -> &'static str {
        "products of two near equals"
    }

    fn with_count(&self, count: u32) -> Sampler {
        Sampler::MultiJitter(Self::new(count, self.jitter))
    }

    #[inline(always)]
    fn number<F: Lanes>(&self, streams: Streams<F>, dimension: u32) -> F {
        jittered(streams, dimension, self.set, self.jitter)
    }

    #[inline(always)]
    fn pair<F: Lanes>(&self, streams: Streams<F>, dimension: u32) -> Vec2<F> {
        let Streams { key, index } = place(streams, self.set, dimension);
        let cell = random::permute::<F>(index, self.set, key);
        let (j, i) = self.columns.divide(cell);
        let key_x = random::bits(key, u32::MAX);
        let key_y = random::bits(key, u32::MAX - 1);
        let part_x: F = random::permute::<F>(j, self.rows, key_x).to_float();
        let part_y: F = random::permute::<F>(i, self.columns, key_y).to_float();
        let (columns, rows) = (count::<F>(self.columns), count::<F>(self.rows));
        let within = offset(key, cell, self.jitter);
        let x = (i.to_float() + (part_x + within.x) / rows) / columns;
        let y = (j.to_float() + (part_y + within.y) / columns) / rows;
        Vec2::new(below_one(x), below_one(y))
    }
}
