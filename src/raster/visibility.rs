//! Which triangle is seen at each sample: all triangles of a scene into a z-buffer, by all threads at once. Each takes runs of
//! triangles, projects their corners, sifts out those that lie between samples and draws the others, but those that are high
//! are left for a second round in which each thread has rows of its own. A sample holds one number whose maximum is taken (see
//! `depth`), so that no schedule can change what is seen; nothing is shaded before all is drawn (Burns and Hunt, *The
//! visibility buffer*, 2013).

use std::sync::atomic::{AtomicU64, Ordering};

use glam::Vec3;
use rayon::prelude::*;

use super::clip::{Limits, clip};
use super::corners::{Corners, PlaceCorners, Placing};
use super::depth::{self, DepthCode, DepthFormat};
use super::drawn::{Drawn, Placed};
use super::pattern::Pattern;
use super::projection::{Place, Projection};
use super::runs::{self, Run};
use super::setup::{Corner, Facet, Grid};
use super::sift::Sift;
use crate::error::{Error, Result};
use crate::lanes::Kernel;
use crate::pages;
use crate::sensor::Window;
use crate::shape::Bounds;

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
        let keys = pages::zeros(count).ok_or_else(|| {
            let [width, height] = size;
            Error::input(format!(
                "a z-buffer of {width} × {height} pixels of {samples} samples does not fit into memory"
            ))
            .help("take fewer samples, or render it in crops")
        })?;
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
            for high in high.iter().filter(|high| high.facet.reaches(&rows)) {
                painter.fill(&high.facet, high.number, rows.clone(), || high.linear);
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

/// A triangle that is left for the second round.
struct High {
    facet: Facet,
    number: u32,
    /// What is linear over the picture, at its corners.
    linear: [f64; 3],
}

/// What a thread knows of the run of triangles that it draws, with room for another.
#[derive(Default)]
struct Stage {
    corners: Corners,
    /// The triangles that may have samples, by their places in the run.
    found: Vec<u32>,
    /// The first corner of a run whose corners stand together; `None` where each triangle has three of its own.
    first: Option<u32>,
    /// Then their positions, and the triangles.
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Stage {
    /// Places the corners of a run and finds the triangles that may have samples; the answer is how many.
    fn place(
        &mut self,
        kernel: Kernel,
        placing: &Placing<'_>,
        positions: &[Vec3],
        (run, triangles): (&Run, &[[u32; 3]]),
    ) -> usize {
        self.first = run.corners.as_ref().map(|corners| *corners.start());
        let (positions, triangles) = match &run.corners {
            Some(corners) => {
                let corners = *corners.start() as usize..=*corners.end() as usize;
                (&positions[corners], triangles)
            }
            None => {
                let corners = triangles.as_flattened().iter();
                self.positions.clear();
                self.positions
                    .extend(corners.map(|i| positions[*i as usize]));
                let own = self.triangles.len() as u32..triangles.len() as u32;
                self.triangles
                    .extend(own.map(|i| [3 * i, 3 * i + 1, 3 * i + 2]));
                (&self.positions[..], &self.triangles[..triangles.len()])
            }
        };
        kernel.run(PlaceCorners {
            placing,
            positions,
            to: &mut self.corners,
        });
        if self.found.len() < triangles.len() {
            self.found.resize(triangles.len(), 0);
        }
        kernel.run(Sift {
            reaches: &self.corners.reaches,
            triangles,
            first: self.first.unwrap_or(0),
            found: &mut self.found,
        })
    }

    /// The corners of the run's triangle at a place.
    #[inline]
    fn corners(&self, triangles: &[[u32; 3]], place: u32) -> [Corner; 3] {
        let triangle = match self.first {
            Some(first) => triangles[place as usize].map(|i| i - first),
            None => self.triangles[place as usize],
        };
        triangle.map(|i| self.corners.corner(i as usize))
    }
}

impl Painter<'_> {
    /// Draws a shape; the answer is the triangles that are left, which are high.
    fn paint(&self, drawn: &Drawn<'_>, placed: &Placed, cull: Cull) -> Vec<High> {
        let facets = drawn.facets(placed);
        let (matrix, offset) = self.projection.along_ways(placed.to_world.as_ref());
        let placing = Placing {
            projection: self.projection,
            limits: &self.limits,
            grid: &self.grid,
            matrix,
            offset,
        };
        let is_missed = |bounds: &Bounds| {
            let around = bounds.corners().map(|corner| placing.place(corner));
            self.projection.misses(&around, &self.window)
        };
        // A triangle turns as its corners do: seen with y down a front is turned where the matrix does not mirror.
        let front = matrix.determinant() > 0.0;
        let keep = |is_turned: bool| match cull {
            Cull::None => true,
            Cull::Back => is_turned == front,
            Cull::Front => is_turned != front,
        };
        let runs = facets.runs(drawn.kernel()).enumerate();
        let high = runs.map_init(Stage::default, |stage, (i, (run, triangles))| {
            let mut high = Vec::new();
            if is_missed(&run.bounds) {
                return high;
            }
            let run = (run, triangles);
            let count = stage.place(drawn.kernel(), &placing, &facets.positions, run);
            let first = placed.first + (i * runs::LENGTH) as u32;
            for i in &stage.found[..count] {
                let (triangle, number) = (triangles[*i as usize], first + i);
                let three = stage.corners(triangles, *i);
                let places = || triangle.map(|i| placing.place(facets.positions[i as usize]));
                let [a, b, c] = three.each_ref().map(Corner::beyond);
                if a & b & c != 0 {
                    continue;
                }
                if a | b | c != 0 {
                    self.cut(places(), |facet, linear| {
                        if keep(facet.is_turned) {
                            self.fill_or_leave(facet, number, || linear, &mut high);
                        }
                    });
                } else if let Some(facet) = self.grid.triangle(three)
                    && keep(facet.is_turned)
                {
                    let linear = || places().map(|place| self.code.linear(place.a));
                    self.fill_or_leave(facet, number, linear, &mut high);
                }
            }
            high
        });
        high.flatten_iter().collect()
    }

    /// Gives what the limits leave of a triangle.
    fn cut(&self, places: [Place; 3], mut take: impl FnMut(Facet, [f64; 3])) {
        let polygon = clip(places, &self.limits);
        let Some((first, rest)) = polygon.corners().split_first() else {
            return;
        };
        for pair in rest.windows(2) {
            let places = [first, &pair[0], &pair[1]];
            if let Some(facet) = self
                .grid
                .triangle(places.map(|place| self.grid.corner(place)))
            {
                take(facet, places.map(|place| self.code.linear(place.a)));
            }
        }
    }

    #[inline]
    fn fill_or_leave(
        &self,
        facet: Facet,
        number: u32,
        linear: impl Fn() -> [f64; 3],
        high: &mut Vec<High>,
    ) {
        if facet.height() > i64::from(ROWS) {
            high.push(High {
                facet,
                number,
                linear: linear(),
            });
        } else {
            self.fill(&facet, number, 0..self.grid.rows(), linear);
        }
    }

    #[inline]
    fn fill(
        &self,
        facet: &Facet,
        number: u32,
        rows: std::ops::Range<u32>,
        linear: impl Fn() -> [f64; 3],
    ) {
        facet.cover(&self.grid, rows, linear, |pixel, sample, linear| {
            let key = depth::key(self.code.code(linear), number);
            let kept = &self.keys[pixel * self.samples + sample];
            if kept.load(Ordering::Relaxed) < key {
                kept.fetch_max(key, Ordering::Relaxed);
            }
        });
    }
}
