//! Discrete and piecewise-constant distributions. Few indices are drawn by inverting their cumulative sums (PBRT 4th
//! ed., appendix A.4), which keeps the order of random numbers; cells of an image, by an alias table. Sums run in double
//! precision.

use glam::Vec2;

/// Indices drawn in proportion to weights.
#[derive(Clone, Debug)]
pub struct Discrete {
    /// Cumulative sums from 0 to the total, one more than there are weights.
    cumulative: Vec<f64>,
}

/// An index drawn from [`Discrete`].
#[derive(Clone, Copy, Debug)]
pub struct Drawn {
    /// Which one.
    pub index: usize,
    /// Its probability.
    pub probability: f64,
    /// The random number stretched over the chosen one's share: in [0, 1), to be used again.
    pub rest: f32,
}

impl Discrete {
    /// `None` where no weight is positive; negative and non-finite weights count as 0.
    pub fn new(weights: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut total = 0.0;
        let mut cumulative = vec![0.0];
        for w in weights {
            total += if w.is_finite() { w.max(0.0) } else { 0.0 };
            cumulative.push(total);
        }
        (total > 0.0 && total.is_finite()).then_some(Self { cumulative })
    }

    /// The sum of the weights.
    pub fn total(&self) -> f64 {
        self.cumulative[self.cumulative.len() - 1]
    }

    /// The probability of `index`.
    pub fn probability(&self, index: usize) -> f64 {
        (self.cumulative[index + 1] - self.cumulative[index]) / self.total()
    }

    /// An index for `u` in [0, 1), never one of weight 0.
    pub fn sample(&self, u: f32) -> Drawn {
        let target = f64::from(u) * self.total();
        let index = self.find(target);
        let (low, high) = (self.cumulative[index], self.cumulative[index + 1]);
        let rest = (((target - low) / (high - low)) as f32).clamp(0.0, 1f32.next_down());
        Drawn {
            index,
            probability: (high - low) / self.total(),
            rest,
        }
    }

    /// The index alone of [`Self::sample`].
    pub fn index(&self, u: f32) -> usize {
        self.find(f64::from(u) * self.total())
    }

    fn find(&self, target: f64) -> usize {
        let after = self.cumulative.partition_point(|&c| c <= target);
        let mut index = after.clamp(1, self.cumulative.len() - 1) - 1;
        while self.cumulative[index + 1] <= self.cumulative[index] {
            index -= 1; // only rounding at the upper end leads here
        }
        index
    }
}

/// Indices drawn in proportion to weights by one look into a table (Walker, *An efficient method for generating discrete
/// random variables with general distributions*, 1977; made as by Vose, 1991): index i of n is drawn, and with some
/// probability exchanged for another.
#[derive(Clone, Debug)]
struct Alias {
    slots: Vec<Slot>,
}

#[derive(Clone, Copy, Debug)]
struct Slot {
    /// From this fraction of the slot on the other index is meant.
    threshold: f32,
    other: u32,
}

impl Alias {
    /// From weights of which at least one is positive and none negative.
    fn new(weights: &[f64], total: f64) -> Self {
        let scale = weights.len() as f64 / total;
        let mut rest: Vec<f64> = weights.iter().map(|w| w * scale).collect();
        let own = |i: usize| Slot {
            threshold: 1.0,
            other: i as u32,
        };
        let mut slots: Vec<Slot> = (0..rest.len()).map(own).collect();
        let (mut small, mut large): (Vec<usize>, Vec<usize>) =
            (0..rest.len()).partition(|&i| rest[i] < 1.0);
        while let (Some(&less), Some(&more)) = (small.last(), large.last()) {
            small.pop();
            slots[less] = Slot {
                threshold: rest[less] as f32,
                other: more as u32,
            };
            rest[more] -= 1.0 - rest[less];
            if rest[more] < 1.0 {
                large.pop();
                small.push(more);
            }
        }
        // Only rounding leaves a slot without its other; where it has no weight, any that has stands for it.
        if let Some(heaviest) =
            (0..weights.len()).max_by(|&a, &b| weights[a].total_cmp(&weights[b]))
        {
            for &left in small.iter().filter(|&&i| weights[i] <= 0.0) {
                slots[left] = Slot {
                    threshold: 0.0,
                    other: heaviest as u32,
                };
            }
        }
        Self { slots }
    }

    /// An index for `u` in [0, 1), and the number stretched over its share.
    #[inline]
    fn sample(&self, u: f32) -> (usize, f32) {
        let at = u * self.slots.len() as f32;
        let first = (at as usize).min(self.slots.len() - 1);
        let within = at - first as f32;
        let Slot { threshold, other } = self.slots[first];
        let (index, rest) = if within < threshold {
            (first, within / threshold)
        } else {
            (other as usize, (within - threshold) / (1.0 - threshold))
        };
        (index, rest.clamp(0.0, 1f32.next_down()))
    }
}

/// A density on the unit square, constant in each cell of a grid.
#[derive(Clone, Debug)]
pub struct Grid {
    width: usize,
    rows: Alias,
    columns: Vec<Option<Alias>>,
    /// Of each cell, row by row.
    densities: Vec<f32>,
}

impl Grid {
    /// From `width` columns of weights, row by row; `None` where no weight is positive. Negative and non-finite weights
    /// count as 0.
    pub fn new(width: usize, weights: &[f64]) -> Option<Self> {
        let weights: Vec<f64> = (weights.iter())
            .map(|w| if w.is_finite() { w.max(0.0) } else { 0.0 })
            .collect();
        let totals: Vec<f64> = (weights.chunks_exact(width))
            .map(|row| row.iter().sum())
            .collect();
        let total: f64 = totals.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let scale = weights.len() as f64 / total;
        let columns = (weights.chunks_exact(width).zip(&totals))
            .map(|(row, total)| (*total > 0.0).then(|| Alias::new(row, *total)));
        Some(Self {
            width,
            rows: Alias::new(&totals, total),
            columns: columns.collect(),
            densities: weights.iter().map(|w| (w * scale) as f32).collect(),
        })
    }

    /// A point of the unit square, and its density.
    pub fn sample(&self, u: Vec2) -> (Vec2, f32) {
        let (row, y) = self.rows.sample(u.y);
        let Some(columns) = &self.columns[row] else {
            unreachable!("a drawn row has weight");
        };
        let (column, x) = columns.sample(u.x);
        let cells = Vec2::new(self.width as f32, self.columns.len() as f32);
        let p = Vec2::new(column as f32 + x, row as f32 + y) / cells;
        let density = self.densities[row * self.width + column];
        (p.min(Vec2::splat(1f32.next_down())), density)
    }

    /// The density at `p` in [0, 1)².
    pub fn pdf(&self, p: Vec2) -> f32 {
        let cell = |x: f32, n: usize| ((x * n as f32).max(0.0) as usize).min(n - 1);
        let (row, column) = (cell(p.y, self.columns.len()), cell(p.x, self.width));
        self.densities[row * self.width + column]
    }

    /// Bytes that a cell takes.
    pub const CELL: usize = size_of::<Slot>() + size_of::<f32>();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random;

    #[test]
    fn indices_come_in_proportion_to_their_weights() {
        let d = Discrete::new([0.0, 1.0, 0.0, 3.0, 0.0]).unwrap();
        let n = 40_000;
        let threes = (0..n)
            .filter(|&i| d.sample(random::unit(random::bits(1, i))).index == 3)
            .count();
        assert!((threes as f64 / f64::from(n) - 0.75).abs() < 0.01);
        for u in [0.0, 0.25, 0.249_999, 1f32.next_down()] {
            assert!(d.probability(d.sample(u).index) > 0.0, "{u}");
        }
        assert!(Discrete::new([0.0, f64::NAN]).is_none());
    }

    #[test]
    fn a_grid_s_samples_have_the_density_that_it_says() {
        let weights = [1.0, 2.0, 0.0, 0.0, 5.0, 3.0];
        let grid = Grid::new(3, &weights).unwrap();
        // Mean of 1/pdf over samples is the area where the density is positive: 4 of 6 cells.
        let n = 20_000;
        let mean: f64 = (0..n)
            .map(|i| {
                let u = Vec2::new(
                    random::unit(random::bits(5, i)),
                    random::unit(random::bits(6, i)),
                );
                let (p, pdf) = grid.sample(u);
                assert!((grid.pdf(p) - pdf).abs() < 1e-4 * pdf);
                1.0 / f64::from(pdf)
            })
            .sum::<f64>()
            / f64::from(n);
        assert!((mean - 4.0 / 6.0).abs() < 0.02, "{mean}");
    }
}
