//! Where a render's work lies: for each pixel of the crop the nodes that its rays enter, of all kinds, a sample.
//! Each pixel is traced by itself, so that its counts are its own; they add up to those of a render. Where pixels get
//! different numbers of samples by a gaze, a pixel's nodes are those of all of its samples.

use std::sync::Mutex;

use rayon::prelude::*;

use super::foveated::Fovea;
use super::plan::PASS;
use super::prepare::Job;
use super::progress::{Phase, Progress, Silent};
use super::samples::{self, Sink};
use crate::color::ColorModel;
use crate::error::{Error, Result};
use crate::film::{Group, Tally};
use crate::integrator::Stats;
use crate::lanes::Kernel;
use crate::sampler::Stream;

/// Counts by pixel.
#[derive(Clone, Debug)]
pub struct Heat {
    /// Pixels across.
    pub width: usize,
    /// Node steps, row by row: a sample, or a pixel where not all pixels get the same number of samples.
    pub node_steps: Vec<f32>,
    /// Whether they are of all samples of a pixel.
    pub of_pixels: bool,
    /// What all of it took.
    pub stats: Stats,
    /// Samples of each pixel that were traced: the render's first, 16 at most, or all where it gets fewer.
    pub samples: u32,
}

/// Counts, and lets go of what was estimated.
struct Counted(Tally);

impl Sink for Counted {
    fn tally(&mut self) -> &mut Tally {
        &mut self.0
    }

    fn take(&mut self, _: Kernel, _: &Group, _: &mut [f32]) {}
}

/// Traces the job's crop, whose pixels get samples by `fovea` if there is one.
pub(super) fn count<C: ColorModel>(
    job: &Job<'_, C>,
    fovea: Option<&Fovea>,
    progress: &dyn Progress,
) -> Result<Heat> {
    let crop = job.view.film.shown();
    let samples = job.view.sampler.sample_count().min(PASS);
    let (width, height) = (crop.width as usize, crop.height as usize);
    let mut node_steps: Vec<f32> = Vec::new();
    node_steps
        .try_reserve_exact(width * height)
        .map_err(|_| Error::input("the counts of all pixels do not fit into memory"))?;
    node_steps.resize(width * height, 0.0);
    progress.begin(Phase::Render, u64::from(samples) * (width * height) as u64);
    let stats = Mutex::new(Stats::default());
    let rows = node_steps
        .par_chunks_exact_mut(width)
        .zip(crop.y..crop.y + crop.height);
    rows.for_each(|(row, y)| {
        if progress.stop() {
            return;
        }
        let mut of_row = Stats::default();
        for (steps, x) in row.iter_mut().zip(crop.x..) {
            let mut sink = Counted(Tally::default());
            let sampler = fovea.map_or(&job.view.sampler, |fovea| fovea.sampler_of([x, y]));
            let all = sampler.sample_count();
            let traced = all.min(samples);
            let pixels = std::iter::once(([x, y], 0..traced));
            let stream = |[x, y]: [u32; 2], index| Stream::new(job.seed, x, y, index);
            samples::estimate(job, sampler, pixels, stream, &Silent, &mut sink);
            let counted = sink.0.stats;
            *steps = counted.tracing.node_steps as f32 / traced as f32;
            if fovea.is_some() {
                *steps *= all as f32;
            }
            of_row.add(&counted);
        }
        progress.advance(u64::from(samples) * width as u64, of_row.rays());
        stats
            .lock()
            .expect("no thread panics while it adds")
            .add(&of_row);
    });
    Ok(Heat {
        width,
        node_steps,
        of_pixels: fovea.is_some(),
        stats: stats.into_inner().expect("no thread panicked"),
        samples,
    })
}
