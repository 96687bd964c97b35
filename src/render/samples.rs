//! Camera samples: from their places on the film to what the integrator and the colour model make of them,
//! a batch at a time.

use std::ops::Range;
use std::time::{Duration, Instant};

use super::prepare::{Job, View};
use super::progress::Progress;
use crate::color::ColorModel;
use crate::film::{GROUP, Group, Layout, Tally};
use crate::integrator::{Cost, Estimate, Estimates, Estimator as _, Start};
use crate::lanes::{Kernel, Lanes, Task, Vec2};
use crate::sampler::{Sampler, Stream};

/// Bytes of path state in flight in a batch: within a core's caches, with rays enough for the tracer.
const BATCH_BYTES: usize = 512 << 10;

/// Estimates samples of one sampler, pixel by pixel, each with the indices of its samples, whose streams `stream` tells;
/// and gives them to `sink` in that order, in groups of samples that follow one another; what it cost is counted in
/// `sink`'s tally.
pub(super) fn estimate<C: ColorModel, S: Sink>(
    job: &Job<'_, C>,
    sampler: &Sampler,
    pixels: impl Iterator<Item = ([u32; 2], Range<u32>)>,
    stream: impl Fn([u32; 2], u32) -> Stream,
    progress: &dyn Progress,
    sink: &mut S,
) {
    let started = Instant::now();
    let mut batch = Batch {
        job,
        sampler,
        progress,
        layout: job.layout(),
        streams: Vec::with_capacity(GROUP),
        starts: Vec::new(),
        groups: Vec::new(),
        estimates: Estimates::default(),
        row: Vec::new(),
        columns: Vec::new(),
        cost: Cost::default(),
        film: Duration::ZERO,
    };
    let limit = BATCH_BYTES / size_of::<Start<C>>() / 4;
    for (pixel, indices) in pixels {
        let mut indices = indices.peekable();
        while indices.peek().is_some() {
            if batch.starts.len() + GROUP > limit {
                batch.flush(sink);
            }
            let streams = indices.by_ref().take(GROUP);
            batch.streams.clear();
            batch
                .streams
                .extend(streams.map(|index| stream(pixel, index)));
            let group = begin(job, sampler, pixel, &batch.streams, &mut batch.starts);
            batch.groups.push(group);
        }
    }
    batch.flush(sink);
    let total = started.elapsed().as_secs_f64();
    let Batch { cost, film, .. } = batch;
    sink.tally().spend(&cost, total, film.as_secs_f64());
}

/// Samples that are estimated together.
struct Batch<'a, C: ColorModel> {
    job: &'a Job<'a, C>,
    sampler: &'a Sampler,
    progress: &'a dyn Progress,
    layout: Layout,
    /// Of the samples that are begun.
    streams: Vec<Stream>,
    starts: Vec<Start<C>>,
    /// Of the starts, in their order.
    groups: Vec<Group>,
    estimates: Estimates<C::Sample>,
    /// A sample's colours.
    row: Vec<f32>,
    /// A group's values, a row a channel.
    columns: Vec<[f32; GROUP]>,
    cost: Cost,
    /// Time that colours and the film took.
    film: Duration,
}

impl<C: ColorModel> Batch<'_, C> {
    fn flush<S: Sink>(&mut self, sink: &mut S) {
        let before = self.cost.stats.rays();
        let (scene, integrator) = (self.job.scene, &self.job.view.integrator);
        let (starts, estimates) = (&self.starts, &mut self.estimates);
        integrator.estimate(scene, self.sampler, starts, estimates, &mut self.cost);
        let estimated = Instant::now();
        let (layout, color) = (&self.layout, scene.color());
        let extra = layout.extra().len();
        self.row.resize(layout.colors().len(), 0.0);
        self.columns.resize(layout.count(), [0.0; GROUP]);
        let mut first = 0;
        for group in &self.groups {
            for sample in 0..group.count {
                let index = first + sample;
                let Estimate { radiance, alpha } = &estimates.values[index];
                color.develop(radiance, &starts[index].wavelengths, &mut self.row);
                let extra = &estimates.extra[index * extra..][..extra];
                let values = self.row.iter().chain(extra).chain([alpha]);
                for (column, value) in self.columns.iter_mut().zip(values) {
                    column[sample] = *value;
                }
            }
            first += group.count;
            sink.take(scene.tracer().kernel(), group, &self.columns);
        }
        self.film += estimated.elapsed();
        let rays = self.cost.stats.rays() - before;
        self.progress.advance(starts.len() as u64, rays);
        self.starts.clear();
        self.groups.clear();
    }
}

/// Where samples go.
pub(super) trait Sink {
    /// What they cost.
    fn tally(&mut self) -> &mut Tally;
    /// The next samples of a pixel, whose values stand in a row a channel.
    fn take(&mut self, kernel: Kernel, group: &Group, values: &[[f32; GROUP]]);
}

/// The dimensions of a camera sample, after those of its place in the pixel.
const LENS: u32 = 2;
const TIME: u32 = 4;
const WAVELENGTH: u32 = 5;

/// Samples of a pixel that begin at the camera.
struct CameraSamples<'a, C: ColorModel> {
    job: &'a Job<'a, C>,
    pixel: [u32; 2],
    streams: &'a [Stream],
    /// Where they lie within the pixel.
    offsets: &'a [[f32; GROUP]; 2],
    lenses: &'a [[f32; GROUP]; 2],
    times: &'a [f32],
    /// Where they go.
    starts: &'a mut Vec<Start<C>>,
    sampler: &'a Sampler,
}

impl<C: ColorModel> Task for CameraSamples<'_, C> {
    type Output = ();

    #[inline(always)]
    fn run<F: Lanes>(self) {
        let View { sensor, film, .. } = &self.job.view;
        let margin = film.margin() as f32;
        let [x, y] = self.pixel.map(|n| n as f32 - margin);
        let (width, height) = (F::splat(film.width as f32), F::splat(film.height as f32));
        let mut streams = self.streams.iter();
        for first in (0..self.streams.len()).step_by(F::WIDTH) {
            let end = self.times.len().min(first + F::WIDTH);
            let load = |rows: &[[f32; GROUP]; 2], axis: usize| F::from_slice(&rows[axis][first..]);
            let place = Vec2::new(
                (F::splat(x) + load(self.offsets, 0)) / width,
                (F::splat(y) + load(self.offsets, 1)) / height,
            );
            let lens = Vec2::new(load(self.lenses, 0), load(self.lenses, 1));
            sensor.rays(place, lens, &self.times[first..end], |ray| {
                let Some(stream) = streams.next() else { return };
                let number = || stream.number(self.sampler, WAVELENGTH);
                self.starts.push(Start {
                    ray,
                    wavelengths: self.job.scene.color().wavelengths(number),
                    stream: *stream,
                });
            });
        }
    }
}

/// Begins samples of a pixel; as many as fit into a group.
fn begin<C: ColorModel>(
    job: &Job<'_, C>,
    sampler: &Sampler,
    pixel: [u32; 2],
    streams: &[Stream],
    starts: &mut Vec<Start<C>>,
) -> Group {
    let sensor = &job.view.sensor;
    let mut pairs = [glam::Vec2::ZERO; GROUP];
    let pairs = &mut pairs[..streams.len()];
    let rows = |pairs: &[glam::Vec2]| {
        let mut rows = [[0.0; GROUP]; 2];
        for (i, pair) in pairs.iter().enumerate() {
            (rows[0][i], rows[1][i]) = (pair.x, pair.y);
        }
        rows
    };
    sampler.fill_2d(streams, 0, pairs);
    let offsets = rows(pairs);
    // What nobody looks at is not drawn: as a rule three of four draws.
    let mut lenses = [[0.0; GROUP]; 2];
    if sensor.has_lens() {
        sampler.fill_2d(streams, LENS, pairs);
        lenses = rows(pairs);
    }
    let (open, close) = sensor.shutter();
    let mut times = [open; GROUP];
    let times = &mut times[..streams.len()];
    if open < close {
        sampler.fill_1d(streams, TIME, times);
        for time in times.iter_mut() {
            *time = open + *time * (close - open);
        }
    }
    let samples = CameraSamples {
        job,
        pixel,
        streams,
        offsets: &offsets,
        lenses: &lenses,
        times,
        starts,
        sampler,
    };
    job.scene.tracer().kernel().run(samples);
    Group {
        pixel,
        count: streams.len(),
        offsets,
    }
}
