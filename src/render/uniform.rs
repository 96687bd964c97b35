//! The same number of samples for every pixel: the tiles of each pass.

use super::checkpoint::Keeper;
use super::options::Options;
use super::origin::Outcome;
use super::plan::{Completed, Plan};
use super::prepare::Job;
use super::progress::{Phase, Progress};
use super::samples::{self, Sink};
use super::unit;
use crate::color::ColorModel;
use crate::error::{Error, Result};
use crate::film::{Accumulator as _, Group, Summed, Sums, Tally};
use crate::filter::Filter;
use crate::lanes::Kernel;
use crate::sampler::Stream;

/// Renders the job's crop, going on from what `keeper` kept, until `progress` asks to stop.
pub(super) fn render<C: ColorModel>(
    job: &Job<'_, C>,
    options: &Options,
    progress: &dyn Progress,
    mut keeper: Option<&mut Keeper>,
) -> Result<(Summed<Sums>, Completed)> {
    let plan = job.plan(job.view.sampler.sample_count());
    let mut summed = Summed {
        sums: Sums::new(job.view.film.shown(), job.layout())?,
        next: 0,
    };
    if let Some(keeper) = &mut keeper {
        keeper.resume(&mut summed, plan.units())?;
    }
    progress.begin(Phase::Render, plan.samples(plan.units()));
    progress.advance(plan.samples(summed.next), 0);
    let (first, scene) = (summed.next, options.scene.as_str());
    let add = |part: Sums| {
        summed.sums.add(&part);
        summed.next += 1;
        if let Some(keeper) = &mut keeper {
            keeper.keep_when_due(&summed);
        }
        if progress.wants_picture() {
            let image = summed.sums.develop(&job.view.film)?;
            let outcome = Outcome {
                spp: plan.spp(),
                samples_complete: plan.completed(summed.next).samples,
                adaptive: None,
                foveated: None,
            };
            progress.picture(&job.picture(scene, image, &outcome));
        }
        Ok::<_, Error>(())
    };
    unit::run(first..plan.units(), progress, add, |unit| {
        render_unit(job, &plan, unit, progress)
    })?;
    let completed = plan.completed(summed.next);
    Ok((summed, completed))
}

/// One tile, for one pass.
pub(super) fn render_unit<C: ColorModel>(
    job: &Job<'_, C>,
    plan: &Plan,
    unit: usize,
    progress: &dyn Progress,
) -> Sums {
    struct Splat<'f>(Sums, &'f Filter);
    impl Sink for Splat<'_> {
        fn tally(&mut self) -> &mut Tally {
            &mut self.0.tally
        }
        fn splat(&mut self, place: [f32; 2], colors: &[f32]) {
            if !self.0.splats.push(place, colors) {
                let pixel = place.map(|x| if x > 0.0 { x as u32 } else { 0 });
                self.0.tally.drop(pixel, 1);
            }
        }
        fn take(&mut self, kernel: Kernel, group: &Group, rows: &mut [f32]) {
            self.0.splat(kernel, self.1, group, rows);
        }
    }
    let film = &job.view.film;
    let (tile, indices) = plan.unit(unit);
    let reach = tile.grown(film.filter.reach(), &film.sampled());
    let mut sums = Sums::new(reach, job.layout()).expect("a tile is small");
    let own = tile.grown(0, &plan.needed);
    sums.begin_splats(&film.filter, &own, indices.len() as u32);
    let mut sink = Splat(sums, &film.filter);
    let pixels = (own.y..own.y + own.height)
        .flat_map(|y| (own.x..own.x + own.width).map(move |x| [x, y]))
        .map(|pixel| (pixel, indices.clone()));
    let stream = |[x, y]: [u32; 2], index| Stream::new(job.seed, x, y, index);
    let sampler = &job.view.sampler;
    samples::estimate(job, sampler, pixels, stream, progress, &mut sink);
    sink.0
}
