//! Samples to sums: a group of samples of one pixel at a time, in lanes.
//!
//! Each sample counts in every pixel that its filter reaches, which at equal samples leaves a pixel 0.40× (tent) or 0.30×
//! (gaussian) of the variance that counting each sample once would. Sums within a group are of single precision, beyond
//! it of double.

use crate::filter::{Filter, MAX_RADIUS};
use crate::lanes::{Kernel, Lanes, MAX_LANES, Mask as _, Task};
use crate::sensor::Window;

/// The most samples of a group.
pub(crate) const GROUP: usize = MAX_LANES;

/// Columns of pixels that samples are added to at once: as many as common filters reach.
const COLUMNS: usize = 5;

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
    /// the values. How many samples were left out, for they are not finite.
    ///
    /// A sample's values stand in a row a channel.
    pub(crate) fn splat(
        &self,
        kernel: Kernel,
        filter: &Filter,
        values: &[[f32; GROUP]],
        window: &Window,
        stride: usize,
        sums: &mut [f64],
    ) -> u32 {
        let splat = Splat {
            group: self,
            filter,
            values,
            window,
            stride,
            sums,
        };
        match self.count {
            1 => splat.single(),
            _ => kernel.run(splat),
        }
    }
}

/// The arguments of [`Group::splat`].
struct Splat<'a> {
    group: &'a Group,
    filter: &'a Filter,
    values: &'a [[f32; GROUP]],
    window: &'a Window,
    stride: usize,
    sums: &'a mut [f64],
}

impl Splat<'_> {
    /// The same for a group of one sample, for which lanes would take as long as for a full one.
    fn single(self) -> u32 {
        let Self {
            group,
            filter,
            values,
            window,
            stride,
            sums,
        } = self;
        if !values.iter().all(|row| row[0].is_finite()) {
            return 1;
        }
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
                let [sum, sums @ ..] = pixel else {
                    return 0;
                };
                *sum += f64::from(weight);
                for (sum, value) in sums.iter_mut().zip(values) {
                    *sum += f64::from(value[0] * weight);
                }
            }
        }
        0
    }
}

/// A number for each sample: as many lanes as that takes.
type Numbers<F> = [F; GROUP];

/// How many of them are used.
#[inline(always)]
fn parts<F: Lanes>() -> usize {
    GROUP / F::WIDTH
}

#[inline(always)]
fn load<F: Lanes>(row: &[f32; GROUP]) -> Numbers<F> {
    let mut numbers = [F::zero(); GROUP];
    for part in 0..parts::<F>() {
        numbers[part] = F::from_slice(&row[part * F::WIDTH..]);
    }
    numbers
}

impl Task for Splat<'_> {
    type Output = u32;

    #[inline(always)]
    fn run<F: Lanes>(self) -> u32 {
        let Self {
            group,
            filter,
            values,
            window,
            stride,
            sums,
        } = self;
        let (accepted, refused) = accepted::<F>(group.count, values);
        let [x, y] = group.pixel;
        let reached = group.reached(filter, window);
        let [first_x, first_y] = [distance(reached.x, x), distance(reached.y, y)];
        for left in (0..reached.width).step_by(COLUMNS) {
            let mut columns = [[0.0; GROUP]; COLUMNS];
            let columns = &mut columns[..COLUMNS.min((reached.width - left) as usize)];
            for (i, column) in (left..).zip(&mut *columns) {
                let weight = weights::<F>(filter, &group.offsets[0], first_x + i as f32);
                for part in 0..parts::<F>() {
                    weight[part].store_to(&mut column[part * F::WIDTH..]);
                }
            }
            let start = (reached.x - window.x + left) as usize;
            for row in 0..reached.height {
                let down = weights::<F>(filter, &group.offsets[1], first_y + row as f32);
                let above = (reached.y - window.y + row) as usize * window.width as usize;
                let pixels = sums[(above + start) * stride..].chunks_exact_mut(stride);
                for (pixel, column) in pixels.zip(&*columns) {
                    let mut weight = load::<F>(column);
                    for part in 0..parts::<F>() {
                        let product = weight[part] * down[part];
                        weight[part] = F::select(accepted[part], product, F::zero());
                    }
                    let [sum, sums @ ..] = pixel else {
                        return refused;
                    };
                    *sum += f64::from(F::sum(&weight));
                    for (sum, value) in sums.iter_mut().zip(values) {
                        let mut weighted = load::<F>(value);
                        for part in 0..parts::<F>() {
                            let product = weighted[part] * weight[part];
                            weighted[part] = F::select(accepted[part], product, F::zero());
                        }
                        *sum += f64::from(F::sum(&weighted));
                    }
                }
            }
        }
        refused
    }
}

/// Which samples are finite; and how many are not.
#[inline(always)]
fn accepted<F: Lanes>(count: usize, values: &[[f32; GROUP]]) -> ([F::Mask; GROUP], u32) {
    let mut accepted = [F::Mask::splat(false); GROUP];
    let mut refused = 0;
    for part in 0..parts::<F>() {
        let here = count.saturating_sub(part * F::WIDTH).min(F::WIDTH);
        let there = F::Mask::from_bits(!(u32::MAX << here));
        let mut finite = there;
        for value in values {
            finite = finite & F::from_slice(&value[part * F::WIDTH..]).is_finite();
        }
        accepted[part] = finite;
        refused += (there & !finite).to_bits().count_ones();
    }
    (accepted, refused)
}

/// From the near edge of the samples' own pixel to the middle of another: relative, so that it does not depend on where on
/// the film they are.
#[inline(always)]
fn distance(to: u32, own: u32) -> f32 {
    (f64::from(to) - f64::from(own)) as f32 + 0.5
}

/// The filter's weights along an axis, of samples for a place so far from their pixel's near edge.
#[inline(always)]
fn weights<F: Lanes>(filter: &Filter, offsets: &[f32; GROUP], place: f32) -> Numbers<F> {
    let mut weights = load::<F>(offsets);
    for weight in &mut weights[..parts::<F>()] {
        *weight = filter.weight(F::splat(place) - *weight);
    }
    weights
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
            let mut values = [[f32::NAN; GROUP]; 5];
            for (channel, row) in values.iter_mut().enumerate() {
                for (i, value) in row.iter_mut().enumerate().take(count) {
                    *value = number(3 + channel as u64, i);
                }
            }
            values[2][3] = f32::INFINITY;
            let mut expected = vec![0.0; 9 * 8 * 6];
            for (i, offset) in offsets.iter().enumerate().filter(|(i, _)| *i != 3) {
                for (index, sums) in expected.chunks_exact_mut(6).enumerate() {
                    let center = Vec2::new(3.5 + (index % 9) as f32, 5.5 + (index / 9) as f32);
                    let place = Vec2::new(pixel[0] as f32, pixel[1] as f32) + *offset;
                    let way = center - place;
                    let weight = filter.weight(way.x) * filter.weight(way.y);
                    sums[0] += f64::from(weight);
                    for (sum, row) in sums[1..].iter_mut().zip(&values) {
                        *sum += f64::from(weight * row[i]);
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
                let refused = group.splat(kernel, &filter, &values, &window, 6, &mut sums);
                assert_eq!(refused, u32::from(count > 3));
                for (sum, expected) in sums.iter().zip(&expected) {
                    assert!((sum - expected).abs() < 1e-5, "{sum} {expected}");
                }
                let first = first.get_or_insert_with(|| sums.clone());
                assert!(sums == *first, "{}", kernel.name());
                let mut lanes = vec![0.0; expected.len()];
                let splat = Splat {
                    group: &group,
                    filter: &filter,
                    values: &values,
                    window: &window,
                    stride: 6,
                    sums: &mut lanes,
                };
                assert_eq!(kernel.run(splat), refused);
                assert!(lanes == sums, "one sample by itself: {}", kernel.name());
            }
        }
    }
}
