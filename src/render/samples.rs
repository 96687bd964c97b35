//! Camera samples: from their places on the film to what the integrator and the colour model make of them,
//! a batch at a time.

use std::ops::Range;
use std::time::{Duration, Instant};

use glam::Vec2;

use super::prepare::{Job, View};
use super::progress::Progress;
use crate::color::ColorModel;
use crate::film::{GROUP, Group, Layout, Tally};
use crate::integrator::{Cost, Estimate, Estimates, Estimator as _, Start};
use crate::lanes::Kernel;
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
    let begin = Instant::now();
    let mut batch = Batch {
        job,
        sampler,
        progress,
        layout: job.layout(),
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
            let mut offsets = [Vec2::ZERO; GROUP];
            let first = batch.starts.len();
            for (offset, index) in offsets.iter_mut().zip(&mut indices) {
                let (start, place) = camera_sample(job, sampler, pixel, stream(pixel, index));
                batch.starts.push(start);
                *offset = place;
            }
            let count = batch.starts.len() - first;
            batch.groups.push(Group::new(pixel, &offsets[..count]));
        }
    }
    batch.flush(sink);
    let total = begin.elapsed().as_secs_f64();
    let Batch { cost, film, .. } = batch;
    sink.tally().spend(&cost, total, film.as_secs_f64());
}

/// Samples that are estimated together.
struct Batch<'a, C: ColorModel> {
    job: &'a Job<'a, C>,
    sampler: &'a Sampler,
    progress: &'a dyn Progress,
    layout: Layout,
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

/// A path's start, and its place within the pixel.
fn camera_sample<C: ColorModel>(
    job: &Job<'_, C>,
    sampler: &Sampler,
    [x, y]: [u32; 2],
    mut stream: Stream,
) -> (Start<C>, Vec2) {
    let View { sensor, film, .. } = &job.view;
    let offset = stream.next_2d(sampler);
    // What nobody looks at is not drawn: as a rule three of four draws.
    let lens = if sensor.has_lens() {
        stream.seek(LENS);
        stream.next_2d(sampler)
    } else {
        Vec2::ZERO
    };
    let (open, close) = sensor.shutter();
    let time = if open < close {
        stream.seek(TIME);
        open + stream.next_1d(sampler) * (close - open)
    } else {
        open
    };
    let wavelengths = job.scene.color().wavelengths(|| {
        stream.seek(WAVELENGTH);
        stream.next_1d(sampler)
    });
    let margin = film.margin() as f32;
    let place = Vec2::new(x as f32 - margin + offset.x, y as f32 - margin + offset.y)
        / Vec2::new(film.width as f32, film.height as f32);
    (
        Start {
            ray: sensor.ray(place, lens, time),
            wavelengths,
            stream,
        },
        offset,
    )
}
