//! How a render is cut into units: the samples into passes, and each pass into the tiles of a grid that is
//! fixed to the full film, whatever the crop. Units have an order, and whatever was done when a render
//! stopped is a beginning of that order.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::sensor::{Film, Window};

/// Pixels along a tile's side.
pub(super) const TILE: u32 = 32;
/// Samples of a pixel in one pass.
pub(super) const PASS: u32 = 16;

/// The units of a render, in their order.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    /// The pixels whose samples reach the crop, as they do in the full image.
    pub(super) needed: Window,
    tiles: Vec<Window>,
    spp: u32,
}

impl Plan {
    pub(super) fn new(film: &Film, spp: u32) -> Self {
        let full = film.sampled();
        let needed = film.shown().grown(film.filter.reach(), &full);
        let tiles = tiles(&full, &needed);
        Self { needed, tiles, spp }
    }

    /// How many units there are.
    pub(super) fn units(&self) -> usize {
        self.tiles.len() * self.passes() as usize
    }

    fn passes(&self) -> u32 {
        self.spp.div_ceil(PASS)
    }

    /// A unit's tile and sample indices.
    pub(super) fn unit(&self, unit: usize) -> (&Window, Range<u32>) {
        let first = (unit / self.tiles.len()) as u32 * PASS;
        let samples = first..self.spp.min(first + PASS);
        (&self.tiles[unit % self.tiles.len()], samples)
    }

    /// Samples in the first `units` units.
    pub(super) fn samples(&self, units: usize) -> u64 {
        let pixels = |tiles: &[Window]| -> u64 {
            tiles
                .iter()
                .map(|tile| {
                    let tile = tile.grown(0, &self.needed);
                    u64::from(tile.width) * u64::from(tile.height)
                })
                .sum()
        };
        let (passes, rest) = (units / self.tiles.len(), units % self.tiles.len());
        let whole = self.spp.min(passes as u32 * PASS);
        let begun = self.spp.min(whole + PASS) - whole;
        pixels(&self.tiles) * u64::from(whole) + pixels(&self.tiles[..rest]) * u64::from(begun)
    }

    /// What the first `units` units are of the whole.
    pub(super) fn completed(&self, units: usize) -> Completed {
        let passes = (units / self.tiles.len()) as u32;
        Completed {
            samples: self.spp.min(passes * PASS),
            passes: [passes, self.passes()],
            units: [units, self.units()],
        }
    }
}

/// How much of a render is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Completed {
    /// Samples that every pixel has; those of the pass under way may have up to 16 more.
    pub samples: u32,
    /// Passes over the film that are done, and how many there are.
    pub passes: [u32; 2],
    /// Tiles of all passes that are done, and how many there are.
    pub units: [usize; 2],
}

impl Completed {
    /// Whether nothing is left to do.
    pub fn is_whole(&self) -> bool {
        self.units[0] == self.units[1]
    }
}

/// A tile's own pixels, for the tiles that are needed at all.
fn tiles(film: &Window, needed: &Window) -> Vec<Window> {
    let along =
        |start: u32, size: u32| (start / TILE..(start + size).div_ceil(TILE)).map(|t| t * TILE);
    let mut tiles = Vec::new();
    for y in along(needed.y, needed.height) {
        for x in along(needed.x, needed.width) {
            tiles.push(
                Window {
                    x,
                    y,
                    width: TILE,
                    height: TILE,
                }
                .grown(0, film),
            );
        }
    }
    tiles
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_units_before_a_unit_hold_its_samples_and_all_hold_all() {
        let film = Film {
            width: 70,
            height: 40,
            crop: Window {
                x: 5,
                y: 3,
                width: 61,
                height: 33,
            },
            ..Film::default()
        };
        let plan = Plan::new(&film, 37);
        let mut samples = 0;
        for unit in 0..plan.units() {
            assert_eq!(plan.samples(unit), samples, "{unit}");
            let (tile, range) = plan.unit(unit);
            let tile = tile.grown(0, &plan.needed);
            samples += u64::from(tile.width * tile.height) * range.len() as u64;
        }
        assert_eq!(plan.samples(plan.units()), samples);
        assert_eq!(
            samples,
            37 * u64::from(plan.needed.width * plan.needed.height)
        );
    }

    #[test]
    fn what_is_complete_is_told_in_samples_that_every_pixel_has() {
        let plan = Plan::new(&Film::default(), 40);
        let tiles = plan.units() / 3;
        assert_eq!(plan.completed(tiles - 1).samples, 0);
        assert_eq!(plan.completed(2 * tiles + 1).samples, 32);
        assert_eq!(plan.completed(2 * tiles + 1).passes, [2, 3]);
        let all = plan.completed(3 * tiles);
        assert!(all.is_whole() && all.samples == 40);
    }
}
