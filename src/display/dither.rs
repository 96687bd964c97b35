//! Dither: what lies between two codes becomes one or the other by a threshold that changes from pixel to pixel, so that
//! no band is seen and means are kept. Thresholds are blue noise, whose patterns are fine: a tile made by voids and
//! clusters (Ulichney, *The void-and-cluster method for dither array generation*, 1993).

use std::sync::LazyLock;

/// The tile's width and height: a power of two.
const SIZE: usize = 64;
const CELLS: usize = SIZE * SIZE;

/// The threshold in (0, 1) of a pixel's channel; channels have tiles that are moved, so that they are not alike.
pub(super) fn threshold(x: usize, y: usize, channel: usize) -> f32 {
    let (x, y) = (x + 23 * channel, y + 41 * channel);
    let rank = TILE[y % SIZE * SIZE + x % SIZE];
    (f32::from(rank) + 0.5) / CELLS as f32
}

/// The order in which cells are filled.
static TILE: LazyLock<Vec<u16>> = LazyLock::new(tile);

fn tile() -> Vec<u16> {
    let mut energy = Energy::new();
    // Points that keep a distance, to begin with: every void is filled, until a tenth is.
    for _ in 0..CELLS / 10 {
        let void = energy.void();
        energy.change(void, true);
    }
    // Those that stand closest are moved into the largest void, until they would go back to where they came from.
    loop {
        let cluster = energy.cluster();
        energy.change(cluster, false);
        let void = energy.void();
        energy.change(void, true);
        if void == cluster {
            break;
        }
    }
    let begun = energy.clone();
    let mut ranks = vec![0; CELLS];
    for rank in (0..CELLS / 10).rev() {
        let cluster = energy.cluster();
        energy.change(cluster, false);
        ranks[cluster] = rank as u16;
    }
    let mut energy = begun;
    for rank in CELLS / 10..CELLS {
        let void = energy.void();
        energy.change(void, true);
        ranks[void] = rank as u16;
    }
    ranks
}

/// How crowded each cell of the tile is, which has no edges.
#[derive(Clone)]
struct Energy {
    filled: Vec<bool>,
    crowd: Vec<f32>,
    /// What a point adds to the cell at a distance, by dy and dx.
    bell: Vec<f32>,
}

impl Energy {
    fn new() -> Self {
        const SIGMA: f32 = 1.9;
        let apart = |i: usize| i.min(SIZE - i) as f32;
        let bell = |i: usize| {
            let square = apart(i % SIZE).powi(2) + apart(i / SIZE).powi(2);
            (-0.5 * square / (SIGMA * SIGMA)).exp()
        };
        Self {
            filled: vec![false; CELLS],
            // Cells that are equal but for this are taken in an order without a pattern.
            crowd: (0..CELLS)
                .map(|i| (i * 2_654_435_761 % CELLS) as f32 * 1e-9)
                .collect(),
            bell: (0..CELLS).map(bell).collect(),
        }
    }

    fn change(&mut self, cell: usize, fill: bool) {
        self.filled[cell] = fill;
        let sign = if fill { 1.0 } else { -1.0 };
        let (x, y) = (cell % SIZE, cell / SIZE);
        for (row, crowd) in self.crowd.chunks_exact_mut(SIZE).enumerate() {
            let bell = &self.bell[(row + SIZE - y) % SIZE * SIZE..][..SIZE];
            for (column, crowd) in crowd.iter_mut().enumerate() {
                *crowd += sign * bell[(column + SIZE - x) % SIZE];
            }
        }
    }

    /// The filled cell that is most crowded.
    fn cluster(&self) -> usize {
        let filled = (0..CELLS).filter(|i| self.filled[*i]);
        filled
            .max_by(|a, b| self.crowd[*a].total_cmp(&self.crowd[*b]))
            .expect("some are filled")
    }

    /// The empty cell that is least crowded.
    fn void(&self) -> usize {
        let empty = (0..CELLS).filter(|i| !self.filled[*i]);
        empty
            .min_by(|a, b| self.crowd[*a].total_cmp(&self.crowd[*b]))
            .expect("some are empty")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_threshold_is_there_once() {
        let mut seen = TILE.clone();
        seen.sort_unstable();
        assert!(
            seen.iter()
                .enumerate()
                .all(|(i, rank)| usize::from(*rank) == i)
        );
    }

    /// Of a pattern that is a quarter full, the power of the lowest frequencies is far below that of white noise, which has
    /// the same everywhere.
    #[test]
    fn low_frequencies_have_little_power() {
        let pattern: Vec<f64> = TILE
            .iter()
            .map(|rank| {
                if usize::from(*rank) < CELLS / 4 {
                    1.0
                } else {
                    0.0
                }
            })
            .collect();
        let power = |fx: usize, fy: usize| {
            let (mut re, mut im) = (0.0, 0.0);
            for (i, value) in pattern.iter().enumerate() {
                let turn = (fx * (i % SIZE) + fy * (i / SIZE)) as f64 / SIZE as f64;
                let (sin, cos) = (std::f64::consts::TAU * turn).sin_cos();
                re += value * cos;
                im += value * sin;
            }
            (re * re + im * im) / CELLS as f64 / (0.25 * 0.75)
        };
        let low = [(1, 0), (0, 1), (1, 1), (2, 1), (3, 2), (0, 4)];
        let mean = low.iter().map(|(x, y)| power(*x, *y)).sum::<f64>() / low.len() as f64;
        assert!(mean < 0.1, "{mean}");
    }
}
