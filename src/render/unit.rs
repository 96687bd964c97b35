//! Units of work: a tile of the film in a pass over its samples. Units are handed to threads in order
//! and their sums are added to the film in that same order, whichever is ready first, so that the bits
//! do not depend on scheduling, and so that what was summed when a render stops is a beginning of it.

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::Vec2;

use super::checkpoint::Keeper;
use super::plan::Plan;
use super::prepare::Job;
use super::progress::{Phase, Progress};
use super::sums::{Summed, Sums, border};
use crate::color::ColorModel;
use crate::integrator::{Estimates, Estimator, Start};
use crate::sampler::Stream;
use crate::sensor::Window;

/// Bytes of path state in flight in a batch: within a core's caches, with rays enough for the tracer.
const BATCH_BYTES: usize = 512 << 10;

/// The film while it is being summed up.
struct Reduction<'k> {
    summed: Summed,
    /// Units that came too early.
    early: BTreeMap<usize, Sums>,
    keeper: Option<&'k mut Keeper>,
}

impl Reduction<'_> {
    fn take(&mut self, unit: usize, sums: Sums) {
        self.early.insert(unit, sums);
        while let Some(sums) = self.early.remove(&self.summed.next) {
            self.summed.sums.add(&sums);
            self.summed.next += 1;
        }
        if let Some(keeper) = &mut self.keeper {
            keeper.keep_when_due(&self.summed);
        }
    }
}

/// Goes on from `summed` until the job's crop is rendered or `progress` asks to stop.
pub(super) fn run<C: ColorModel>(
    job: &Job<'_, C>,
    plan: &Plan,
    summed: Summed,
    progress: &dyn Progress,
    keeper: Option<&mut Keeper>,
) -> Summed {
    progress.begin(Phase::Render, plan.samples(plan.units()));
    progress.advance(plan.samples(summed.next), 0);
    let taken = AtomicUsize::new(summed.next);
    let reduction = Mutex::new(Reduction {
        summed,
        early: BTreeMap::new(),
        keeper,
    });
    let channels = job.channels();
    rayon::broadcast(|_| {
        // A unit that was taken is always finished: no unit after it counts without it.
        while !progress.stop() {
            let unit = taken.fetch_add(1, Ordering::Relaxed);
            if unit >= plan.units() {
                break;
            }
            let sums = render_unit(job, plan, unit, &channels, progress);
            reduction
                .lock()
                .expect("no thread panics while it adds")
                .take(unit, sums);
        }
    });
    let reduction = reduction.into_inner().expect("no thread panicked");
    reduction.summed
}

/// One tile, for one pass.
fn render_unit<C: ColorModel>(
    job: &Job<'_, C>,
    plan: &Plan,
    unit: usize,
    channels: &[String],
    progress: &dyn Progress,
) -> Sums {
    let film = &job.view.film;
    let (tile, samples) = plan.unit(unit);
    let mut sums = Sums::new(
        tile.grown(border(&film.filter), &film.full()),
        channels.to_vec(),
    );
    let inside = |x: u32, y: u32| {
        plan.needed.contains(&Window {
            x,
            y,
            width: 1,
            height: 1,
        })
    };
    let batch = BATCH_BYTES / size_of::<Start<C>>() / 4;
    let mut starts: Vec<Start<C>> = Vec::with_capacity(batch);
    let mut places: Vec<([u32; 2], Vec2)> = Vec::with_capacity(batch);
    let mut estimates = Estimates {
        values: Vec::new(),
        extra: Vec::new(),
    };
    let extra = job.view.integrator.extra_channels().len();
    let mut row = vec![0.0; channels.len()];
    let mut flush = |starts: &mut Vec<Start<C>>, places: &mut Vec<([u32; 2], Vec2)>| {
        let before = sums.stats.rays();
        let (scene, sampler) = (job.scene, &job.view.sampler);
        job.view
            .integrator
            .estimate(scene, sampler, starts, &mut estimates, &mut sums.stats);
        for (i, (start, (pixel, offset))) in starts.iter().zip(places.iter()).enumerate() {
            let estimate = &estimates.values[i];
            scene
                .color()
                .develop(&estimate.radiance, &start.wavelengths, &mut row);
            let opacity = channels.len() - 1;
            row[opacity - extra..opacity].copy_from_slice(&estimates.extra[i * extra..][..extra]);
            row[opacity] = estimate.alpha;
            sums.splat(&film.filter, *pixel, *offset, &row);
        }
        progress.advance(starts.len() as u64, sums.stats.rays() - before);
        starts.clear();
        places.clear();
    };
    for y in tile.y..tile.y + tile.height {
        for x in (tile.x..tile.x + tile.width).filter(|x| inside(*x, y)) {
            for index in samples.clone() {
                let (start, offset) = camera_sample(job, [x, y], index);
                starts.push(start);
                places.push(([x, y], offset));
                if starts.len() == batch {
                    flush(&mut starts, &mut places);
                }
            }
        }
    }
    flush(&mut starts, &mut places);
    sums
}

/// Sample `index` of a pixel: its path's start, and its place within the pixel.
fn camera_sample<C: ColorModel>(
    job: &Job<'_, C>,
    [x, y]: [u32; 2],
    index: u32,
) -> (Start<C>, Vec2) {
    let mut stream = Stream::new(job.seed, x, y, index);
    let offset = stream.next_2d(&job.view.sampler);
    let lens = stream.next_2d(&job.view.sampler);
    let (open, close) = job.view.sensor.shutter();
    let time = open + stream.next_1d(&job.view.sampler) * (close - open);
    let wavelengths = job
        .scene
        .color()
        .wavelengths(stream.next_1d(&job.view.sampler));
    let film = Vec2::new(x as f32 + offset.x, y as f32 + offset.y)
        / Vec2::new(job.view.film.width as f32, job.view.film.height as f32);
    (
        Start {
            ray: job.view.sensor.ray(film, lens, time),
            wavelengths,
            stream,
        },
        offset,
    )
}
