//! Triangles in the picture: corners on a grid of fixed-point numbers, edge functions in integers, which are exact, and the
//! top-left rule (Pineda, *A parallel algorithm for polygon rendering*, 1988). So a sample on an edge that two triangles share
//! belongs to one of them, and a closed surface has neither cracks nor samples that are drawn twice.
//!
//! What an edge leaves of a long row of samples is computed by one division.

use super::projection::Place;
use crate::lanes::Doubles as _;
use crate::sensor::Window;

/// Fixed-point coordinates are below 2 to that power, so that edge functions fit into 64 bits.
const COORDINATE_BITS: u32 = 29;

/// The picture, and the grid that corners are moved to.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    /// The first pixel, across and down.
    first: [u32; 2],
    /// How many there are.
    size: [u32; 2],
    /// Bits of a coordinate's fraction of a pixel.
    bits: u32,
    /// Where samples lie within a pixel.
    samples: Vec<[i64; 2]>,
    /// The least and the greatest of those coordinates.
    inset: [[i64; 2]; 2],
}

/// A corner.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Corner {
    /// On the grid; `UNPLACED` where the triangle has to be cut first, and then which limits it is beyond.
    pub(super) x: i32,
    pub(super) y: i32,
}

/// Where the first pixels of a corner's row and column are whose samples are not before it, and, less than nothing, where the
/// last are whose samples are not after it; within the picture, in steps of the grid. The least of those of a triangle's
/// corners tell in which pixels it may have samples.
pub(super) type Reach = [i32; 4];

/// How pixels along an axis are found by bits of coordinates.
pub(super) struct Steps {
    /// Where the first pixel begins on the grid of the whole picture.
    pub(super) origin: i32,
    /// The bits that are no fraction of a pixel.
    pub(super) whole: i32,
    /// What is added to a coordinate for the first pixel, and for the last.
    pub(super) to_first: i32,
    pub(super) to_last: i32,
    /// The picture's last pixel.
    pub(super) last: i32,
}

impl Corner {
    const UNPLACED: i32 = i32::MIN;

    /// One that is beyond some limits, a bit each.
    pub(super) fn outside(beyond: i32) -> Self {
        Self {
            x: Self::UNPLACED,
            y: beyond,
        }
    }

    /// A bit for each limit that it is beyond.
    #[inline]
    pub(super) fn beyond(&self) -> i32 {
        match self.x {
            Self::UNPLACED => self.y,
            _ => 0,
        }
    }
}

impl Grid {
    /// For a window of a picture of that size. The grid is the picture's, whatever the window.
    pub(super) fn new(picture: [u32; 2], window: &Window, pattern: &super::Pattern) -> Self {
        let largest = picture[0].max(picture[1]).max(1);
        // The band is four times as wide as the picture.
        let whole = (4 * largest).next_power_of_two().ilog2();
        let bits = COORDINATE_BITS - whole;
        let samples = pattern.fixed(bits);
        let inset = [0, 1].map(|axis| {
            let along = samples.iter().map(|sample| sample[axis]);
            [along.clone().min().unwrap_or(0), along.max().unwrap_or(0)]
        });
        Self {
            first: [window.x, window.y],
            size: [window.width, window.height],
            bits,
            samples,
            inset,
        }
    }

    /// How far coordinates may reach, in pixels.
    pub(super) fn band(&self) -> f64 {
        f64::from(1_u32 << (COORDINATE_BITS - self.bits))
    }

    /// How many rows of pixels there are.
    pub(super) fn rows(&self) -> u32 {
        self.size[1]
    }

    /// A place on the grid. It must lie within the band.
    #[inline]
    pub(super) fn corner(&self, place: &Place) -> Corner {
        let scale = self.scale() / place.w;
        let [x, y] = [place.x * scale, place.y * scale].map(|v| v.to_nearest().0.cast_signed());
        let [left, top] = self.origin();
        Corner {
            x: x - left,
            y: y - top,
        }
    }

    /// Steps of the grid to a pixel.
    pub(super) fn scale(&self) -> f64 {
        f64::from(1_u32 << self.bits)
    }

    /// The upper left corner of the first pixel on the picture's grid.
    pub(super) fn origin(&self) -> [i32; 2] {
        self.first.map(|first| (first << self.bits).cast_signed())
    }

    /// How pixels along an axis are found, as [`Grid::pixels`] has them.
    pub(super) fn steps(&self, axis: usize) -> Steps {
        let pixel = 1_i32 << self.bits;
        let [low, high] = self.inset[axis].map(|inset| inset as i32);
        Steps {
            origin: self.origin()[axis],
            whole: -pixel,
            to_first: pixel - 1 - high,
            to_last: -low,
            last: (self.size[axis].cast_signed() - 1) << self.bits,
        }
    }

    /// A corner's reach.
    #[cfg(test)]
    pub(super) fn reach(&self, corner: &Corner) -> Reach {
        let axis = |axis: usize, coordinate: i32| {
            let (first, last) = self.pixels(axis, coordinate, coordinate);
            [first, -last].map(|pixel| (pixel << self.bits) as i32)
        };
        let ([left, right], [top, bottom]) = (axis(0, corner.x), axis(1, corner.y));
        [left, top, right, bottom]
    }

    /// The reach of a corner that lies anywhere.
    pub(super) const EVERYWHERE: Reach = [i32::MIN / 4; 4];

    /// The pixels along an axis that a range of coordinates may have samples in.
    #[inline]
    fn pixels(&self, axis: usize, least: i32, greatest: i32) -> (i64, i64) {
        let [low, high] = self.inset[axis];
        let first = (i64::from(least) - high + (1 << self.bits) - 1) >> self.bits;
        let last = (i64::from(greatest) - low) >> self.bits;
        (first.max(0), last.min(i64::from(self.size[axis]) - 1))
    }

    /// The triangle with these corners, unless it has no samples in the picture.
    #[inline]
    pub(super) fn triangle(&self, corners: [Corner; 3]) -> Option<Facet> {
        let [a, b, c] = corners;
        let (left, right) = self.pixels(0, a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x));
        if left > right {
            return None;
        }
        let (top, bottom) = self.pixels(1, a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y));
        if top > bottom {
            return None;
        }
        let area = edge(&a, &b, i64::from(c.x), i64::from(c.y));
        if area == 0 {
            return None;
        }
        Some(Facet {
            corners: if area > 0 { [a, b, c] } else { [a, c, b] },
            area: area.abs(),
            is_turned: area < 0,
            columns: (left, right),
            rows: (top, bottom),
        })
    }
}

/// Twice the area of a point and an edge, positive on its right as seen with y down.
#[inline]
fn edge(from: &Corner, to: &Corner, x: i64, y: i64) -> i64 {
    let (dx, dy) = (
        i64::from(to.x) - i64::from(from.x),
        i64::from(to.y) - i64::from(from.y),
    );
    dx * (y - i64::from(from.y)) - dy * (x - i64::from(from.x))
}

/// A triangle that may have samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    /// Clockwise as seen with y down.
    corners: [Corner; 3],
    /// Twice.
    area: i64,
    /// Whether that is not the order in which they were given.
    pub(super) is_turned: bool,
    /// The first and the last pixel across.
    columns: (i64, i64),
    /// And down.
    rows: (i64, i64),
}

impl Facet {
    /// How many rows of pixels it reaches over.
    pub(super) fn height(&self) -> i64 {
        self.rows.1 - self.rows.0 + 1
    }

    /// The rows from the first to before the last that it may have samples in.
    pub(super) fn reaches(&self, rows: &std::ops::Range<u32>) -> bool {
        self.rows.0 < i64::from(rows.end) && self.rows.1 >= i64::from(rows.start)
    }

    /// Gives the samples that it covers in some rows of the picture: index of the pixel and of the sample, and there what is
    /// linear over the picture, of which `linear` knows what it is at the corners as they were given.
    #[inline]
    pub(super) fn cover(
        &self,
        grid: &Grid,
        rows: std::ops::Range<u32>,
        linear: impl Fn() -> [f64; 3],
        mut take: impl FnMut(usize, usize, f64),
    ) {
        let [a, b, c] = &self.corners;
        let mut known = None;
        let top = self.rows.0.max(i64::from(rows.start));
        let bottom = self.rows.1.min(i64::from(rows.end) - 1);
        let begin = [self.columns.0 << grid.bits, top << grid.bits];
        let edges = [(b, c), (c, a), (a, b)].map(|(from, to)| Edge::new(from, to, begin));
        let step = 1_i64 << grid.bits;
        let last = self.columns.1 - self.columns.0;
        let mut along = |values: [i64; 3]| {
            // Most triangles of a fine mesh cover nothing, and need not know.
            let know = || (1.0 / self.area as f64, linear());
            let (scale, [first, second, third]) = *known.get_or_insert_with(know);
            let [u, v, w] = values.map(|value| value as f64 * scale);
            match self.is_turned {
                false => u * first + v * second + w * third,
                true => u * first + v * third + w * second,
            }
        };
        // All within if none is negative.
        let is_within = |values: &[i64; 3]| {
            let [u, v, w] = [0, 1, 2].map(|i| values[i] - edges[i].least);
            u | v | w >= 0
        };
        if last == 0 && top == bottom {
            // As most that are left of a fine mesh.
            let pixel = (top * i64::from(grid.size[0]) + self.columns.0) as usize;
            for (sample, inset) in grid.samples.iter().enumerate() {
                let values = edges.each_ref().map(|edge| edge.moved(*inset));
                if is_within(&values) {
                    take(pixel, sample, along(values));
                }
            }
            return;
        }
        for (sample, inset) in grid.samples.iter().enumerate() {
            let mut values = edges.each_ref().map(|edge| edge.moved(*inset));
            let mut first_pixel = (top * i64::from(grid.size[0]) + self.columns.0) as usize;
            for _ in top..=bottom {
                let columns = match last < NARROW {
                    true => 0..last + 1,
                    false => span(&edges, &values, step, last),
                };
                let mut here = [0, 1, 2].map(|i| values[i] - edges[i].dy * step * columns.start);
                for column in columns {
                    // A span has been found to be so.
                    if is_within(&here) {
                        take(first_pixel + column as usize, sample, along(here));
                    }
                    for (value, edge) in here.iter_mut().zip(&edges) {
                        *value -= edge.dy * step;
                    }
                }
                for (value, edge) in values.iter_mut().zip(&edges) {
                    *value += edge.dx * step;
                }
                first_pixel += grid.size[0] as usize;
            }
        }
    }
}

/// Pixels across up to which each is asked whether it is within: most triangles of a large mesh have one.
const NARROW: i64 = 4;

/// An edge of a triangle as a function of the place, which is not negative within.
struct Edge {
    dx: i64,
    dy: i64,
    /// Where it is asked first.
    value: i64,
    /// What it has to be at least: a sample on the edge counts where that is a left one or one at the top.
    least: i64,
}

impl Edge {
    #[inline]
    fn new(from: &Corner, to: &Corner, [x, y]: [i64; 2]) -> Self {
        let dx = i64::from(to.x) - i64::from(from.x);
        let dy = i64::from(to.y) - i64::from(from.y);
        let counts = dy < 0 || (dy == 0 && dx > 0);
        Self {
            dx,
            dy,
            value: edge(from, to, x, y),
            least: i64::from(!counts),
        }
    }

    /// Its value that far from where it is asked first.
    #[inline]
    fn moved(&self, [x, y]: [i64; 2]) -> i64 {
        self.value + self.dx * y - self.dy * x
    }
}

/// The pixels of a row, up to the last one, that are within all edges, whose values at the first of them are these.
fn span(edges: &[Edge; 3], values: &[i64; 3], step: i64, mut last: i64) -> std::ops::Range<i64> {
    let mut first = 0;
    for (edge, value) in edges.iter().zip(values) {
        let (inner, along) = (value - edge.least, -edge.dy * step);
        if inner < 0 {
            if along <= 0 {
                return 0..0;
            }
            first = first.max((-inner + along - 1) / along);
        } else if along < 0 {
            last = last.min(inner / -along);
        }
    }
    first..last + 1
}

#[cfg(test)]
mod tests {
    use super::super::Pattern;
    use super::*;

    fn grid(pattern: Pattern) -> Grid {
        let window = Window {
            x: 0,
            y: 0,
            width: 64,
            height: 48,
        };
        Grid::new([64, 48], &window, &pattern)
    }

    fn corner(grid: &Grid, x: f64, y: f64) -> Corner {
        let place = Place {
            x,
            y,
            a: 1.0,
            w: 1.0,
        };
        grid.corner(&place)
    }

    /// How often each sample is covered by the triangles.
    fn counts(grid: &Grid, triangles: &[[[f64; 2]; 3]]) -> Vec<u32> {
        let samples = grid.samples.len();
        let mut counts = vec![0; 64 * 48 * samples];
        for triangle in triangles {
            let corners = triangle.map(|[x, y]| corner(grid, x, y));
            if let Some(facet) = grid.triangle(corners) {
                facet.cover(
                    grid,
                    0..48,
                    || [0.0; 3],
                    |pixel, sample, _| {
                        counts[pixel * samples + sample] += 1;
                    },
                );
            }
        }
        counts
    }

    #[test]
    fn a_fan_of_slivers_covers_every_sample_once() {
        for (count, middle) in [
            (7, [32.0, 24.0]),
            (1000, [32.5, 24.5]),
            (4001, [31.3, 20.7]),
        ] {
            let rim = |i: u32| {
                let angle = std::f64::consts::TAU * f64::from(i % count) / f64::from(count);
                [
                    middle[0] + 200.0 * angle.cos(),
                    middle[1] + 200.0 * angle.sin(),
                ]
            };
            let fan: Vec<_> = (0..count).map(|i| [middle, rim(i), rim(i + 1)]).collect();
            for samples in super::super::pattern::COUNTS {
                let grid = grid(Pattern::of(samples).unwrap());
                let counts = counts(&grid, &fan);
                assert!(counts.iter().all(|n| *n == 1), "{count} {samples}");
            }
        }
    }

    #[test]
    fn corners_on_pixel_centres_leave_no_crack_and_nothing_twice() {
        // A mesh of squares, each of two triangles in either order and winding, whose corners are samples.
        let mut triangles = Vec::new();
        for y in -1..25 {
            for x in -1..33 {
                let at =
                    |i: i32, j: i32| [f64::from(2 * (x + i)) + 0.5, f64::from(2 * (y + j)) + 0.5];
                let [a, b, c, d] = [at(0, 0), at(1, 0), at(1, 1), at(0, 1)];
                triangles.extend(match (x + y) % 3 {
                    0 => [[a, b, c], [a, c, d]],
                    1 => [[b, a, d], [d, c, b]],
                    _ => [[c, b, a], [c, a, d]],
                });
            }
        }
        let grid = grid(Pattern::CENTRE);
        assert!(counts(&grid, &triangles).iter().all(|n| *n == 1));
    }

    #[test]
    fn what_is_linear_over_the_picture_is_linear_over_the_triangle() {
        let grid = grid(Pattern::CENTRE);
        let [a, b, c] = [[3.2, 4.7], [60.1, 9.9], [20.0, 45.5]];
        for triangle in [[a, b, c], [c, b, a]] {
            let corners = triangle.map(|[x, y]| corner(&grid, x, y));
            let mut covered = 0;
            grid.triangle(corners).unwrap().cover(
                &grid,
                0..48,
                || triangle.map(|[x, y]| x + 2.0 * y),
                |pixel, _, linear| {
                    let (x, y) = ((pixel % 64) as f64 + 0.5, (pixel / 64) as f64 + 0.5);
                    assert!((linear - (x + 2.0 * y)).abs() < 1e-3, "{linear}");
                    covered += 1;
                },
            );
            let area = 0.5 * ((56.9_f64) * 40.8 - 5.2 * 16.8);
            assert!((f64::from(covered) - area).abs() < 40.0, "{covered} {area}");
        }
    }

    #[test]
    fn a_triangle_without_area_or_without_samples_is_none() {
        let grid = grid(Pattern::CENTRE);
        for triangle in [
            [[3.0, 4.0], [10.0, 11.0], [17.0, 18.0]],
            [[3.6, 4.6], [3.9, 4.6], [3.7, 4.9]],
            [[-30.0, 4.0], [-3.0, 4.0], [-3.0, 40.0]],
            [[30.0, 400.0], [3.0, 444.0], [3.0, 490.0]],
        ] {
            let corners = triangle.map(|[x, y]| corner(&grid, x, y));
            assert!(grid.triangle(corners).is_none(), "{triangle:?}");
        }
    }
}
