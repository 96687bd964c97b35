//! Units of work: a tile of the film in a pass over its samples. Units are handed to threads in order
//! and their sums are added to the film in that same order, whichever is ready first, so that the bits
//! do not depend on scheduling. The grid of tiles is fixed to the full film, whatever the crop.

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::Vec2;

use super::prepare::Job;
use super::progress::{Phase, Progress};
use super::sums::{Sums, border};
use crate::color::ColorModel;
use crate::integrator::{Estimate, Start};
use crate::sampler::Stream;
use crate::sensor::Window;

/// Pixels along a tile's side.
const TILE: u32 = 32;
/// Samples of a pixel in one pass.
const PASS: u32 = 16;
/// Bytes of path state in flight in a batch: within a core's caches, with rays enough for the tracer.
const BATCH_BYTES: usize = 512 << 10;

/// A tile's own pixels, within those that are needed at all.
fn tiles(film: &Window, needed: &Window) -> Vec<Window> {
    let along =
        |start: u32, size: u32| (start / TILE..(start + size).div_ceil(TILE)).map(|t| t * TILE);
    let mut tiles = Vec::new();
    for y in along(needed.y, needed.height) {
        for x in along(needed.x, needed.width) {
            tiles.push(
                Window {
                    x,
                    y,
                    width: TILE,
                    height: TILE,
                }
                .grown(0, film),
            );
        }
    }
    tiles
}

/// The film while it is being summed up.
struct Reduction {
    sums: Sums,
    /// The unit whose turn it is.
    next: usize,
    /// Units that came too early.
    early: BTreeMap<usize, Sums>,
}

impl Reduction {
    fn take(&mut self, unit: usize, sums: Sums) {
        self.early.insert(unit, sums);
        while let Some(sums) = self.early.remove(&self.next) {
            self.sums.add(&sums);
            self.next += 1;
        }
    }
}

/// Renders the job's crop.
pub(super) fn run<C: ColorModel>(job: &Job<C>, seed: u64, progress: &dyn Progress) -> Sums {
    let (full, crop) = (job.film.full(), job.film.crop);
    // Samples outside the crop reach into it, as they do in the full image.
    let needed = crop.grown(border(&job.film.filter), &full);
    let tiles = tiles(&full, &needed);
    let spp = job.sampler.sample_count();
    let units = tiles.len() * spp.div_ceil(PASS) as usize;
    let pixels = u64::from(needed.width) * u64::from(needed.height);
    progress.begin(Phase::Render, pixels * u64::from(spp));

    let mut channels = job.scene.color().channels();
    channels.push("A".into());
    let reduction = Mutex::new(Reduction {
        sums: Sums::new(crop, channels.clone()),
        next: 0,
        early: BTreeMap::new(),
    });
    let taken = AtomicUsize::new(0);
    rayon::broadcast(|_| {
        loop {
            let unit = taken.fetch_add(1, Ordering::Relaxed);
            if unit >= units {
                break;
            }
            let first = (unit / tiles.len()) as u32 * PASS;
            let tile = &tiles[unit % tiles.len()];
            let sums = render_unit(
                job,
                seed,
                tile,
                &needed,
                first..spp.min(first + PASS),
                &channels,
                progress,
            );
            reduction
                .lock()
                .expect("no thread panics while it adds")
                .take(unit, sums);
        }
    });
    reduction.into_inner().expect("no thread panicked").sums
}

/// One tile, for a range of sample indices.
fn render_unit<C: ColorModel>(
    job: &Job<C>,
    seed: u64,
    tile: &Window,
    needed: &Window,
    samples: std::ops::Range<u32>,
    channels: &[String],
    progress: &dyn Progress,
) -> Sums {
    let film = &job.film;
    let mut sums = Sums::new(
        tile.grown(border(&film.filter), &film.full()),
        channels.to_vec(),
    );
    let inside = |x: u32, y: u32| {
        needed.contains(&Window {
            x,
            y,
            width: 1,
            height: 1,
        })
    };
    let batch = BATCH_BYTES / size_of::<Start<C>>() / 4;
    let mut starts: Vec<Start<C>> = Vec::with_capacity(batch);
    let mut places: Vec<([u32; 2], Vec2)> = Vec::with_capacity(batch);
    let mut estimates: Vec<Estimate<C::Sample>> = Vec::new();
    let mut row = vec![0.0; channels.len()];
    let mut flush = |starts: &mut Vec<Start<C>>, places: &mut Vec<([u32; 2], Vec2)>| {
        let before = sums.stats.rays();
        let (scene, sampler) = (&job.scene, &job.sampler);
        job.integrator
            .estimate(scene, sampler, starts, &mut estimates, &mut sums.stats);
        for ((start, estimate), (pixel, offset)) in starts.iter().zip(&estimates).zip(places.iter())
        {
            scene
                .color()
                .develop(&estimate.radiance, &start.wavelengths, &mut row);
            row[channels.len() - 1] = estimate.alpha;
            sums.splat(&film.filter, *pixel, *offset, &row);
        }
        progress.advance(starts.len() as u64, sums.stats.rays() - before);
        starts.clear();
        places.clear();
    };
    for y in tile.y..tile.y + tile.height {
        for x in (tile.x..tile.x + tile.width).filter(|x| inside(*x, y)) {
            for index in samples.clone() {
                let (start, offset) = camera_sample(job, seed, [x, y], index);
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
    job: &Job<C>,
    seed: u64,
    [x, y]: [u32; 2],
    index: u32,
) -> (Start<C>, Vec2) {
    let mut stream = Stream::new(seed, x, y, index);
    let offset = stream.next_2d(&job.sampler);
    let lens = stream.next_2d(&job.sampler);
    let (open, close) = job.sensor.shutter();
    let time = open + stream.next_1d(&job.sampler) * (close - open);
    let wavelengths = job.scene.color().wavelengths(stream.next_1d(&job.sampler));
    let film = Vec2::new(x as f32 + offset.x, y as f32 + offset.y)
        / Vec2::new(job.film.width as f32, job.film.height as f32);
    (
        Start {
            ray: job.sensor.ray(film, lens, time),
            wavelengths,
            stream,
        },
        offset,
    )
}
