//! Camera samples: from their places on the film to what the integrator and the colour model make of them,
//! a batch at a time.

use std::ops::Range;
use std::time::{Duration, Instant};

use super::prepare::{Job, View};
use super::progress::Progress;
use crate::color::ColorModel;
use crate::film::{GROUP, Group, Layout, Tally, row_length};
use crate::integrator::{Cost, Estimate, Estimates, Estimator as _, Start};
use crate::lanes::{Kernel, Lanes, Task, Vec2};
use crate::sampler::{Sampler, Stream, Streams};
use crate::sensor::Film;

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
        rows: Vec::new(),
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
    /// What a pass brings to a sample, a channel each.
    row: Vec<f32>,
    /// What all passes bring to the samples, a row each.
    rows: Vec<f32>,
    cost: Cost,
    /// Time that colours and the film took.
    film: Duration,
}

impl<C: ColorModel> Batch<'_, C> {
    fn flush<S: Sink>(&mut self, sink: &mut S) {
        let before = self.cost.stats.rays();
        let (scene, integrator) = (self.job.scene, &self.job.view.integrator);
        let color = scene.color();
        let length = row_length(self.layout.count());
        self.rows.resize(self.starts.len() * length, 0.0);
        for pass in 0..color.passes() {
            if pass > 0 {
                for start in &mut self.starts {
                    let number = || start.stream.number(self.sampler, WAVELENGTH);
                    start.wavelengths = color.wavelengths_of(pass, number);
                    start.pass = pass;
                }
            }
            let (starts, estimates) = (&self.starts, &mut self.estimates);
            integrator.estimate(scene, self.sampler, starts, estimates, &mut self.cost);
            let estimated = Instant::now();
            self.develop(pass);
            self.splat(pass, sink);
            self.film += estimated.elapsed();
        }
        let estimated = Instant::now();
        let mut rest = self.rows.as_mut_slice();
        for group in &self.groups {
            let (rows, others) = rest.split_at_mut(group.count * length);
            sink.take(scene.tracer().kernel(), group, rows);
            rest = others;
        }
        self.film += estimated.elapsed();
        let rays = self.cost.stats.rays() - before;
        self.progress.advance(self.starts.len() as u64, rays);
        self.starts.clear();
        self.groups.clear();
    }

    /// Adds what the estimates of a pass bring to the rows.
    fn develop(&mut self, pass: u32) {
        let (color, layout) = (self.job.scene.color(), &self.layout);
        let (count, extra) = (layout.count(), layout.extra());
        self.row.resize(count, 0.0);
        let rows = self.rows.chunks_exact_mut(row_length(count));
        let mut samples = rows.zip(&self.estimates.values).enumerate();
        let weighted = !self.job.view.sensor.is_projective();
        for group in &self.groups {
            for (sample, (index, (row, estimate))) in samples.by_ref().take(group.count).enumerate()
            {
                let Estimate { radiance, alpha } = estimate;
                let wavelengths = &self.starts[index].wavelengths;
                let colors = &mut self.row[..extra.start];
                color.develop(pass, radiance, wavelengths, colors);
                if weighted {
                    let weight = weight(&self.job.view, group, sample);
                    colors.iter_mut().for_each(|value| *value *= weight);
                }
                let added = &self.estimates.extra[index * extra.len()..][..extra.len()];
                self.row[extra.clone()].copy_from_slice(added);
                self.row[extra.end] = *alpha;
                row[0] = 1.0;
                layout.take(pass, &self.row, &mut row[1..]);
            }
        }
    }

    /// Gives the light of a pass that came to the film from lights to the sink.
    fn splat<S: Sink>(&mut self, pass: u32, sink: &mut S) {
        let place = Place::of(&self.job.view.film);
        let colors = &mut self.row[self.layout.colors()];
        for splat in &self.estimates.splats {
            let wavelengths = &self.starts[splat.start as usize].wavelengths;
            (self.job.scene.color()).develop(pass, &splat.value, wavelengths, colors);
            colors.iter_mut().for_each(|value| *value *= place.share);
            sink.splat(place.on(splat.film), colors);
        }
    }
}

/// What the sensor multiplies the radiance of a sample of the group by.
fn weight<C: ColorModel>(view: &View<C>, group: &Group, sample: usize) -> f32 {
    let film = &view.film;
    let margin = film.margin() as f32;
    let [x, y] = [0, 1].map(|axis| {
        let pixel = group.pixel[axis] as f32 - margin;
        pixel + group.offsets[axis][sample]
    });
    let place = glam::Vec2::new(x / film.width as f32, y / film.height as f32);
    view.sensor.weight(place)
}

/// Where places of the sensor's lie among pixels.
struct Place {
    size: glam::Vec2,
    margin: f32,
    /// The film's part of all that paths are begun from.
    share: f32,
}

impl Place {
    fn of(film: &Film) -> Self {
        let all = film.sampled();
        let area = |width: u32, height: u32| f64::from(width) * f64::from(height);
        Self {
            size: glam::Vec2::new(film.width as f32, film.height as f32),
            margin: film.margin() as f32,
            share: (area(film.width, film.height) / area(all.width, all.height)) as f32,
        }
    }

    fn on(&self, film: glam::Vec2) -> [f32; 2] {
        (film * self.size + self.margin).to_array()
    }
}

/// Where samples go.
pub(super) trait Sink {
    /// Light that came to a place of the film, in pixels: its colours.
    fn splat(&mut self, _place: [f32; 2], _colors: &[f32]) {
        unreachable!("where samples are taken block by block no light is traced");
    }
    /// What they cost.
    fn tally(&mut self) -> &mut Tally;
    /// The next samples of a pixel, each with a row, see [`Group::splat`].
    fn take(&mut self, kernel: Kernel, group: &Group, rows: &mut [f32]);
}

/// The dimensions of a camera sample.
const PLACE: u32 = 0;
const LENS: u32 = 2;
const TIME: u32 = 4;
const WAVELENGTH: u32 = 5;

/// Samples of a pixel that begin at the camera.
struct CameraSamples<'a, C: ColorModel> {
    job: &'a Job<'a, C>,
    pixel: [u32; 2],
    streams: &'a [Stream],
    /// Where they go.
    starts: &'a mut Vec<Start<C>>,
    sampler: &'a Sampler,
}

impl<C: ColorModel> Task for CameraSamples<'_, C> {
    /// Where they lie within the pixel.
    type Output = [[f32; GROUP]; 2];

    #[inline(always)]
    fn run<F: Lanes>(self) -> Self::Output {
        let View { sensor, film, .. } = &self.job.view;
        let margin = film.margin() as f32;
        let [x, y] = self.pixel.map(|n| n as f32 - margin);
        let (width, height) = (F::splat(film.width as f32), F::splat(film.height as f32));
        let (open, close) = sensor.shutter();
        let (mut offsets, mut times) = ([[0.0; GROUP]; 2], [open; GROUP]);
        let (color, mut shifts) = (self.job.scene.color(), [0.0; GROUP]);
        let mut begun = self.streams.iter().zip(0..);
        for first in (0..self.streams.len()).step_by(F::WIDTH) {
            let streams = Streams::<F>::of(&self.streams[first..]);
            let offset = self.sampler.pair(streams, PLACE);
            offset.x.store_to(&mut offsets[0][first..]);
            offset.y.store_to(&mut offsets[1][first..]);
            let place = Vec2::new(
                (F::splat(x) + offset.x) / width,
                (F::splat(y) + offset.y) / height,
            );
            // What nobody looks at is not drawn: as a rule three of four draws.
            let mut lens = Vec2::new(F::zero(), F::zero());
            if sensor.has_lens() {
                lens = self.sampler.pair(streams, LENS);
            }
            if open < close {
                let time = self.sampler.number(streams, TIME);
                let time = F::splat(open) + time * F::splat(close - open);
                time.store_to(&mut times[first..]);
            }
            if color.upsamples() {
                let shift = self.sampler.number(streams, WAVELENGTH);
                shift.store_to(&mut shifts[first..]);
            }
            let end = self.streams.len().min(first + F::WIDTH);
            sensor.rays(place, lens, &times[first..end], |ray| {
                let Some((stream, number)) = begun.next() else {
                    return;
                };
                self.starts.push(Start {
                    ray,
                    pass: 0,
                    wavelengths: color.wavelengths_of(0, || shifts[number]),
                    stream: *stream,
                });
            });
        }
        offsets
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
    let samples = CameraSamples {
        job,
        pixel,
        streams,
        starts,
        sampler,
    };
    Group {
        pixel,
        count: streams.len(),
        offsets: job.scene.tracer().kernel().run(samples),
    }
}
