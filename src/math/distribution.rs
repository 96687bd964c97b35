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

/// A cell drawn from a [`Grid`].
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// A point of the unit square within.
    pub place: Vec2,
    /// Its density there.
    pub density: f32,
}

/// A slot of an alias table: index i of n is drawn, and from a fraction of the slot on exchanged for another (Walker, *An
/// efficient method for generating discrete random variables with general distributions*, 1977; made as by Vose, 1991).
/// What is wanted of either index stands beside it, so that drawing looks at one place in memory.
#[derive(Clone, Copy, Debug)]
struct Slot {
    threshold: f32,
    other: u32,
    /// Of the slot's own index, and of the other.
    densities: [f32; 2],
}

/// The table for weights of which at least one is positive and none negative, with a density each.
fn alias_table(weights: &[f64], total: f64, density: impl Fn(usize) -> f32) -> Vec<Slot> {
    let scale = weights.len() as f64 / total;
    let mut rest: Vec<f64> = weights.iter().map(|w| w * scale).collect();
    let slot = |i: usize, other: usize, threshold: f64| Slot {
        threshold: threshold as f32,
        other: other as u32,
        densities: [density(i), density(other)],
    };
    let mut slots: Vec<Slot> = (0..rest.len()).map(|i| slot(i, i, 1.0)).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) =
        (0..rest.len()).partition(|&i| rest[i] < 1.0);
    while let (Some(&less), Some(&more)) = (small.last(), large.last()) {
        small.pop();
        slots[less] = slot(less, more, rest[less]);
        rest[more] -= 1.0 - rest[less];
        if rest[more] < 1.0 {
            large.pop();
            small.push(more);
        }
    }
    // Only rounding leaves a slot without its other; where it has no weight, the heaviest stands for it.
    let heaviest = (0..weights.len()).max_by(|&a, &b| weights[a].total_cmp(&weights[b]));
    for left in small.into_iter().filter(|&i| weights[i] <= 0.0) {
        slots[left] = slot(left, heaviest.unwrap_or(left), 0.0);
    }
    slots
}

impl Slot {
    /// The slot at `u` in [0, 1), and how far within it.
    #[inline(always)]
    fn at(slots: &[Self], u: f32) -> (usize, f32) {
        let at = u * slots.len() as f32;
        let index = (at as usize).min(slots.len() - 1);
        (index, at - index as f32)
    }

    /// The index that is drawn in slot `own`, the number stretched over its share, and its density.
    #[inline(always)]
    fn draw(&self, own: usize, within: f32) -> (usize, f32, f32) {
        let exchanged = within >= self.threshold;
        let (index, rest) = if exchanged {
            let share = 1.0 - self.threshold;
            (self.other as usize, (within - self.threshold) / share)
        } else {
            (own, within / self.threshold)
        };
        let rest = rest.clamp(0.0, 1f32.next_down());
        (index, rest, self.densities[usize::from(exchanged)])
    }
}

/// A density on the unit square, constant in each cell of a grid. First a row is drawn, then a cell of it.
#[derive(Clone, Debug)]
pub struct Grid {
    width: usize,
    rows: Vec<Slot>,
    /// Row by row; a row without weight is never drawn.
    cells: Vec<Slot>,
}

impl Grid {
    /// From `width` columns of weights, row by row; `None` where no weight is positive. Negative and non-finite weights
    /// count as 0.
    pub fn new(width: usize, weights: &[f64]) -> Option<Self> {
        let positive = |w: &f64| if w.is_finite() { w.max(0.0) } else { 0.0 };
        let weights: Vec<f64> = weights.iter().map(positive).collect();
        let rows: Vec<&[f64]> = weights.chunks_exact(width).collect();
        let totals: Vec<f64> = rows.iter().map(|row| row.iter().sum()).collect();
        let total: f64 = totals.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let scale = weights.len() as f64 / total;
        let cells = rows.iter().zip(&totals).flat_map(|(row, total)| {
            let density = |i: usize| (row[i] * scale) as f32;
            let even = vec![1.0; width];
            // A table that nobody looks at is still one.
            let (weights, total) = match *total > 0.0 {
                true => (*row, *total),
                false => (&even[..], width as f64),
            };
            alias_table(weights, total, density)
        });
        Some(Self {
            width,
            cells: cells.collect(),
            rows: alias_table(&totals, total, |_| 0.0),
        })
    }

    /// A cell for `u` in [0, 1)².
    #[inline(always)]
    pub fn sample(&self, u: Vec2) -> Cell {
        let (slot, within) = Slot::at(&self.rows, u.y);
        let (row, y, _) = self.rows[slot].draw(slot, within);
        let cells = &self.cells[row * self.width..][..self.width];
        let (slot, within) = Slot::at(cells, u.x);
        let (column, x, density) = cells[slot].draw(slot, within);
        let size = Vec2::new(self.width as f32, self.rows.len() as f32);
        let place = Vec2::new(column as f32 + x, row as f32 + y) / size;
        Cell {
            place: place.min(Vec2::splat(1f32.next_down())),
            density,
        }
    }

    /// The density at `p` in [0, 1)².
    pub fn pdf(&self, p: Vec2) -> f32 {
        let cell = |x: f32, n: usize| ((x * n as f32).max(0.0) as usize).min(n - 1);
        let (row, column) = (cell(p.y, self.rows.len()), cell(p.x, self.width));
        self.cells[row * self.width + column].densities[0]
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
                let Cell {
                    place: p,
                    density: pdf,
                } = grid.sample(u);
                assert!((grid.pdf(p) - pdf).abs() < 1e-4 * pdf);
                1.0 / f64::from(pdf)
            })
            .sum::<f64>()
            / f64::from(n);
        assert!((mean - 4.0 / 6.0).abs() < 0.02, "{mean}");
    }
}
