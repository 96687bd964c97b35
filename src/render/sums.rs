//! The film's sums: for each pixel the filter weights of its samples and their weighted values, in double
//! precision.
//!
//! Samples are splatted into every pixel that their filter reaches, which at equal samples leaves a
//! pixel 0.40× (tent) or 0.30× (gaussian) of the variance that counting each sample once would. Where
//! the film ends the filter is cut off, and the division by the sum of weights makes up for it.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::color::{luminance, rgb_to_xyz};
use crate::error::{Error, Problem, Result};
use crate::filter::{Filter, MAX_RADIUS};
use crate::image::Image;
use crate::integrator::{Cost, Stats};
use crate::sensor::{Coordinates, Film, Window};

/// The most pixels along an axis that a sample reaches, as a multiple of four.
const MAX_REACH: usize = (2 * (MAX_RADIUS as usize + 1) + 1).next_multiple_of(4);

/// Pixels that one task develops.
const GRAIN: usize = 1 << 13;

/// Seconds of threads that estimate samples, by what they do.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Times {
    /// First hits of camera rays and bounces.
    pub(super) closest: f64,
    /// Shadow rays.
    pub(super) occluded: f64,
    /// The integrator beside them, and the camera.
    pub(super) shade: f64,
    /// Colours and splatting.
    pub(super) film: f64,
}

impl Times {
    fn add(&mut self, other: &Self) {
        self.closest += other.closest;
        self.occluded += other.occluded;
        self.shade += other.shade;
        self.film += other.film;
    }
}

/// What samples cost, and what came of them beside the sums.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Tally {
    pub(super) stats: Stats,
    #[serde(default)]
    pub(super) times: Times,
    /// Samples that were not finite.
    pub(super) dropped: u64,
    /// The first one's pixel.
    pub(super) dropped_pixel: Option<[u32; 2]>,
}

impl Tally {
    /// Adds what came later.
    pub(super) fn add(&mut self, other: &Self) {
        self.stats.add(&other.stats);
        self.times.add(&other.times);
        self.dropped += other.dropped;
        self.dropped_pixel = self.dropped_pixel.or(other.dropped_pixel);
    }

    /// Adds what integrators cost within `total` seconds of a thread, of which the film took `film`.
    pub(super) fn spend(&mut self, cost: &Cost, total: f64, film: f64) {
        let [closest, occluded] = [cost.closest, cost.occluded].map(|time| time.as_secs_f64());
        self.stats.add(&cost.stats);
        self.times.add(&Times {
            closest,
            occluded,
            shade: (total - closest - occluded - film).max(0.0),
            film,
        });
    }

    /// Whether a sample's values are finite; where they are not, it is counted as dropped.
    pub(super) fn accepts(&mut self, pixel: [u32; 2], values: &[f32]) -> bool {
        let finite = values.iter().all(|v| v.is_finite());
        if !finite {
            self.dropped += 1;
            self.dropped_pixel.get_or_insert(pixel);
        }
        finite
    }

    /// The warning for dropped samples.
    pub(super) fn warning(&self) -> Option<Problem> {
        let [x, y] = self.dropped_pixel?;
        let message = format!(
            "{} samples were not finite and were dropped, the first at pixel ({x}, {y})",
            self.dropped
        );
        Some(Error::input(message).problems()[0].clone())
    }
}

/// What units add up to.
pub(super) trait Accumulator: Send {
    /// What a unit comes to.
    type Part: Send;

    /// Adds a unit's part.
    fn add(&mut self, part: &Self::Part);
    /// What all of it cost.
    fn tally(&self) -> &Tally;
    /// All sums, as they are kept.
    fn data(&self) -> &[f64];
    /// The same, to be filled with what was kept.
    fn kept(&mut self) -> (&mut [f64], &mut Tally);
}

/// The sums after a number of units.
#[derive(Debug)]
pub(super) struct Summed<A> {
    pub(super) sums: A,
    /// The first unit that is not in the sums.
    pub(super) next: usize,
}

/// Sums over a rectangle of pixels.
#[derive(Clone, Debug)]
pub(super) struct Sums {
    window: Window,
    /// Names of the values; the last one is opacity.
    channels: Vec<String>,
    /// For each pixel, row by row: the weight, then a value a channel.
    data: Vec<f64>,
    pub(super) tally: Tally,
}

/// So many zeros, unless the memory for them is not there.
pub(super) fn zeros(count: usize, film: &Window) -> Result<Vec<f64>> {
    let mut data = Vec::new();
    data.try_reserve_exact(count).map_err(|_| {
        Error::input(format!(
            "a film of {} × {} pixels does not fit into memory",
            film.width, film.height
        ))
        .help("render it in crops")
    })?;
    data.resize(count, 0.0);
    Ok(data)
}

impl Accumulator for Sums {
    type Part = Self;

    fn add(&mut self, part: &Self) {
        self.add_rectangle(&part.window, &part.data, 1.0);
        self.tally.add(&part.tally);
    }

    fn tally(&self) -> &Tally {
        &self.tally
    }

    fn data(&self) -> &[f64] {
        &self.data
    }

    fn kept(&mut self) -> (&mut [f64], &mut Tally) {
        (&mut self.data, &mut self.tally)
    }
}

impl Sums {
    /// Nothing yet, unless the memory for it is not there.
    pub(super) fn new(window: Window, channels: Vec<String>) -> Result<Self> {
        let size = window.width as usize * window.height as usize * (channels.len() + 1);
        Ok(Self {
            window,
            channels,
            data: zeros(size, &window)?,
            tally: Tally::default(),
        })
    }

    /// Adds a sample at `offset` (in [0, 1)²) within the pixel, in all pixels of the window that its filter
    /// reaches.
    pub(super) fn splat(
        &mut self,
        filter: &Filter,
        pixel: [u32; 2],
        offset: glam::Vec2,
        values: &[f32],
    ) {
        if self.tally.accepts(pixel, values) {
            splat(
                &mut self.data,
                &self.window,
                filter,
                (pixel, offset),
                values,
            );
        }
    }

    /// Adds the sums of another rectangle, times `scale`, where it overlaps this one.
    pub(super) fn add_rectangle(&mut self, window: &Window, data: &[f64], scale: f64) {
        let stride = self.channels.len() + 1;
        let (a, b) = (&self.window, window);
        let (left, right) = (a.x.max(b.x), (a.x + a.width).min(b.x + b.width));
        if left >= right {
            return;
        }
        let count = (right - left) as usize * stride;
        for y in a.y.max(b.y)..(a.y + a.height).min(b.y + b.height) {
            let start = |w: &Window| {
                ((y - w.y) as usize * w.width as usize + (left - w.x) as usize) * stride
            };
            let (to, from) = (start(a), start(b));
            for (sum, value) in self.data[to..][..count].iter_mut().zip(&data[from..]) {
                *sum += value * scale;
            }
        }
    }
    /// Adds the sums of another part of the film, without what they cost.
    pub(super) fn add_film(&mut self, other: &Self) {
        self.add_rectangle(&other.window, &other.data, 1.0);
    }

    /// The luminance of a pixel of the window.
    pub(super) fn luminance(&self, [x, y]: [u32; 2]) -> f64 {
        let index = (y - self.window.y) as usize * self.window.width as usize
            + (x - self.window.x) as usize;
        let pixel = &self.data[index * (self.channels.len() + 1)..];
        let value = |c: usize| (pixel[c + 1] / pixel[0]) as f32;
        if pixel[0] > 0.0 {
            luminance([value(0), value(1), value(2)]).into()
        } else {
            0.0
        }
    }

    /// Divides by the weights.
    pub(super) fn develop(&self, film: &Film) -> Result<Image> {
        let colors = self.channels.len() - 1;
        let extra = &self.channels[3.min(colors)..colors];
        let format = film.pixel_format;
        let main: Vec<&str> = format.channels().collect();
        let names = main.iter().map(|name| String::from(*name));
        let names: Vec<String> = names.chain(extra.iter().cloned()).collect();
        let stride = self.channels.len() + 1;
        let mut data = vec![0.0; self.data.len() / stride * names.len()];
        let pixels = data.par_chunks_exact_mut(names.len());
        let pixels = pixels.zip(self.data.par_chunks_exact(stride));
        pixels.with_min_len(GRAIN).for_each(|(out, pixel)| {
            let scale = if pixel[0] > 0.0 { 1.0 / pixel[0] } else { 0.0 };
            let value = |c: usize| (pixel[c + 1] * scale) as f32;
            let rgb = [value(0), value(1), value(2)];
            let (main, others) = out.split_at_mut(main.len());
            let color = match format.colors {
                Coordinates::Rgb => rgb,
                Coordinates::Luminance => [luminance(rgb); 3],
                Coordinates::Xyz => rgb_to_xyz(rgb),
            };
            for (out, value) in main.iter_mut().zip(color) {
                *out = value;
            }
            if let (true, Some(alpha)) = (format.alpha, main.last_mut()) {
                *alpha = value(colors);
            }
            for (other, c) in others.iter_mut().zip(3..) {
                *other = value(c);
            }
        });
        Image::from_data(self.window.width, self.window.height, names, data)
    }
}

/// Adds an accepted sample to the sums over `window`: for each pixel, row by row, the weight and the values.
pub(super) fn splat(
    data: &mut [f64],
    window: &Window,
    filter: &Filter,
    ([x, y], offset): ([u32; 2], glam::Vec2),
    values: &[f32],
) {
    let center = Window {
        x,
        y,
        width: 1,
        height: 1,
    };
    let reached = center.grown(filter.reach(), window);
    let weights = |first: u32, own: u32, offset: f32, count: u32| {
        let mut weights = [0.0; MAX_REACH];
        // Relative to the sample's own pixel, so that they do not depend on where on the film it is; some more than
        // are wanted, for four are found at a time.
        let first = (f64::from(first) - f64::from(own)) as f32 + 0.5 - offset;
        filter.weights(first, &mut weights[..count.next_multiple_of(4) as usize]);
        weights
    };
    let columns = weights(reached.x, x, offset.x, reached.width);
    let rows = weights(reached.y, y, offset.y, reached.height);
    let stride = values.len() + 1;
    let (left, width) = ((reached.x - window.x) as usize, reached.width as usize);
    for (py, wy) in (reached.y..reached.y + reached.height).zip(rows) {
        let start = (py - window.y) as usize * window.width as usize + left;
        let row = &mut data[start * stride..][..width * stride];
        // Most films have four channels, and a loop whose length is known costs a fraction. Weights of 0 are added
        // too: which they are is random, and a branch that cannot be foretold costs more.
        if let &[r, g, b, a] = values {
            let values = [r, g, b, a].map(f64::from);
            let (row, _) = row.as_chunks_mut::<5>();
            for ([weight, sums @ ..], wx) in row.iter_mut().zip(&columns) {
                let w = f64::from(wy * wx);
                *weight += w;
                for (sum, value) in sums.iter_mut().zip(values) {
                    *sum += w * value;
                }
            }
        } else {
            for (pixel, wx) in row.chunks_exact_mut(stride).zip(&columns) {
                let w = f64::from(wy * wx);
                pixel[0] += w;
                for (sum, value) in pixel[1..].iter_mut().zip(values) {
                    *sum += w * f64::from(*value);
                }
            }
        }
    }
}
