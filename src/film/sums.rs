//! The film's sums: for each pixel the filter weights of its samples and their weighted values, in double
//! precision.
//!
//! Where the film ends filters are cut off, and the division by the sum of weights makes up for it.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::splats::Shares;
use super::{Group, Layout, Splats};
use crate::color::{luminance, rgb_to_xyz};
use crate::error::{Error, Problem, Result};
use crate::filter::Filter;
use crate::image::Image;
use crate::integrator::{Cost, Stats};
use crate::lanes::Kernel;
use crate::pages;
use crate::sensor::{Coordinates, Film, Window};

/// Pixels that one task develops.
const GRAIN: usize = 1 << 13;

/// Seconds of threads that estimate samples, by what they do.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Times {
    /// First hits of camera rays and bounces.
    pub(crate) closest: f64,
    /// Shadow rays.
    pub(crate) occluded: f64,
    /// The integrator beside them, and the camera.
    pub(crate) shade: f64,
    /// Colours and splatting.
    pub(crate) film: f64,
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
pub(crate) struct Tally {
    pub(crate) stats: Stats,
    #[serde(default)]
    pub(crate) times: Times,
    /// Samples that were not finite.
    pub(crate) dropped: u64,
    /// The first one's pixel.
    pub(crate) dropped_pixel: Option<[u32; 2]>,
}

impl Tally {
    /// Adds what came later.
    pub(crate) fn add(&mut self, other: &Self) {
        self.stats.add(&other.stats);
        self.times.add(&other.times);
        self.dropped += other.dropped;
        self.dropped_pixel = self.dropped_pixel.or(other.dropped_pixel);
    }

    /// Adds what integrators cost within `total` seconds of a thread, of which the film took `film`.
    pub(crate) fn spend(&mut self, cost: &Cost, total: f64, film: f64) {
        let [closest, occluded] = [cost.closest, cost.occluded].map(|time| time.as_secs_f64());
        self.stats.add(&cost.stats);
        self.times.add(&Times {
            closest,
            occluded,
            shade: (total - closest - occluded - film).max(0.0),
            film,
        });
    }

    /// Counts samples of a pixel that were left out.
    pub(crate) fn drop(&mut self, pixel: [u32; 2], count: u32) {
        self.dropped += u64::from(count);
        if count > 0 {
            self.dropped_pixel.get_or_insert(pixel);
        }
    }

    /// The warning for dropped samples.
    pub(crate) fn warning(&self) -> Option<Problem> {
        let [x, y] = self.dropped_pixel?;
        let message = format!(
            "{} samples were not finite and were dropped, the first at pixel ({x}, {y})",
            self.dropped
        );
        Some(Error::input(message).problems()[0].clone())
    }
}

/// What units add up to.
pub(crate) trait Accumulator: Send {
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
pub(crate) struct Summed<A> {
    pub(crate) sums: A,
    /// The first unit that is not in the sums.
    pub(crate) next: usize,
}

/// Sums over a rectangle of pixels.
#[derive(Clone, Debug)]
pub(crate) struct Sums {
    window: Window,
    layout: Layout,
    /// For each pixel, row by row: the weight, then a value a channel; then, where there are splats, how many paths were
    /// begun from it and what splats brought.
    data: Vec<f64>,
    /// What comes to any place of the film, added with the rest of a part.
    pub(crate) splats: Splats,
    pub(crate) tally: Tally,
}

/// The sums of some rows, to be filled.
#[derive(Debug)]
pub(crate) struct Rows<'a> {
    window: Window,
    stride: usize,
    data: &'a mut [f64],
    tally: Tally,
}

impl Rows<'_> {
    /// The pixels that they are of.
    pub(crate) fn window(&self) -> &Window {
        &self.window
    }

    /// Adds a sample of a pixel of the window, a value a channel, in that pixel alone.
    pub(crate) fn put(&mut self, pixel: [u32; 2], values: &[f32]) {
        if !values.iter().all(|value| value.is_finite()) {
            self.tally.drop(pixel, 1);
            return;
        }
        let row = (pixel[1] - self.window.y) as usize * self.window.width as usize;
        let first = (row + (pixel[0] - self.window.x) as usize) * self.stride;
        let [weight, sums @ ..] = &mut self.data[first..] else {
            return;
        };
        *weight += 1.0;
        for (sum, value) in sums.iter_mut().zip(values) {
            *sum += f64::from(*value);
        }
    }
}

/// So many zeros, unless the memory for them is not there.
pub(crate) fn zeros(count: usize, film: &Window) -> Result<Vec<f64>> {
    pages::zeros(count).ok_or_else(|| {
        Error::input(format!(
            "a film of {} × {} pixels does not fit into memory",
            film.width, film.height
        ))
        .help("render it in crops")
    })
}

impl Accumulator for Sums {
    type Part = Self;

    fn add(&mut self, part: &Self) {
        self.add_rectangle(&part.window, &part.data, 1.0);
        if let Some(place) = self.layout.splats() {
            let stride = self.layout.stride();
            part.splats
                .add_to(&self.window, &mut self.data, stride, place.start + 1);
        }
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
    pub(crate) fn new(window: Window, layout: Layout) -> Result<Self> {
        let size = window.width as usize * window.height as usize * layout.stride();
        Ok(Self {
            window,
            splats: Splats::new(layout.colors().len()),
            layout,
            data: zeros(size, &window)?,
            tally: Tally::default(),
        })
    }

    /// The pixels that they are of.
    pub(crate) fn window(&self) -> &Window {
        &self.window
    }

    /// Adds samples of a pixel, of which each has a row, in all pixels of the window that their filter reaches.
    pub(crate) fn splat(
        &mut self,
        kernel: Kernel,
        filter: &Filter,
        group: &Group,
        rows: &mut [f32],
    ) {
        let stride = self.layout.stride();
        let dropped = group.splat(kernel, filter, rows, &self.window, stride, &mut self.data);
        self.tally.drop(group.pixel, dropped);
    }

    /// Fills the pixels by all threads at once, so many rows at a time.
    pub(crate) fn fill(&mut self, rows: u32, fill: impl Fn(&mut Rows<'_>) + Sync) {
        let (window, stride) = (self.window, self.layout.stride());
        let row = window.width as usize * stride;
        let chunks = self.data.par_chunks_mut((row * rows as usize).max(1));
        let tallies = chunks.enumerate().map(|(i, data)| {
            let mut rows = Rows {
                window: Window {
                    y: window.y + i as u32 * rows,
                    height: (data.len() / row) as u32,
                    ..window
                },
                stride,
                data,
                tally: Tally::default(),
            };
            fill(&mut rows);
            rows.tally
        });
        for tally in tallies.collect::<Vec<_>>() {
            self.tally.add(&tally);
        }
    }

    /// Begins splats, where there are any, that a filter spreads; for each pixel of a window so many paths are begun.
    pub(crate) fn begin_splats(&mut self, filter: &Filter, window: &Window, count: u32) {
        let Some(place) = self.layout.splats() else {
            return;
        };
        self.splats.spread_by(filter);
        let (seen, stride) = (self.window.grown(0, window), self.layout.stride());
        for y in seen.y..seen.y + seen.height {
            let row = (y - self.window.y) as usize * self.window.width as usize;
            let first = row + (seen.x - self.window.x) as usize;
            let pixels = self.data[first * stride..].chunks_exact_mut(stride);
            for pixel in pixels.take(seen.width as usize) {
                pixel[place.start] += f64::from(count);
            }
        }
    }

    /// Adds the sums of another rectangle, times `scale`, where it overlaps this one.
    pub(crate) fn add_rectangle(&mut self, window: &Window, data: &[f64], scale: f64) {
        let stride = self.layout.stride();
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
    /// The sums of the pixels that are in `window` too: which these are, and a run a row.
    pub(crate) fn rows_within(
        &self,
        window: &Window,
    ) -> (Window, impl Iterator<Item = &[f64]> + Clone) {
        let seen = self.window.grown(0, window);
        let stride = self.layout.stride();
        let (left, top) = (
            seen.x.saturating_sub(self.window.x) as usize,
            seen.y.saturating_sub(self.window.y) as usize,
        );
        let rows = self.data.chunks_exact(self.window.width as usize * stride);
        let rows = rows.skip(top);
        let rows = rows.take(if seen.width > 0 {
            seen.height as usize
        } else {
            0
        });
        let count = seen.width as usize * stride;
        (seen, rows.map(move |row| &row[left * stride..][..count]))
    }

    /// Adds the sums of another part of the film, without what they cost.
    pub(crate) fn add_film(&mut self, other: &Self) {
        self.add_rectangle(&other.window, &other.data, 1.0);
    }

    /// The luminance of a pixel of the window.
    pub(crate) fn luminance(&self, [x, y]: [u32; 2]) -> f64 {
        let index = (y - self.window.y) as usize * self.window.width as usize
            + (x - self.window.x) as usize;
        let pixel = &self.data[index * self.layout.stride()..];
        let value = |c: usize| (pixel[c + 1] / pixel[0]) as f32;
        if pixel[0] > 0.0 {
            luminance([value(0), value(1), value(2)]).into()
        } else {
            0.0
        }
    }

    /// Divides by the weights.
    pub(crate) fn develop(&self, film: &Film) -> Result<Image> {
        let opacity = self.layout.opacity();
        let others = self.layout.others();
        let extra = &self.layout.names()[others.clone()];
        let format = film.pixel_format;
        let main: Vec<&str> = format.channels().collect();
        let names = main.iter().map(|name| String::from(*name));
        let names: Vec<String> = names.chain(extra.iter().cloned()).collect();
        let stride = self.layout.stride();
        let mut data = vec![0.0; self.data.len() / stride * names.len()];
        let shares = self
            .layout
            .splats()
            .map(|place| Shares::new(film, &self.window, &self.data, stride, place));
        let pixels = data.par_chunks_exact_mut(names.len());
        let pixels = pixels.zip(self.data.par_chunks_exact(stride)).enumerate();
        pixels
            .with_min_len(GRAIN)
            .for_each(|(index, (out, pixel))| {
                let scale = if pixel[0] > 0.0 { 1.0 / pixel[0] } else { 0.0 };
                let splat = |c: usize| match &shares {
                    Some(shares) => shares.value(index, pixel, c),
                    None => 0.0,
                };
                let value = |c: usize| (pixel[c + 1] * scale + splat(c)) as f32;
                let rgb = [value(0), value(1), value(2)];
                let (main, rest) = out.split_at_mut(main.len());
                let color = match format.colors {
                    Coordinates::Rgb | Coordinates::None => rgb,
                    Coordinates::Luminance => [luminance(rgb); 3],
                    Coordinates::Xyz => rgb_to_xyz(rgb),
                };
                for (out, value) in main.iter_mut().zip(color) {
                    *out = value;
                }
                if let (true, Some(alpha)) = (format.alpha, main.last_mut()) {
                    *alpha = value(opacity);
                }
                for (out, c) in rest.iter_mut().zip(others.clone()) {
                    *out = value(c);
                }
            });
        Image::from_data(self.window.width, self.window.height, names, data)
    }
}
