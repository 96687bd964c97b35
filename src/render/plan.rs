//! How a render is cut into units: the samples into passes, and each pass into the tiles of a grid that is
//! fixed to the full film, whatever the crop. The first pass takes one sample of each pixel, so that there is soon a whole
//! picture. Units have an order, and whatever was done when a render stopped is a beginning of that order.

use std::ops::Range;

use serde::Serialize;

use super::named;
use crate::sensor::{Film, Window};

/// Pixels along a tile's side.
pub(super) const TILE: u32 = 32;
/// Samples of a pixel in one pass; in the first two, together.
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
        let needed = film.shown().grown(film.filter.reach(), &film.sampled());
        Self::of(film, needed, spp)
    }

    /// The same where samples of any pixel bring light to the crop.
    pub(super) fn whole(film: &Film, spp: u32) -> Self {
        Self::of(film, film.sampled(), spp)
    }

    fn of(film: &Film, needed: Window, spp: u32) -> Self {
        let tiles = tiles(&film.sampled(), &needed);
        Self { needed, tiles, spp }
    }

    /// Samples of each pixel.
    pub(super) fn spp(&self) -> u32 {
        self.spp
    }

    /// How many units there are.
    pub(super) fn units(&self) -> usize {
        self.tiles.len() * self.passes() as usize
    }

    /// How many passes there are.
    pub(super) fn passes(&self) -> u32 {
        match self.spp {
            0..=1 => self.spp,
            more => 1 + more.div_ceil(PASS),
        }
    }

    /// The samples that passes before this one take of a pixel.
    fn samples_before(&self, pass: u32) -> u32 {
        match pass {
            0 => 0,
            1 => self.spp.min(1),
            later => self.spp.min((later - 1).saturating_mul(PASS)),
        }
    }

    /// The units of some passes.
    pub(super) fn units_of(&self, passes: Range<u32>) -> Range<usize> {
        passes.start as usize * self.tiles.len()..passes.end as usize * self.tiles.len()
    }

    /// A unit's tile and sample indices.
    pub(super) fn unit(&self, unit: usize) -> (&Window, Range<u32>) {
        let pass = (unit / self.tiles.len()) as u32;
        let samples = self.samples_before(pass)..self.samples_before(pass + 1);
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
        let whole = self.samples_before(passes as u32);
        let begun = self.samples_before(passes as u32 + 1) - whole;
        pixels(&self.tiles) * u64::from(whole) + pixels(&self.tiles[..rest]) * u64::from(begun)
    }

    /// What the first `units` units are of the whole.
    pub(super) fn completed(&self, units: usize) -> Completed {
        let passes = (units / self.tiles.len()) as u32;
        Completed {
            samples: self.samples_before(passes),
            passes: [passes, self.passes()],
            units: [units, self.units()],
        }
    }
}

/// How much of a render is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Completed {
    /// Samples that every pixel has; those of the pass under way may have up to 16 more.
    pub samples: u32,
    /// Passes over the film that are done, and how many there are.
    #[serde(serialize_with = "named::progress")]
    pub passes: [u32; 2],
    /// Tiles of all passes that are done, and how many there are.
    #[serde(serialize_with = "named::progress")]
    pub units: [usize; 2],
}

impl Completed {
    /// What was done since `earlier`, of as much in all.
    pub(super) fn since(&self, earlier: &Self) -> Self {
        Self {
            samples: self.samples - earlier.samples,
            passes: [self.passes[0] - earlier.passes[0], self.passes[1]],
            units: [self.units[0] - earlier.units[0], self.units[1]],
        }
    }

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
    fn passes_take_one_sample_and_then_fill_up_to_whole_groups() {
        for (spp, expected) in [
            (1, &[[0, 1]][..]),
            (2, &[[0, 1], [1, 2]]),
            (16, &[[0, 1], [1, 16]]),
            (33, &[[0, 1], [1, 16], [16, 32], [32, 33]]),
        ] {
            let plan = Plan::new(&Film::default(), spp);
            let ranges = (0..plan.passes()).map(|pass| {
                let units = plan.units_of(pass..pass + 1);
                let [first, last] = [units.start, units.end - 1].map(|unit| plan.unit(unit).1);
                assert_eq!(first, last);
                [first.start, first.end]
            });
            assert!(ranges.eq(expected.iter().copied()), "{spp}");
        }
    }

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
        let tiles = plan.units() / 4;
        assert_eq!(plan.completed(tiles - 1).samples, 0);
        assert_eq!(plan.completed(tiles).samples, 1);
        assert_eq!(plan.completed(3 * tiles + 1).samples, 32);
        assert_eq!(plan.completed(3 * tiles + 1).passes, [3, 4]);
        let all = plan.completed(4 * tiles);
        assert!(all.is_whole() && all.samples == 40);
    }
}
