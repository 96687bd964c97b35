//! Samples to sums: a group of samples of one pixel at a time, whose channels are in lanes.
//!
//! Each sample counts in every pixel that its filter reaches, which at equal samples leaves a pixel 0.40× (tent) or 0.30×
//! (gaussian) of the variance that counting each sample once would. Sums within a group are of single precision, beyond
//! it of double.

use crate::filter::{Filter, MAX_RADIUS};
use crate::lanes::{Kernel, Lanes, MAX_LANES, Task, sum_by_halves};
use crate::sensor::Window;

/// The most samples of a group.
pub(crate) const GROUP: usize = MAX_LANES;

/// The most pixels along an axis that a sample reaches.
const MAX_REACH: usize = 2 * (MAX_RADIUS as usize + 1) + 1;

/// Samples of a pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Group {
    pub(crate) pixel: [u32; 2],
    /// How many there are.
    pub(crate) count: usize,
    /// Where they lie within the pixel, across and down, in [0, 1).
    pub(crate) offsets: [[f32; GROUP]; 2],
}

impl Group {
    /// The pixels of the window that the filter reaches.
    #[inline(always)]
    fn reached(&self, filter: &Filter, window: &Window) -> Window {
        let [x, y] = self.pixel;
        let center = Window {
            x,
            y,
            width: 1,
            height: 1,
        };
        center.grown(filter.reach(), window)
    }

    /// Adds the samples to the sums over `window`, `stride` for each pixel, row by row, of which the first are the weight and
    /// the values. How many samples were left out, for they are not finite: their rows become zeros.
    ///
    /// Each sample has a [row](row_length): 1, its values, and zeros.
    pub(crate) fn splat(
        &self,
        kernel: Kernel,
        filter: &Filter,
        rows: &mut [f32],
        window: &Window,
        stride: usize,
        sums: &mut [f64],
    ) -> u32 {
        let length = rows.len() / self.count;
        let mut refused = 0;
        for row in rows.chunks_exact_mut(length) {
            let finite = row.iter().fold(true, |all, value| all & value.is_finite());
            if !finite {
                row.fill(0.0);
                refused += 1;
            }
        }
        let splat = Splat {
            group: self,
            filter,
            rows,
            length,
            window,
            stride,
            sums,
        };
        match self.count {
            1 => splat.single(),
            _ => kernel.run(splat),
        }
        refused
    }
}

/// How many numbers a sample's row has: 1, which becomes its weight, its values, and zeros up to whole lanes.
pub(crate) fn row_length(values: usize) -> usize {
    (1 + values).next_multiple_of(MAX_LANES)
}

/// The arguments of [`Group::splat`].
struct Splat<'a> {
    group: &'a Group,
    filter: &'a Filter,
    rows: &'a [f32],
    /// Of a row.
    length: usize,
    window: &'a Window,
    stride: usize,
    sums: &'a mut [f64],
}

impl Splat<'_> {
    /// The same for a group of one sample, for which lanes would take as long as for a full one.
    fn single(self) {
        let Self {
            group,
            filter,
            rows,
            window,
            stride,
            sums,
            ..
        } = self;
        let [x, y] = group.pixel;
        let [right, below] = group.offsets.map(|row| row[0]);
        let reached = group.reached(filter, window);
        let [first_x, first_y] = [distance(reached.x, x), distance(reached.y, y)];
        let mut columns = [0.0_f32; MAX_REACH];
        let columns = &mut columns[..reached.width as usize];
        for (i, column) in columns.iter_mut().enumerate() {
            *column = filter.weight(first_x + i as f32 - right);
        }
        let start = (reached.y - window.y) as usize * window.width as usize;
        let start = start + (reached.x - window.x) as usize;
        for row in 0..reached.height as usize {
            let down = filter.weight(first_y + row as f32 - below);
            let pixels =
                sums[(start + row * window.width as usize) * stride..].chunks_exact_mut(stride);
            for (pixel, column) in pixels.zip(&*columns) {
                let weight = column * down;
                for (sum, value) in pixel.iter_mut().zip(rows) {
                    *sum += f64::from(value * weight);
                }
            }
        }
    }
}

impl Task for Splat<'_> {
    type Output = ();

    #[inline(always)]
    fn run<F: Lanes>(self) {
        let Self {
            group,
            filter,
            rows,
            length,
            window,
            stride,
            sums,
        } = self;
        let [x, y] = group.pixel;
        let reached = group.reached(filter, window);
        let [first_x, first_y] = [distance(reached.x, x), distance(reached.y, y)];
        let [mut across, mut down] = [[[0.0; GROUP]; MAX_REACH]; 2];
        let across = &mut across[..reached.width as usize];
        let down = &mut down[..reached.height as usize];
        for (i, weight) in across.iter_mut().enumerate() {
            *weight = weights::<F>(filter, &group.offsets[0], first_x + i as f32);
            weight[group.count..].fill(0.0);
        }
        for (i, weight) in down.iter_mut().enumerate() {
            *weight = weights::<F>(filter, &group.offsets[1], first_y + i as f32);
        }
        let start = (reached.y - window.y) as usize * window.width as usize;
        let start = start + (reached.x - window.x) as usize;
        for first in (0..stride.min(length)).step_by(F::WIDTH) {
            let mut values = [F::zero(); GROUP];
            for (value, row) in values.iter_mut().zip(rows.chunks_exact(length)) {
                *value = F::from_slice(&row[first..]);
            }
            let end = stride.min(first + F::WIDTH);
            for (row, down) in down.iter().enumerate() {
                let pixels = &mut sums[(start + row * window.width as usize) * stride..];
                for (pixel, across) in pixels.chunks_exact_mut(stride).zip(&*across) {
                    let weights = products::<F>(across, down);
                    weighted(&values, &weights).add_to(&mut pixel[first..end]);
                }
            }
        }
    }
}

/// The sum of values by weights.
#[inline(always)]
fn weighted<F: Lanes>(values: &[F; GROUP], weights: &[f32; GROUP]) -> F {
    let mut terms = *values;
    for (term, weight) in terms.iter_mut().zip(weights) {
        *term = *term * F::splat(*weight);
    }
    sum_by_halves(terms)
}

/// From the near edge of the samples' own pixel to the middle of another: relative, so that it does not depend on where on
/// the film they are.
#[inline(always)]
fn distance(to: u32, own: u32) -> f32 {
    (f64::from(to) - f64::from(own)) as f32 + 0.5
}

/// The filter's weights along an axis, of samples for a place so far from their pixel's near edge.
#[inline(always)]
fn weights<F: Lanes>(filter: &Filter, offsets: &[f32; GROUP], place: f32) -> [f32; GROUP] {
    let mut weights = [0.0; GROUP];
    for first in (0..GROUP).step_by(F::WIDTH) {
        let offset = F::from_slice(&offsets[first..]);
        let weight = filter.weight(F::splat(place) - offset);
        weight.store_to(&mut weights[first..]);
    }
    weights
}

/// A number a sample times another.
#[inline(always)]
fn products<F: Lanes>(a: &[f32; GROUP], b: &[f32; GROUP]) -> [f32; GROUP] {
    let mut products = [0.0; GROUP];
    for first in (0..GROUP).step_by(F::WIDTH) {
        let product = F::from_slice(&a[first..]) * F::from_slice(&b[first..]);
        product.store_to(&mut products[first..]);
    }
    products
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;
    use crate::math::random;

    /// Every sample counts in every pixel by its weight, but for those that are not finite, with the same bits whatever
    /// the kernel.
    #[test]
    fn sums_are_those_of_samples_one_by_one() {
        let window = Window {
            x: 3,
            y: 5,
            width: 9,
            height: 8,
        };
        let filter = Filter::default();
        for (count, pixel) in [(16, [7, 8]), (5, [3, 12]), (1, [11, 5]), (1, [6, 9])] {
            let number = |key, i: usize| random::unit(random::bits(key, i as u32));
            let offsets: Vec<Vec2> = (0..count)
                .map(|i| Vec2::new(number(1, i), number(2, i)))
                .collect();
            let length = row_length(5);
            let mut rows = vec![0.0; count * length];
            for (i, row) in rows.chunks_exact_mut(length).enumerate() {
                row[0] = 1.0;
                for channel in 0..5 {
                    row[1 + channel] = number(3 + channel as u64, i);
                }
                if i == 3 {
                    row[3] = f32::INFINITY;
                }
            }
            let mut expected = vec![0.0; 9 * 8 * 6];
            for (i, offset) in offsets.iter().enumerate().filter(|(i, _)| *i != 3) {
                for (index, sums) in expected.chunks_exact_mut(6).enumerate() {
                    let center = Vec2::new(3.5 + (index % 9) as f32, 5.5 + (index / 9) as f32);
                    let place = Vec2::new(pixel[0] as f32, pixel[1] as f32) + *offset;
                    let way = center - place;
                    let weight = filter.weight(way.x) * filter.weight(way.y);
                    for (sum, value) in sums.iter_mut().zip(&rows[i * length..]) {
                        *sum += f64::from(weight * value);
                    }
                }
            }
            let row = |axis: usize| {
                std::array::from_fn(|i| offsets.get(i).map_or(0.0, |offset| offset[axis]))
            };
            let group = Group {
                pixel,
                count,
                offsets: [row(0), row(1)],
            };
            let mut first = None;
            for kernel in Kernel::all() {
                let mut sums = vec![0.0; expected.len()];
                let given = &mut rows.clone();
                let refused = group.splat(kernel, &filter, given, &window, 6, &mut sums);
                assert_eq!(refused, u32::from(count > 3));
                for (sum, expected) in sums.iter().zip(&expected) {
                    assert!((sum - expected).abs() < 1e-5, "{sum} {expected}");
                }
                let first = first.get_or_insert_with(|| sums.clone());
                assert!(sums == *first, "{}", kernel.name());
                let mut lanes = vec![0.0; expected.len()];
                kernel.run(Splat {
                    group: &group,
                    filter: &filter,
                    rows: given,
                    length,
                    window: &window,
                    stride: 6,
                    sums: &mut lanes,
                });
                assert!(lanes == sums, "one sample by itself: {}", kernel.name());
            }
        }
    }
}
