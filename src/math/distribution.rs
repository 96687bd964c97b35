//! Discrete and piecewise-constant distributions, sampled by inverting their cumulative sums (PBRT 4th
//! ed., appendix A.4). Sums run in double precision.

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

/// A density on the unit square, constant in each cell of a grid.
#[derive(Clone, Debug)]
pub struct Grid {
    width: usize,
    rows: Discrete,
    columns: Vec<Option<Discrete>>,
}

impl Grid {
    /// From `width` columns of weights, row by row; `None` where no weight is positive.
    pub fn new(width: usize, weights: &[f64]) -> Option<Self> {
        let columns: Vec<_> = weights
            .chunks_exact(width)
            .map(|row| Discrete::new(row.iter().copied()))
            .collect();
        let rows = Discrete::new(
            columns
                .iter()
                .map(|c| c.as_ref().map_or(0.0, Discrete::total)),
        )?;
        Some(Self {
            width,
            rows,
            columns,
        })
    }

    /// A point of the unit square, and its density.
    pub fn sample(&self, u: Vec2) -> (Vec2, f32) {
        let row = self.rows.sample(u.y);
        let columns = self.columns[row.index]
            .as_ref()
            .expect("a drawn row has weight");
        let column = columns.sample(u.x);
        let cells = Vec2::new(self.width as f32, self.columns.len() as f32);
        let p = Vec2::new(
            column.index as f32 + column.rest,
            row.index as f32 + row.rest,
        ) / cells;
        let density =
            row.probability * column.probability * (self.width * self.columns.len()) as f64;
        (p.min(Vec2::splat(1f32.next_down())), density as f32)
    }

    /// The density at `p` in [0, 1)².
    pub fn pdf(&self, p: Vec2) -> f32 {
        let cell = |x: f32, n: usize| ((x * n as f32).max(0.0) as usize).min(n - 1);
        let (row, column) = (cell(p.y, self.columns.len()), cell(p.x, self.width));
        self.columns[row].as_ref().map_or(0.0, |columns| {
            let probability = self.rows.probability(row) * columns.probability(column);
            (probability * (self.width * self.columns.len()) as f64) as f32
        })
    }
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
