//! The film's sums apart by block and half, for a budget that gives blocks different numbers of samples.
//!
//! A pixel near a block's edge is reached by samples of several blocks. Added up as they are, those of the
//! block with more samples would count for more; so each (block, half) has sums of its own, which reach
//! beyond the block as far as the filter does, and is divided by its number of samples when the film is
//! put together. Blocks are aligned to the full film: a crop takes whole ones.

use super::{Accumulator, Layout, Sums, Tally, zeros};
use crate::error::Result;
use crate::sensor::{Film, Window};

/// Pixels along a block's side.
pub(crate) const BLOCK: u32 = 8;
/// Blocks along the side of a tile, which is a unit of work.
const TILE: u32 = 4;
/// Numbers in front of a record's sums: samples of each pixel, and the step of the budget's ladder.
const HEAD: usize = 2;

/// Where the blocks are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid {
    /// All that can be sampled.
    film: Window,
    /// The blocks that the crop touches.
    shown: Window,
    /// The pixels of all blocks: those whose samples reach the blocks that are shown.
    pixels: Window,
    border: u32,
    /// Sums for each pixel.
    stride: usize,
}

impl Grid {
    /// For sums of so many channels.
    pub(crate) fn new(film: &Film, channels: usize) -> Self {
        let (full, border) = (film.sampled(), film.filter.reach());
        let shown = whole_blocks(&film.shown(), &full);
        Self {
            film: full,
            shown,
            pixels: whole_blocks(&shown.grown(border, &full), &full),
            border,
            stride: channels + 1,
        }
    }

    /// Blocks across and down.
    fn size(&self) -> [u32; 2] {
        [self.pixels.width, self.pixels.height].map(|n| n.div_ceil(BLOCK))
    }

    /// How many blocks there are.
    pub(crate) fn blocks(&self) -> usize {
        self.size().map(|n| n as usize).iter().product()
    }

    /// How many tiles there are.
    pub(crate) fn tiles(&self) -> usize {
        let along = |n: u32| n.div_ceil(TILE) as usize;
        self.size().map(along).iter().product()
    }

    /// A tile's blocks.
    pub(crate) fn tile(&self, tile: usize) -> impl Iterator<Item = usize> + use<> {
        let [across, down] = self.size();
        let tiles_across = across.div_ceil(TILE);
        let (x, y) = (tile as u32 % tiles_across, tile as u32 / tiles_across);
        let along = |t: u32, n: u32| t * TILE..((t + 1) * TILE).min(n);
        along(y, down).flat_map(move |y| along(x, across).map(move |x| (y * across + x) as usize))
    }

    /// A block's own pixels.
    pub(crate) fn block(&self, block: usize) -> Window {
        let across = self.size()[0];
        let (x, y) = (block as u32 % across, block as u32 / across);
        let block = Window {
            x: self.pixels.x + x * BLOCK,
            y: self.pixels.y + y * BLOCK,
            width: BLOCK,
            height: BLOCK,
        };
        block.grown(0, &self.pixels)
    }

    /// The pixels that a block's samples reach.
    pub(crate) fn reach(&self, block: usize) -> Window {
        self.block(block).grown(self.border, &self.film)
    }

    /// How many sums a pixel has.
    pub(crate) fn stride(&self) -> usize {
        self.stride
    }

    /// How many numbers a record has.
    fn record(&self) -> usize {
        let side = (BLOCK + 2 * self.border) as usize;
        HEAD + side * side * self.stride
    }

    /// Bytes that all blocks take.
    pub(crate) fn bytes(&self) -> u64 {
        16 * self.blocks() as u64 * self.record() as u64
    }
}

/// The aligned blocks that a window touches, as far as they are on the film.
fn whole_blocks(window: &Window, film: &Window) -> Window {
    let (x, y) = (window.x / BLOCK * BLOCK, window.y / BLOCK * BLOCK);
    let end = |start: u32, size: u32| (start + size).div_ceil(BLOCK) * BLOCK;
    let blocks = Window {
        x,
        y,
        width: end(window.x, window.width) - x,
        height: end(window.y, window.height) - y,
    };
    blocks.grown(0, film)
}

/// What the samples of one half of one block add up to.
#[derive(Clone, Debug)]
pub(crate) struct Record {
    /// Twice the block's number, and one more for the second half.
    pub(crate) slot: usize,
    numbers: Vec<f64>,
}

impl Record {
    /// No samples yet.
    pub(crate) fn new(grid: &Grid, slot: usize) -> Self {
        Self {
            slot,
            numbers: vec![0.0; grid.record()],
        }
    }

    /// Samples of each pixel.
    pub(crate) fn samples_mut(&mut self) -> &mut f64 {
        &mut self.numbers[0]
    }

    /// The step of the budget's ladder that the half takes.
    pub(crate) fn step_mut(&mut self) -> &mut f64 {
        &mut self.numbers[1]
    }

    /// The step of the budget's ladder that the half takes.
    pub(crate) fn step(&self) -> f64 {
        self.numbers[1]
    }

    /// All of it: its head and its sums.
    pub(crate) fn numbers(&self) -> &[f64] {
        &self.numbers
    }

    /// The same, to be filled with what was kept.
    pub(crate) fn numbers_mut(&mut self) -> &mut [f64] {
        &mut self.numbers
    }

    /// The sums over [`Grid::reach`].
    pub(crate) fn sums_mut(&mut self) -> &mut [f64] {
        &mut self.numbers[HEAD..]
    }
}

/// All records.
#[derive(Debug)]
pub(crate) struct Blocks {
    grid: Grid,
    numbers: Vec<f64>,
    tally: Tally,
}

impl Accumulator for Blocks {
    /// The records that a unit added to.
    type Part = (Vec<Record>, Tally);

    fn add(&mut self, (records, tally): &Self::Part) {
        let size = self.grid.record();
        for record in records {
            let sums = &mut self.numbers[record.slot * size..][..size];
            for (sum, value) in sums.iter_mut().zip(&record.numbers) {
                *sum += value;
            }
        }
        self.tally.add(tally);
    }

    fn tally(&self) -> &Tally {
        &self.tally
    }

    fn data(&self) -> &[f64] {
        &self.numbers
    }

    fn kept(&mut self) -> (&mut [f64], &mut Tally) {
        (&mut self.numbers, &mut self.tally)
    }
}

impl Blocks {
    /// No samples yet; fails where the memory is not there.
    pub(crate) fn new(grid: Grid) -> Result<Self> {
        Ok(Self {
            numbers: zeros(2 * grid.blocks() * grid.record(), &grid.pixels)?,
            grid,
            tally: Tally::default(),
        })
    }

    /// Puts records in the place of what was there.
    pub(crate) fn replace(&mut self, (records, tally): &<Self as Accumulator>::Part) {
        let size = self.grid.record();
        for record in records {
            self.numbers[record.slot * size..][..size].copy_from_slice(&record.numbers);
        }
        self.tally.add(tally);
    }

    /// The numbers of each half of each block.
    pub(crate) fn records(&self) -> impl Iterator<Item = &[f64]> {
        self.numbers.chunks_exact(self.grid.record())
    }

    fn record(&self, slot: usize) -> &[f64] {
        let size = self.grid.record();
        &self.numbers[slot * size..][..size]
    }

    /// Each block's own pixels, and how many samples of both halves each of them has.
    pub(crate) fn counts(&self) -> impl Iterator<Item = (Window, u32)> {
        let samples = |block| self.record(2 * block)[0] + self.record(2 * block + 1)[0];
        (0..self.grid.blocks()).map(move |block| (self.grid.block(block), samples(block) as u32))
    }

    /// The step of the ladder that each half of each block takes.
    pub(crate) fn steps(&self) -> Vec<usize> {
        (0..2 * self.grid.blocks())
            .map(|slot| self.record(slot)[1] as usize)
            .collect()
    }

    /// The film by each half, over the blocks that are shown.
    pub(crate) fn halves(&self, layout: &Layout) -> Result<[Sums; 2]> {
        let film = || Sums::new(self.grid.shown, layout.clone());
        let mut halves = [film()?, film()?];
        for (half, film) in halves.iter_mut().enumerate() {
            for block in 0..self.grid.blocks() {
                let record = self.record(2 * block + half);
                if record[0] > 0.0 {
                    let reach = self.grid.reach(block);
                    film.add_rectangle(&reach, &record[HEAD..], 1.0 / record[0]);
                }
            }
        }
        Ok(halves)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_of_a_crop_are_those_of_the_film() {
        let mut film = Film {
            width: 61,
            height: 43,
            ..Film::default()
        };
        film.crop = film.full();
        let whole = Grid::new(&film, 4);
        let all: Vec<Window> = (0..whole.blocks()).map(|b| whole.block(b)).collect();
        let area: u32 = all.iter().map(|w| w.width * w.height).sum();
        assert_eq!(area, 61 * 43);
        let mut by_tile: Vec<usize> = (0..whole.tiles()).flat_map(|t| whole.tile(t)).collect();
        by_tile.sort_unstable();
        assert!(by_tile.into_iter().eq(0..whole.blocks()));
        film.crop = Window {
            x: 19,
            y: 9,
            width: 5,
            height: 30,
        };
        let part = Grid::new(&film, 4);
        assert!(part.blocks() < whole.blocks());
        for block in 0..part.blocks() {
            assert!(all.contains(&part.block(block)));
        }
        // Every sample that reaches a shown pixel is there.
        assert!(
            part.pixels
                .contains(&part.shown.grown(part.border, &part.film))
        );
        assert!(part.shown.contains(&film.crop));
    }
}
