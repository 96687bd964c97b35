//! Which triangle is seen at each sample: all triangles of a scene into a z-buffer, by all threads at once. Corners are
//! projected first; then each thread takes runs of triangles, and those that are high are left for a second round in which
//! each thread has rows of its own. A sample holds one number whose maximum is taken (see `depth`), so that no schedule can
//! change what is seen; nothing is shaded before all is drawn (Burns and Hunt, *The visibility buffer*, 2013).

use std::sync::atomic::{AtomicU64, Ordering};

use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

use super::clip::{Limits, clip};
use super::depth::{self, DepthCode, DepthFormat};
use super::drawn::{Drawn, Placed};
use super::pattern::Pattern;
use super::projection::{Place, Projection};
use super::setup::{Corner, Facet, Grid};
use crate::error::{Error, Result};
use crate::sensor::Window;

/// Which sides of surfaces are left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Cull {
    /// Neither.
    #[default]
    None,
    /// Backs: what a normal points away from.
    Back,
    /// Fronts.
    Front,
}

/// How a picture is drawn.
#[derive(Clone, Copy, Debug)]
pub struct Canvas {
    /// Pixels of the whole picture, across and down.
    pub picture: [u32; 2],
    /// Those of them that are drawn.
    pub window: Window,
    /// Where samples lie within pixels.
    pub pattern: Pattern,
    /// How depth is kept.
    pub depth: DepthFormat,
    /// Which sides are left out.
    pub cull: Cull,
}

/// What is seen at each sample of a picture.
#[derive(Debug)]
pub struct Visibility {
    /// Pixels across and down.
    pub size: [u32; 2],
    samples: usize,
    keys: Vec<AtomicU64>,
}

/// Corners and triangles that one task takes.
const GRAIN: usize = 1 << 12;
/// Rows of pixels that a triangle may have before it is left for the second round, and that a task has there.
const ROWS: u32 = 32;

impl Canvas {
    /// A whole picture with one sample a pixel.
    pub fn whole(size: [u32; 2]) -> Self {
        Self {
            picture: size,
            window: Window {
                x: 0,
                y: 0,
                width: size[0],
                height: size[1],
            },
            pattern: Pattern::CENTRE,
            depth: DepthFormat::Float,
            cull: Cull::None,
        }
    }
}

impl Visibility {
    /// Draws the triangles.
    ///
    /// # Errors
    /// Where there is no memory for the picture.
    pub fn draw(drawn: &Drawn<'_>, projection: &Projection, canvas: &Canvas) -> Result<Self> {
        let Canvas {
            picture,
            window,
            pattern,
            depth,
            cull,
        } = *canvas;
        let samples = pattern.count();
        let size = [window.width, window.height];
        let count = size[0] as usize * size[1] as usize * samples;
        let mut keys = Vec::new();
        keys.try_reserve_exact(count).map_err(|_| {
            let [width, height] = size;
            Error::input(format!(
                "a z-buffer of {width} × {height} pixels of {samples} samples does not fit into memory"
            ))
            .help("take fewer samples, or render it in crops")
        })?;
        keys.resize_with(count, AtomicU64::default);
        let grid = Grid::new(picture, &window, &pattern);
        let painter = Painter {
            keys: &keys,
            samples,
            limits: Limits::new(projection, grid.band()),
            code: DepthCode::new(projection, depth),
            projection,
            window,
            grid,
        };
        let mut high = Vec::new();
        for placed in drawn.placed() {
            high.append(&mut painter.paint(drawn, placed, cull));
        }
        let bands = (0..size[1].div_ceil(ROWS)).into_par_iter();
        bands.for_each(|band| {
            let rows = band * ROWS..size[1].min((band + 1) * ROWS);
            for (facet, number) in high.iter().filter(|(facet, _)| facet.reaches(&rows)) {
                painter.fill(facet, *number, rows.clone());
            }
        });
        Ok(Self {
            size,
            samples,
            keys,
        })
    }

    /// The number of the triangle that is seen at a sample.
    pub fn number(&self, pixel: usize, sample: usize) -> Option<u32> {
        depth::number(self.key(pixel, sample))
    }

    /// How near what is seen at a sample is: the greater the nearer, 0 where it is nothing.
    pub(super) fn depth(&self, pixel: usize, sample: usize) -> u32 {
        (self.key(pixel, sample) >> 32) as u32
    }

    fn key(&self, pixel: usize, sample: usize) -> u64 {
        self.keys[pixel * self.samples + sample].load(Ordering::Relaxed)
    }

    /// How many samples see anything.
    pub fn covered(&self) -> usize {
        let seen = |key: &&AtomicU64| key.load(Ordering::Relaxed) != 0;
        self.keys.iter().filter(seen).count()
    }
}

/// What every thread needs.
struct Painter<'a> {
    keys: &'a [AtomicU64],
    samples: usize,
    grid: Grid,
    limits: Limits,
    code: DepthCode,
    projection: &'a Projection,
    window: Window,
}

impl Painter<'_> {
    /// Draws a shape; the answer is the triangles that are left, which are high.
    fn paint(&self, drawn: &Drawn<'_>, placed: &Placed, cull: Cull) -> Vec<(Facet, u32)> {
        let facets = drawn.facets(placed);
        let (linear, translation) = placed.matrix();
        let (matrix, offset) = self.projection.along_ways(linear, translation);
        let around = facets.bounds.corners();
        let around = around.map(|corner| self.place(&matrix, offset, corner));
        if self.projection.misses(&around, &self.window) {
            return Vec::new();
        }
        let corners: Vec<Corner> = (facets.positions.par_iter().with_min_len(GRAIN))
            .map(|position| self.corner(&matrix, offset, *position))
            .collect();
        // A triangle turns as its corners do: seen with y down a front is turned where the matrix does not mirror.
        let front = matrix.determinant() > 0.0;
        let keep = |is_turned: bool| match cull {
            Cull::None => true,
            Cull::Back => is_turned == front,
            Cull::Front => is_turned != front,
        };
        let runs = facets.triangles.par_chunks(GRAIN).enumerate();
        let high = runs.map(|(run, triangles)| {
            let mut high = Vec::new();
            let first = placed.first + (run * GRAIN) as u32;
            for (number, triangle) in (first..).zip(triangles) {
                let three = triangle.map(|i| corners[i as usize]);
                let [a, b, c] = three.each_ref().map(Corner::beyond);
                if a & b & c != 0 {
                    continue;
                }
                if a | b | c != 0 {
                    let places =
                        triangle.map(|i| self.place(&matrix, offset, facets.positions[i as usize]));
                    self.cut(places, |facet| {
                        if keep(facet.is_turned) {
                            self.fill_or_leave(facet, number, &mut high);
                        }
                    });
                } else if let Some(facet) = self.grid.triangle(three)
                    && keep(facet.is_turned)
                {
                    self.fill_or_leave(facet, number, &mut high);
                }
            }
            high
        });
        high.flatten_iter().collect()
    }

    #[inline]
    fn place(&self, matrix: &DMat3, offset: DVec3, position: Vec3) -> Place {
        self.projection
            .placed(*matrix * position.as_dvec3() + offset)
    }

    #[inline]
    fn corner(&self, matrix: &DMat3, offset: DVec3, position: Vec3) -> Corner {
        let place = self.place(matrix, offset, position);
        match self.limits.contains(&place) {
            true => self.grid.corner(&place, self.code.linear(place.a)),
            false => Corner::outside(self.limits.beyond(&place)),
        }
    }

    /// Gives what the limits leave of a triangle.
    fn cut(&self, places: [Place; 3], mut take: impl FnMut(Facet)) {
        let polygon = clip(places, &self.limits);
        let corner = |place: &Place| self.grid.corner(place, self.code.linear(place.a));
        let Some((first, rest)) = polygon.corners().split_first() else {
            return;
        };
        for pair in rest.windows(2) {
            let corners = [corner(first), corner(&pair[0]), corner(&pair[1])];
            if let Some(facet) = self.grid.triangle(corners) {
                take(facet);
            }
        }
    }

    #[inline]
    fn fill_or_leave(&self, facet: Facet, number: u32, high: &mut Vec<(Facet, u32)>) {
        if facet.height() > i64::from(ROWS) {
            high.push((facet, number));
        } else {
            self.fill(&facet, number, 0..self.grid.rows());
        }
    }

    #[inline]
    fn fill(&self, facet: &Facet, number: u32, rows: std::ops::Range<u32>) {
        facet.cover(&self.grid, rows, |pixel, sample, linear| {
            let key = depth::key(self.code.code(linear), number);
            let kept = &self.keys[pixel * self.samples + sample];
            if kept.load(Ordering::Relaxed) < key {
                kept.fetch_max(key, Ordering::Relaxed);
            }
        });
    }
}
