//! Camera samples: from their places on the film to what the integrator and the colour model make of them,
//! a batch at a time.

use std::time::{Duration, Instant};

use glam::Vec2;

use super::prepare::{Job, View};
use super::progress::Progress;
use super::sums::Tally;
use crate::color::ColorModel;
use crate::integrator::{Cost, Estimates, Estimator, Start};
use crate::sampler::{Sampler, Stream};

/// Bytes of path state in flight in a batch: within a core's caches, with rays enough for the tracer.
const BATCH_BYTES: usize = 512 << 10;

/// Where a sample lies: its pixel, and its offset in [0, 1)² within.
pub(super) type Place = ([u32; 2], Vec2);

/// Estimates the samples of one sampler, in the order of `samples`, and gives each one's place and channels
/// to `sink` in that order; what it cost is counted in `sink`'s tally.
pub(super) fn estimate<C: ColorModel, S: Sink>(
    job: &Job<'_, C>,
    sampler: &Sampler,
    samples: impl Iterator<Item = ([u32; 2], Stream)>,
    progress: &dyn Progress,
    sink: &mut S,
) {
    let begin = Instant::now();
    let (mut cost, mut film) = (Cost::default(), Duration::ZERO);
    let batch = BATCH_BYTES / size_of::<Start<C>>() / 4;
    let mut starts: Vec<Start<C>> = Vec::with_capacity(batch);
    let mut places: Vec<Place> = Vec::with_capacity(batch);
    let mut estimates = Estimates {
        values: Vec::new(),
        extra: Vec::new(),
    };
    let extra = job.view.integrator.extra_channels().len();
    let mut row = vec![0.0; job.channels().len()];
    let mut flush = |starts: &mut Vec<Start<C>>, places: &mut Vec<Place>| {
        let before = cost.stats.rays();
        let (scene, integrator) = (job.scene, &job.view.integrator);
        integrator.estimate(scene, sampler, starts, &mut estimates, &mut cost);
        let rays = cost.stats.rays() - before;
        let estimated = Instant::now();
        for (i, (start, place)) in starts.iter().zip(places.iter()).enumerate() {
            let estimate = &estimates.values[i];
            scene
                .color()
                .develop(&estimate.radiance, &start.wavelengths, &mut row);
            let opacity = row.len() - 1;
            row[opacity - extra..opacity].copy_from_slice(&estimates.extra[i * extra..][..extra]);
            row[opacity] = estimate.alpha;
            sink.take(place, &row);
        }
        film += estimated.elapsed();
        progress.advance(starts.len() as u64, rays);
        starts.clear();
        places.clear();
    };
    for (pixel, stream) in samples {
        let (start, offset) = camera_sample(job, sampler, pixel, stream);
        starts.push(start);
        places.push((pixel, offset));
        if starts.len() == batch {
            flush(&mut starts, &mut places);
        }
    }
    flush(&mut starts, &mut places);
    let total = begin.elapsed().as_secs_f64();
    sink.tally().spend(&cost, total, film.as_secs_f64());
}

/// Where samples go.
pub(super) trait Sink {
    /// What they cost.
    fn tally(&mut self) -> &mut Tally;
    /// The next sample.
    fn take(&mut self, place: &Place, channels: &[f32]);
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
