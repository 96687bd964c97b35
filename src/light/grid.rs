//! Cells of an image, drawn by alias tables: a density on the unit square that is constant in each cell.

use crate::lanes::{Ints, Lanes, Vec2};

/// A slot of an alias table: index i of n is drawn, and from a fraction of the slot on exchanged for another (Walker, *An
/// efficient method for generating discrete random variables with general distributions*, 1977; made as by Vose, 1991).
/// The fraction's bits, and the other index.
type Slot = [u32; 2];

/// The table for weights of which at least one is positive and none negative.
fn alias_table(weights: &[f64], total: f64) -> Vec<Slot> {
    let scale = weights.len() as f64 / total;
    let mut rest: Vec<f64> = weights.iter().map(|w| w * scale).collect();
    let slot = |other: usize, threshold: f64| [(threshold as f32).to_bits(), other as u32];
    let mut slots: Vec<Slot> = (0..rest.len()).map(|i| slot(i, 1.0)).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) =
        (0..rest.len()).partition(|&i| rest[i] < 1.0);
    while let (Some(&less), Some(&more)) = (small.last(), large.last()) {
        small.pop();
        slots[less] = slot(more, rest[less]);
        rest[more] -= 1.0 - rest[less];
        if rest[more] < 1.0 {
            large.pop();
            small.push(more);
        }
    }
    // Only rounding leaves a slot without its other; where it has no weight, the heaviest stands for it.
    let heaviest = (0..weights.len()).max_by(|&a, &b| weights[a].total_cmp(&weights[b]));
    for left in small.into_iter().filter(|&i| weights[i] <= 0.0) {
        slots[left] = slot(heaviest.unwrap_or(left), 0.0);
    }
    slots
}

/// Draws one of `n` indices by numbers in [0, 1), of tables that begin at slot `start`; and the numbers stretched over the
/// indices' shares, in [0, 1) again.
#[inline(always)]
fn draw<F: Lanes>(slots: &[Slot], start: F::Int, n: usize, u: F) -> (F::Int, F) {
    let at = u * F::splat(n as f32);
    let own = at.to_int().min(Ints::splat(n as u32 - 1));
    let within = at - own.to_float();
    let (table, place) = (slots.as_flattened(), (start + own).shl::<1>());
    let threshold = F::Int::gather(table, place).from_bits();
    let other = F::Int::gather(table, place + Ints::splat(1));
    let keeps = within.lt(threshold);
    let past = (within - threshold) / (F::one() - threshold);
    let rest = F::select(keeps, within / threshold, past);
    (
        F::Int::select(keeps, own, other),
        rest.clamp(0.0, 1f32.next_down()),
    )
}

/// A density on the unit square, constant in each cell of a grid. First a row is drawn, then a cell of it.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    width: usize,
    rows: Vec<Slot>,
    /// Row by row; a row without weight is never drawn.
    cells: Vec<Slot>,
    /// Of each cell.
    densities: Vec<f32>,
}

impl Grid {
    /// From `width` columns of weights, row by row; `None` where no weight is positive. Negative and non-finite weights
    /// count as 0.
    pub(super) fn new(width: usize, weights: &[f64]) -> Option<Self> {
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
            let even = vec![1.0; width];
            // A table that nobody looks at is still one.
            match *total > 0.0 {
                true => alias_table(row, *total),
                false => alias_table(&even, width as f64),
            }
        });
        Some(Self {
            width,
            cells: cells.collect(),
            rows: alias_table(&totals, total),
            densities: weights.iter().map(|w| (w * scale) as f32).collect(),
        })
    }

    /// Points of the unit square for `u` in [0, 1)², and their densities.
    #[inline(always)]
    pub(super) fn sample<F: Lanes>(&self, u: Vec2<F>) -> (Vec2<F>, F) {
        let (row, y) = draw(&self.rows, F::Int::splat(0), self.rows.len(), u.y);
        let start = row * Ints::splat(self.width as u32);
        let (column, x) = draw(&self.cells, start, self.width, u.x);
        let density = F::gather(&self.densities, start + column);
        let below = F::splat(1f32.next_down());
        let place = Vec2::new(
            ((column.to_float() + x) / F::splat(self.width as f32)).min(below),
            ((row.to_float() + y) / F::splat(self.rows.len() as f32)).min(below),
        );
        (place, density)
    }

    /// The densities at points in [0, 1)².
    #[inline(always)]
    pub(super) fn pdf<F: Lanes>(&self, p: Vec2<F>) -> F {
        let cell = |x: F, n: usize| {
            let at = (x * F::splat(n as f32)).max(F::zero());
            at.to_int().min(Ints::splat(n as u32 - 1))
        };
        let row = cell(p.y, self.rows.len());
        let column = cell(p.x, self.width);
        F::gather(
            &self.densities,
            row * Ints::splat(self.width as u32) + column,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random;

    #[test]
    fn a_grid_s_samples_have_the_density_that_it_says() {
        let weights = [1.0, 2.0, 0.0, 0.0, 5.0, 3.0];
        let grid = Grid::new(3, &weights).unwrap();
        // Mean of 1/pdf over samples is the area where the density is positive: 4 of 6 cells.
        let n = 20_000;
        let mean: f64 = (0..n)
            .map(|i| {
                let u = Vec2::<f32>::new(
                    random::unit(random::bits(5, i)),
                    random::unit(random::bits(6, i)),
                );
                let (p, pdf) = grid.sample::<f32>(u);
                assert!((grid.pdf(p) - pdf).abs() < 1e-4 * pdf);
                1.0 / f64::from(pdf)
            })
            .sum::<f64>()
            / f64::from(n);
        assert!((mean - 4.0 / 6.0).abs() < 0.02, "{mean}");
    }
}
