//! Sums of blocks that want different numbers of samples, cut into passes of up to 16: a pass takes the tiles in which any
//! block wants more, those that want the most first.

use std::ops::Range;

use super::plan::PASS;
use crate::film::Grid;
use crate::sensor::Window;

/// Which samples stand in which unit.
#[derive(Debug)]
pub(super) struct Rounds {
    /// How many samples each half of each block wants.
    counts: Vec<u32>,
    /// Tiles by their largest count, the largest first: those that a pass takes are the first of them.
    tiles: Vec<usize>,
    /// The first unit of each pass, and the number of units.
    firsts: Vec<usize>,
}

impl Rounds {
    /// For so many samples of each pixel in each half of each block.
    pub(super) fn new(grid: &Grid, counts: Vec<u32>) -> Self {
        let passes = |tile: usize| {
            let blocks = grid.tile(tile);
            let counts = blocks.map(|b| counts[2 * b].max(counts[2 * b + 1]));
            counts.max().unwrap_or(0).div_ceil(PASS)
        };
        let mut tiles: Vec<usize> = (0..grid.tiles()).collect();
        tiles.sort_by_key(|tile| std::cmp::Reverse(passes(*tile)));
        let mut firsts = vec![0];
        for pass in 0..tiles.first().map_or(0, |tile| passes(*tile)) {
            let taken = tiles.partition_point(|tile| passes(*tile) > pass);
            firsts.push(firsts[pass as usize] + taken);
        }
        Self {
            counts,
            tiles,
            firsts,
        }
    }

    /// How many units there are.
    pub(super) fn units(&self) -> usize {
        self.firsts[self.firsts.len() - 1]
    }

    /// How many passes there are.
    pub(super) fn passes(&self) -> u32 {
        self.firsts.len() as u32 - 1
    }

    /// The units of some passes, of which the first is 0; later ones than are needed have none.
    pub(super) fn units_of(&self, passes: Range<u32>) -> Range<usize> {
        let first = |pass: u32| self.firsts[(pass as usize).min(self.firsts.len() - 1)];
        first(passes.start)..first(passes.end)
    }

    /// The pass of a unit; after the last unit, the number of passes.
    pub(super) fn pass(&self, unit: usize) -> u32 {
        self.firsts[1..].partition_point(|first| *first <= unit) as u32
    }

    /// How many samples units take.
    pub(super) fn samples(&self, grid: &Grid, units: Range<usize>) -> u64 {
        units
            .flat_map(|unit| self.slots(grid, unit))
            .map(|(slot, indices)| area(&grid.block(slot / 2)) * indices.len() as u64)
            .sum()
    }

    /// The halves of blocks that a unit adds to, each with the indices of its samples.
    pub(super) fn slots(
        &self,
        grid: &Grid,
        unit: usize,
    ) -> impl Iterator<Item = (usize, Range<u32>)> {
        let pass = self.pass(unit);
        let tile = self.tiles[unit - self.firsts[pass as usize]];
        grid.tile(tile)
            .flat_map(|block| [2 * block, 2 * block + 1])
            .filter_map(move |slot| {
                let first = pass * PASS;
                let end = self.counts[slot].min(first + PASS);
                (first < end).then_some((slot, first..end))
            })
    }
}

/// How many pixels a window has.
pub(super) fn area(window: &Window) -> u64 {
    u64::from(window.width) * u64::from(window.height)
}
