//! Splats: light that comes to any place of the film, along paths that began at lights. Their sums stand beside those of
//! samples, and are divided by how many paths were begun a pixel and by how much of the filter there is inside the film.

use std::ops::Range;

use crate::filter::Filter;
use crate::sensor::{Film, Window};

/// Light by place.
#[derive(Clone, Debug)]
pub(crate) struct Splats {
    filter: Filter,
    /// In pixels, across and down.
    places: Vec<[f32; 2]>,
    /// As many as there are colours for each.
    values: Vec<f32>,
    colors: usize,
}

impl Splats {
    /// None yet, of so many colours.
    pub(crate) fn new(colors: usize) -> Self {
        Self {
            filter: Filter::pixel(),
            places: Vec::new(),
            values: Vec::new(),
            colors,
        }
    }

    /// Those to come are spread by a filter.
    pub(super) fn spread_by(&mut self, filter: &Filter) {
        self.filter = filter.clone();
    }

    /// One more. Whether it is finite: others are left out.
    pub(crate) fn push(&mut self, place: [f32; 2], values: &[f32]) -> bool {
        let finite = values[..self.colors].iter().chain(&place);
        if !finite.copied().all(f32::is_finite) {
            return false;
        }
        self.places.push(place);
        self.values.extend_from_slice(&values[..self.colors]);
        true
    }

    /// Adds them, in their order, to the sums over `window`, of which each pixel's begin at `place`.
    pub(super) fn add_to(&self, window: &Window, sums: &mut [f64], stride: usize, place: usize) {
        let radius = self.filter.radius();
        let splats = self
            .places
            .iter()
            .zip(self.values.chunks_exact(self.colors));
        for (&[x, y], values) in splats {
            let across = reached(x, radius, window.x, window.width);
            for py in reached(y, radius, window.y, window.height) {
                let down = self.filter.weight(py as f32 + 0.5 - y);
                let row = (py - window.y) as usize * window.width as usize;
                for px in across.clone() {
                    let weight = f64::from(down * self.filter.weight(px as f32 + 0.5 - x));
                    let pixel = row + (px - window.x) as usize;
                    let pixel = &mut sums[pixel * stride + place..][..self.colors];
                    for (sum, value) in pixel.iter_mut().zip(values) {
                        *sum += weight * f64::from(*value);
                    }
                }
            }
        }
    }
}

/// The pixels of a window whose centres lie within `radius` of a place.
fn reached(place: f32, radius: f32, first: u32, count: u32) -> Range<u32> {
    let inside = |x: f32| (x.max(first as f32) as u32).min(first + count);
    inside((place - radius - 0.5).ceil())..inside((place + radius - 0.5).floor() + 1.0)
}

/// What the sums of splats are divided by.
pub(super) struct Shares {
    place: Range<usize>,
    width: usize,
    /// By column, and by row, how much of the filter lies inside the film; times how many paths were begun a pixel.
    columns: Vec<f64>,
    rows: Vec<f64>,
}

impl Shares {
    pub(super) fn new(
        film: &Film,
        window: &Window,
        sums: &[f64],
        stride: usize,
        place: Range<usize>,
    ) -> Self {
        let pixels = sums.chunks_exact(stride);
        let count = pixels.len() as f64;
        let paths = pixels.map(|pixel| pixel[place.start]).sum::<f64>() / count;
        let all = film.sampled();
        let inside = |first: u32, size: u32, from: u32, wide: u32| {
            let share = move |pixel| share(&film.filter, pixel, from, from + wide);
            (first..first + size).map(share)
        };
        Self {
            place,
            width: window.width as usize,
            columns: inside(window.x, window.width, all.x, all.width)
                .map(|share| share * paths)
                .collect(),
            rows: inside(window.y, window.height, all.y, all.height).collect(),
        }
    }

    /// The value of colour `c` of the pixel with that index, whose sums are these; 0 of what is no colour.
    pub(super) fn value(&self, index: usize, pixel: &[f64], c: usize) -> f64 {
        let [columns, rows] = [&self.columns, &self.rows];
        let share = columns[index % self.width] * rows[index / self.width];
        let sums = &pixel[self.place.clone()][1..];
        match sums.get(c) {
            Some(sum) if share > 0.0 => sum / share,
            _ => 0.0,
        }
    }
}

/// The integral of the filter around a pixel over what lies inside the film.
fn share(filter: &Filter, pixel: u32, from: u32, to: u32) -> f64 {
    /// Points a pixel.
    const STEPS: u32 = 64;
    let reach = filter.reach() + 1;
    let (first, last) = (
        pixel.saturating_sub(reach).max(from),
        (pixel + reach + 1).min(to),
    );
    let points = (first * STEPS..last * STEPS).map(|i| {
        let x = (f64::from(i) + 0.5) / f64::from(STEPS) - f64::from(pixel) - 0.5;
        f64::from(filter.weight(x as f32))
    });
    points.sum::<f64>() / f64::from(STEPS)
}
