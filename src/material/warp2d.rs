//! Densities on the unit square that are bilinear between the points of a grid, and depend on parameters between whose
//! values they are linear (Dupuy and Jakob, *An adaptive parameterization for efficient material acquisition and
//! rendering*, 2018, with its supplement). A point is drawn by its row and then along it, and every such step can be taken
//! back.

use crate::lanes::Vec2;

/// A table of values or a density for each combination of parameters.
#[derive(Clone, Debug)]
pub(super) struct Warp2D {
    width: usize,
    height: usize,
    /// Ascending values of each parameter, the slowest first.
    parameters: Vec<Vec<f32>>,
    /// Grids, row by row.
    data: Vec<f32>,
    /// Of a density: in each grid the sums up to each interval of rows, and of columns in each row.
    sums: Option<Sums>,
}

#[derive(Clone, Debug)]
struct Sums {
    rows: Vec<f32>,
    columns: Vec<f32>,
}

/// The grids that are mixed at some parameters: their numbers and weights.
pub(super) type Mix = [(usize, f32); 8];

/// A place and the density there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Warped {
    pub(super) place: Vec2<f32>,
    pub(super) density: f32,
}

impl Warp2D {
    /// Values between which it is interpolated. There are as many as `width` · `height` for each combination of
    /// parameters, and two rows and columns at least.
    pub(super) fn table(
        [width, height]: [usize; 2],
        parameters: Vec<Vec<f32>>,
        data: Vec<f32>,
    ) -> Self {
        Self {
            width,
            height,
            parameters,
            data,
            sums: None,
        }
    }

    /// The density in proportion to these values, none of which is negative.
    pub(super) fn density(size: [usize; 2], parameters: Vec<Vec<f32>>, data: Vec<f32>) -> Self {
        let mut this = Self::table(size, parameters, data);
        let [width, height] = size;
        let (across, down) = (0.5 / (width - 1) as f64, 0.5 / (height - 1) as f64);
        let (mut rows, mut columns) = (Vec::new(), Vec::new());
        for grid in this.data.chunks_exact_mut(width * height) {
            let mut totals = Vec::with_capacity(height);
            let first = columns.len();
            for row in grid.chunks_exact(width) {
                let mut sum = 0.0;
                for pair in row.windows(2) {
                    sum += across * (f64::from(pair[0]) + f64::from(pair[1]));
                    columns.push(sum as f32);
                }
                totals.push(sum);
            }
            let begin = rows.len();
            let mut sum = 0.0;
            for pair in totals.windows(2) {
                sum += down * (pair[0] + pair[1]);
                rows.push(sum as f32);
            }
            let scale = if sum > 0.0 { (1.0 / sum) as f32 } else { 0.0 };
            let of_grid = columns[first..].iter_mut().chain(&mut rows[begin..]);
            of_grid.chain(grid).for_each(|value| *value *= scale);
        }
        this.sums = Some(Sums { rows, columns });
        this
    }

    /// Which grids are mixed at these parameters, of which there are as many as the table has.
    pub(super) fn mix(&self, at: &[f32]) -> Mix {
        let mut mix = [(0, 0.0); 8];
        mix[0].1 = 1.0;
        let mut used = 1;
        for (values, x) in self.parameters.iter().zip(at) {
            let last = values.len() - 1;
            let low = values.partition_point(|v| v <= x).clamp(1, last.max(1)) - 1;
            let high = (low + 1).min(last);
            let gap = values[high] - values[low];
            let between = if gap > 0.0 {
                ((x - values[low]) / gap).clamp(0.0, 1.0)
            } else {
                0.0
            };
            for i in (0..used).rev() {
                let (grid, weight) = mix[i];
                let first = grid * values.len();
                mix[2 * i + 1] = (first + high, weight * between);
                mix[2 * i] = (first + low, weight * (1.0 - between));
            }
            used *= 2;
        }
        mix
    }

    /// The mixed value of index `i` of arrays with `size` values a grid.
    fn mixed(array: &[f32], size: usize, mix: &Mix, i: usize) -> f32 {
        let mut sum = 0.0;
        for (grid, weight) in mix {
            if *weight != 0.0 {
                sum += weight * array[grid * size + i];
            }
        }
        sum
    }

    fn value(&self, mix: &Mix, x: usize, y: usize) -> f32 {
        Self::mixed(
            &self.data,
            self.width * self.height,
            mix,
            y * self.width + x,
        )
    }

    /// The cell of a place in [0, 1]², and the place in it.
    fn cell(&self, p: Vec2<f32>) -> ([usize; 2], [f32; 2]) {
        let along = |p: f32, n: usize| {
            let x = p.clamp(0.0, 1.0) * (n - 1) as f32;
            let cell = (x as usize).min(n - 2);
            (cell, x - cell as f32)
        };
        let ((x, fx), (y, fy)) = (along(p.x, self.width), along(p.y, self.height));
        ([x, y], [fx, fy])
    }

    /// The value or density at a place.
    pub(super) fn eval(&self, mix: &Mix, p: Vec2<f32>) -> f32 {
        let ([x, y], [fx, fy]) = self.cell(p);
        let row = |y| lerp(self.value(mix, x, y), self.value(mix, x + 1, y), fx);
        lerp(row(y), row(y + 1), fy)
    }

    /// The sum of the first `count` intervals of rows.
    fn up_to_row(&self, sums: &Sums, mix: &Mix, count: usize) -> f32 {
        match count {
            0 => 0.0,
            _ => Self::mixed(&sums.rows, self.height - 1, mix, count - 1),
        }
    }

    /// The sum of the first `count` intervals of columns in a row.
    fn up_to_column(&self, sums: &Sums, mix: &Mix, row: usize, count: usize) -> f32 {
        let columns = self.width - 1;
        match count {
            0 => 0.0,
            _ => Self::mixed(
                &sums.columns,
                columns * self.height,
                mix,
                row * columns + count - 1,
            ),
        }
    }

    /// The place to which the density takes a point of the unit square.
    pub(super) fn sample(&self, mix: &Mix, u: Vec2<f32>) -> Warped {
        let Some(sums) = &self.sums else {
            return Warped {
                place: u,
                density: 1.0,
            };
        };
        let (rows, columns) = (self.height - 1, self.width - 1);
        let inside = |u: f32| u.clamp(f32::EPSILON, 1.0 - f32::EPSILON);
        let y = inside(u.y) * self.up_to_row(sums, mix, rows);
        let row = first(rows - 1, |i| self.up_to_row(sums, mix, i + 1) >= y);
        let rest = (y - self.up_to_row(sums, mix, row)) * rows as f32;
        let whole = |row| self.up_to_column(sums, mix, row, columns);
        let fy = invert_linear(whole(row), whole(row + 1), rest);
        let up_to = |count| {
            let sum = |row| self.up_to_column(sums, mix, row, count);
            lerp(sum(row), sum(row + 1), fy)
        };
        let x = inside(u.x) * up_to(columns);
        let column = first(columns - 1, |i| up_to(i + 1) >= x);
        let rest = (x - up_to(column)) * columns as f32;
        let value = |x| lerp(self.value(mix, x, row), self.value(mix, x, row + 1), fy);
        let (left, right) = (value(column), value(column + 1));
        let fx = invert_linear(left, right, rest);
        Warped {
            place: Vec2::new(
                (column as f32 + fx) / columns as f32,
                (row as f32 + fy) / rows as f32,
            ),
            density: lerp(left, right, fx),
        }
    }

    /// The point of the unit square that [`Self::sample`] takes to a place.
    pub(super) fn invert(&self, mix: &Mix, place: Vec2<f32>) -> Warped {
        let Some(sums) = &self.sums else {
            return Warped {
                place,
                density: 1.0,
            };
        };
        let (rows, columns) = (self.height - 1, self.width - 1);
        let ([column, row], [fx, fy]) = self.cell(place);
        let value = |x| lerp(self.value(mix, x, row), self.value(mix, x, row + 1), fy);
        let (left, right) = (value(column), value(column + 1));
        let up_to = |count| {
            let sum = |row| self.up_to_column(sums, mix, row, count);
            lerp(sum(row), sum(row + 1), fy)
        };
        let x = up_to(column) + integral(left, right, fx) / columns as f32;
        let whole = |row| self.up_to_column(sums, mix, row, columns);
        let y =
            self.up_to_row(sums, mix, row) + integral(whole(row), whole(row + 1), fy) / rows as f32;
        let of = |part: f32, all: f32| {
            if all > 0.0 {
                (part / all).clamp(0.0, 1.0)
            } else {
                0.0
            }
        };
        Warped {
            place: Vec2::new(
                of(x, up_to(columns)),
                of(y, self.up_to_row(sums, mix, rows)),
            ),
            density: lerp(left, right, fx),
        }
    }
}

fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a * (1.0 - t) + b * t
}

/// The integral from 0 to `t` of what goes from `a` to `b`.
fn integral(a: f32, b: f32, t: f32) -> f32 {
    t * (a + 0.5 * t * (b - a))
}

/// Where that integral is `sum`, in [0, 1].
fn invert_linear(a: f32, b: f32, sum: f32) -> f32 {
    // The form that holds for equal values too.
    let root = (a * a + 2.0 * sum * (b - a)).max(0.0).sqrt();
    let t = 2.0 * sum / (a + root);
    if t.is_finite() {
        t.clamp(0.0, 1.0)
    } else {
        0.0
    }
}

/// The first index for which it holds, of which it does for all after; `last` where for none.
fn first(last: usize, holds: impl Fn(usize) -> bool) -> usize {
    let (mut low, mut high) = (0, last);
    while low < high {
        let middle = (low + high) / 2;
        match holds(middle) {
            true => high = middle,
            false => low = middle + 1,
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random;

    #[test]
    fn warps_are_undone_and_their_density_is_the_area_s_inverse() {
        let number = |i: u32| 0.1 + random::unit(random::bits(5, i)).powi(3);
        let (size, count) = ([5, 4], 2 * 3 * 20);
        let parameters = vec![vec![-1.0, 1.0], vec![0.0, 0.3, 1.5]];
        let warp = Warp2D::density(size, parameters, (0..count).map(number).collect());
        for at in [[-1.0, 0.0], [0.2, 0.9], [7.0, 0.1], [0.0, -3.0]] {
            let mix = warp.mix(&at);
            let total: f32 = mix.iter().map(|(_, weight)| weight).sum();
            assert!((total - 1.0).abs() < 1e-6);
            let mut integral = 0.0;
            for i in 0..400 {
                let u = Vec2::new((i % 20) as f32 + 0.5, (i / 20) as f32 + 0.5) / 20.0;
                integral += f64::from(warp.eval(&mix, u)) / 400.0;
                let there = warp.sample(&mix, u);
                let back = warp.invert(&mix, there.place);
                assert!((back.place.x - u.x).abs() + (back.place.y - u.y).abs() < 2e-4);
                assert!((back.density / there.density - 1.0).abs() < 1e-3);
                let eval = warp.eval(&mix, there.place);
                assert!(
                    (eval / there.density - 1.0).abs() < 1e-3,
                    "{eval} {there:?}"
                );
                let h = 1e-2;
                let beside = |x: f32, y: f32| warp.sample(&mix, Vec2::new(u.x + x, u.y + y)).place;
                let (a, b, c, d) = (
                    beside(-h, 0.0),
                    beside(h, 0.0),
                    beside(0.0, -h),
                    beside(0.0, h),
                );
                let area = ((b.x - a.x) * (d.y - c.y) - (b.y - a.y) * (d.x - c.x)).abs();
                let expected = 4.0 * h * h / there.density;
                assert!((area / expected - 1.0).abs() < 0.1, "{area} {expected}");
            }
            assert!((integral - 1.0).abs() < 0.02, "{integral}");
        }
    }
}
