//! Renders that follow one another. A session keeps the threads and the last scene, so that frames and
//! sensors that look at the same meshes have them loaded and their trees built once; a scene that is
//! another takes the place of the one before, so that one is in memory at a time.

use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::Arc;

use rayon::ThreadPool;

use super::adaptive::{self, AdaptiveReport, Ladder};
use super::black;
use super::checkpoint::Keeper;
use super::colors::Model;
use super::foveated::{self, Fovea, FoveatedReport};
use super::heat::{self, Heat};
use super::options::{Adaptive, Options};
use super::origin::Outcome;
use super::part::{self, Head, Made, Noise, Passes};
use super::pinned;
use super::plan::Completed;
use super::prepare::{self, Ask, Facts, Job, Shelf, View};
use super::progress::Progress;
use super::provenance::{self, Provenance};
use super::uniform;
use super::{Parted, Rendered, Report, rastered, timed};
#[cfg(all(feature = "bands", not(test)))]
use crate::color::Bands;
use crate::color::{ColorModel, Comb, Response, Rgb};
use crate::description::Description;
use crate::error::{Error, Problem, Result};
use crate::film::{Accumulator, Tally};
use crate::image::Image;
use crate::integrator::{Integrator, Raster};
use crate::mesh::ReadMesh;
use crate::sensor::Film;
use crate::shape::Bounds;

/// Renders that follow one another; see the module.
#[derive(Debug, Default)]
pub struct Session {
    pool: Option<Pool>,
    shelf: Shelf,
}

#[derive(Debug)]
struct Pool {
    /// How many threads, and whether pinned.
    asked: (Option<NonZeroUsize>, bool),
    threads: ThreadPool,
}

/// Something to be done in a colour model. This is where the model is chosen, once and for all that is
/// below.
pub(super) trait Task: Sized {
    /// What comes of it.
    type Output;

    /// Does it.
    fn run<C: ColorModel>(self, color: C) -> Result<Self::Output>;

    /// Does it in the model that is asked for.
    fn run_in(self, description: &Description, options: &Options) -> Result<Self::Output> {
        match Model::of(description, options)? {
            Model::Rgb => self.run(Rgb),
            Model::Bands(comb, responses) => in_bands(self, comb, responses),
        }
    }
}

/// Does a task in bands: the code is compiled for few numbers of them, and lanes beyond those asked for carry nothing.
/// Unit tests render in RGB alone, for they would take twice as long to compile: `tests/it` renders in bands.
#[cfg(all(feature = "bands", not(test)))]
fn in_bands<T: Task>(task: T, comb: Comb, responses: Arc<[Response]>) -> Result<T::Output> {
    match comb.count() {
        ..=8 => task.run(Bands::<8>::new(comb, responses)),
        9..=16 => task.run(Bands::<16>::new(comb, responses)),
        _ => task.run(Bands::<32>::new(comb, responses)),
    }
}

#[cfg(not(all(feature = "bands", not(test))))]
fn in_bands<T: Task>(_: T, _: Comb, _: Arc<[Response]>) -> Result<T::Output> {
    Err(Error::input(
        "this program was built without bands: build it with the feature `bands`, which is on by default",
    ))
}

/// Makes sure that the scene is in memory and tells of it.
pub(super) struct Measure<'a>(pub(super) Ask<'a>);

impl Task for Measure<'_> {
    type Output = Facts;

    fn run<C: ColorModel>(mut self, color: C) -> Result<Facts> {
        let job = prepare::prepare(&mut self.0, color)?;
        let mut facts = job.facts.clone();
        facts.warnings = job.warnings;
        Ok(facts)
    }
}

/// Makes the image.
struct Render<'a>(Ask<'a>);

impl Task for Render<'_> {
    type Output = Rendered;

    fn run<C: ColorModel>(mut self, color: C) -> Result<Rendered> {
        let (description, options) = (self.0.description, self.0.options);
        let progress = self.0.progress;
        // What the z-buffer draws needs no tree.
        self.0.traced = !rastered::draws(description, options);
        let job = prepare::prepare(&mut self.0, color)?;
        let mut keeper = match &options.checkpoint {
            Some(checkpoint) => {
                let fingerprint = job.fingerprint(description, options)?;
                Some(Keeper::new(checkpoint.clone(), fingerprint))
            }
            None => None,
        };
        let mut seconds = job.spent;
        let Finished {
            image,
            completed,
            tally,
            adaptive,
            foveated,
            notes,
        } = timed(&mut seconds.render, || {
            match (&options.adaptive, options.gaze) {
                (Some(_), Some(_)) => Err(Error::input(
                    "samples go either where the noise is or by a gaze, not both",
                )),
                (Some(adaptive), None) => {
                    Finished::adaptive(&job, (options, adaptive), progress, keeper.as_mut())
                }
                (None, Some(gaze)) => {
                    Finished::foveated(&job, (options, gaze), progress, keeper.as_mut())
                }
                (None, None) if let Integrator::Raster(raster) = &job.view.integrator => {
                    Finished::rastered(&job, raster, progress)
                }
                (None, None) => Finished::uniform(&job, options, progress, keeper.as_mut()),
            }
        })?;
        let mut warnings = job.warnings.clone();
        if let Some(keeper) = &keeper {
            seconds.render = keeper.seconds();
            warnings.extend(keeper.warning());
        }
        let mut report = job.report(completed, seconds);
        if let Some(adaptive) = adaptive {
            report.spp = adaptive.mean_spp.round() as u32;
            report.adaptive = Some(adaptive);
        }
        if let Some(foveated) = foveated {
            report.spp = foveated.mean_spp.round() as u32;
            report.foveated = Some(foveated);
        }
        if let Integrator::Raster(raster) = &job.view.integrator {
            match options.by_blocks() {
                false => report.spp = raster.pattern.count() as u32,
                true => warnings.push(rastered::by_rays()),
            }
        }
        tell(&mut report, &tally, &job.view.film);
        warnings.extend(notes);
        warnings.extend(tally.warning());
        if completed.units[0] > 0 {
            warnings.extend(black::black(&job, description, &image));
        }
        let provenance = match options.recorded && completed.is_whole() {
            true => {
                let film = &job.view.film;
                let whole = provenance::without_crop(description, film);
                Some(Provenance::new(
                    job.fingerprint(&whole, options)?,
                    film.crop,
                ))
            }
            false => None,
        };
        let rendered = Rendered {
            image,
            provenance,
            window: job.window(),
            metadata: job.origin(&options.scene).metadata(&Outcome {
                spp: report.spp,
                samples_complete: report.completed.samples,
                adaptive: report.adaptive.as_ref(),
                foveated: report.foveated.as_ref(),
            }),
            report,
            warnings,
        };
        if let Some(kept) = &mut self.0.shelf.kept {
            kept.told();
        }
        Ok(rendered)
    }
}

/// Makes a part.
struct Part<'a> {
    ask: Ask<'a>,
    passes: Passes,
    path: &'a Path,
}

impl Task for Part<'_> {
    type Output = Parted;

    fn run<C: ColorModel>(mut self, color: C) -> Result<Parted> {
        let (description, options) = (self.ask.description, self.ask.options);
        let progress = self.ask.progress;
        if options.gaze.is_some() {
            let message = "samples by the distance from a gaze make an image, and no part of one";
            return Err(Error::input(message).help(
                "leave out --foveate, or name the output .exr; crops can be rendered by themselves",
            ));
        }
        let job = prepare::prepare(&mut self.ask, color)?;
        let View { film, sampler, .. } = &job.view;
        let spp = sampler.sample_count();
        let ladder = match &options.adaptive {
            Some(adaptive) => Some((adaptive, Ladder::checked(sampler, adaptive)?)),
            None => None,
        };
        let all_passes = match &ladder {
            Some((_, ladder)) => ladder.passes(),
            None => job.plan(spp).passes(),
        };
        let passes = self.passes.within(all_passes)?;
        if passes.start > 0 && job.view.integrator.traces_light() {
            let message = "light that is traced comes to the whole film, and later passes cannot be kept apart";
            return Err(Error::input(message)
                .help("leave out --passes; crops can be rendered by themselves"));
        }
        let whole = provenance::without_crop(description, film);
        let head = Head {
            fingerprint: job.fingerprint(&whole, options)?,
            target: part::target(),
            origin: job.origin(&options.scene),
            film: film.clone(),
            layout: job.layout(),
            spp,
            adaptive: ladder.as_ref().map(|(adaptive, ladder)| Noise {
                threshold: adaptive.noise_threshold,
                limits: ladder.limits(),
            }),
            passes,
            all_passes,
        };
        let mut seconds = job.spent;
        let ladder = ladder.as_ref().map(|(_, ladder)| ladder);
        let Made { completed, tally } = timed(&mut seconds.render, || {
            part::make(&job, &head, ladder, self.path, progress)
        })?;
        let mut report = job.report(completed, seconds);
        tell(&mut report, &tally, film);
        report.passes = Some(head.passes.clone());
        let mut warnings = job.warnings.clone();
        warnings.extend(tally.warning());
        if let Integrator::Raster(_) = &job.view.integrator {
            warnings.push(rastered::by_rays());
        }
        if let Some(kept) = &mut self.ask.shelf.kept {
            kept.told();
        }
        Ok(Parted { report, warnings })
    }
}

/// What samples cost and what came of them beside the image.
fn tell(report: &mut Report, tally: &Tally, film: &Film) {
    report.stats = tally.stats;
    report.seconds.spend(&tally.times);
    report.dropped_samples = tally.dropped;
    let margin = film.margin();
    report.dropped_pixel = tally
        .dropped_pixel
        .map(|pixel| pixel.map(|place| place.saturating_sub(margin)));
}

/// Counts by pixel.
struct Warm<'a>(Ask<'a>);

impl Task for Warm<'_> {
    type Output = Heat;

    fn run<C: ColorModel>(mut self, color: C) -> Result<Heat> {
        let (options, progress) = (self.0.options, self.0.progress);
        let job = prepare::prepare(&mut self.0, color)?;
        let fovea = options.gaze.map(|gaze| Fovea::new(&job.view, gaze));
        heat::count(&job, fovea.transpose()?.as_ref(), progress)
    }
}

/// What samples came to.
struct Finished {
    image: Image,
    completed: Completed,
    tally: Tally,
    adaptive: Option<AdaptiveReport>,
    foveated: Option<FoveatedReport>,
    /// What the user should know of the image.
    notes: Vec<Problem>,
}

impl Finished {
    fn uniform<C: ColorModel>(
        job: &Job<'_, C>,
        options: &Options,
        progress: &dyn Progress,
        mut keeper: Option<&mut Keeper>,
    ) -> Result<Self> {
        let (summed, completed) = uniform::render(job, options, progress, keeper.as_deref_mut())?;
        if let Some(keeper) = keeper {
            keeper.finish(&summed, completed.is_whole());
        }
        let mut tally = summed.sums.tally;
        let develop = || summed.sums.develop(&job.view.film);
        Ok(Self {
            image: added(&mut tally.times.film, develop)?,
            completed,
            tally,
            adaptive: None,
            foveated: None,
            notes: Vec::new(),
        })
    }

    fn rastered<C: ColorModel>(
        job: &Job<'_, C>,
        raster: &Raster,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let drawn = rastered::draw(job.scene, &job.view, raster, progress)?;
        Ok(Self {
            image: drawn.sums.develop(&job.view.film)?,
            completed: drawn.completed,
            tally: drawn.sums.tally,
            adaptive: None,
            foveated: None,
            notes: drawn.notes,
        })
    }

    fn adaptive<C: ColorModel>(
        job: &Job<'_, C>,
        options: (&Options, &Adaptive),
        progress: &dyn Progress,
        mut keeper: Option<&mut Keeper>,
    ) -> Result<Self> {
        let (summed, completed, ladder) =
            adaptive::render(job, options, progress, keeper.as_deref_mut())?;
        if let Some(keeper) = keeper {
            keeper.finish(&summed, completed.is_whole());
        }
        let blocks = &summed.sums;
        let mut tally = *blocks.tally();
        Ok(Self {
            image: added(&mut tally.times.film, || {
                adaptive::develop(&job.view.film, &job.layout(), blocks)
            })?,
            completed,
            tally,
            adaptive: Some(
                adaptive::Given::new(&job.view.film, ladder.limits(), blocks)
                    .report(options.1.noise_threshold, ladder.limits()),
            ),
            foveated: None,
            notes: Vec::new(),
        })
    }

    fn foveated<C: ColorModel>(
        job: &Job<'_, C>,
        options: (&Options, [f64; 2]),
        progress: &dyn Progress,
        mut keeper: Option<&mut Keeper>,
    ) -> Result<Self> {
        let (summed, completed, limits) =
            foveated::render(job, options, progress, keeper.as_deref_mut())?;
        if let Some(keeper) = keeper {
            keeper.finish(&summed, completed.is_whole());
        }
        let (film, blocks) = (&job.view.film, &summed.sums);
        let mut tally = *blocks.tally();
        Ok(Self {
            image: added(&mut tally.times.film, || {
                foveated::develop(film, &job.layout(), blocks)
            })?,
            completed,
            tally,
            adaptive: None,
            foveated: Some(FoveatedReport::new(film, options.1, limits, blocks)),
            notes: Vec::new(),
        })
    }
}

/// Does `work` and adds the seconds that it takes.
fn added<T>(seconds: &mut f64, work: impl FnOnce() -> T) -> T {
    let mut more = 0.0;
    let result = timed(&mut more, work);
    *seconds += more;
    result
}

impl Session {
    /// Takes a mesh that was read already: the next scene does not read it again.
    pub fn give(&mut self, mesh: ReadMesh) {
        self.shelf.given = Some(mesh);
    }

    /// Renders what `description` says. `description` has the options' overrides already: see
    /// [`Overrides::apply`](super::Overrides::apply). A render that was stopped is no error: the report
    /// says what is complete.
    ///
    /// # Errors
    /// Names everything that is wrong with the scene, unknown properties included; and a checkpoint that
    /// cannot be continued, or a lack of memory.
    pub fn render(
        &mut self,
        description: &Description,
        options: &Options,
        progress: &dyn Progress,
    ) -> Result<Rendered> {
        self.run(options, |shelf| {
            let ask = Ask::traced(shelf, description, options, progress);
            Render(ask).run_in(description, options)
        })
    }

    /// Renders some passes of what `description` says into a part of the image, the file `path`, which
    /// [`merge`](super::merge()) puts together with the others. A render that was stopped is no error: the report says
    /// so, and no file is written.
    ///
    /// # Errors
    /// As [`Session::render`], and where there are no such passes or the file cannot be written.
    pub fn render_part(
        &mut self,
        description: &Description,
        options: &Options,
        passes: Passes,
        path: &Path,
        progress: &dyn Progress,
    ) -> Result<Parted> {
        self.run(options, |shelf| {
            let ask = Ask::traced(shelf, description, options, progress);
            Part { ask, passes, path }.run_in(description, options)
        })
    }

    /// How many nodes of the trees each pixel enters: see [`Heat`].
    ///
    /// # Errors
    /// As [`Session::render`].
    pub fn heat(
        &mut self,
        description: &Description,
        options: &Options,
        progress: &dyn Progress,
    ) -> Result<Heat> {
        self.run(options, |shelf| {
            let ask = Ask::traced(shelf, description, options, progress);
            Warm(ask).run_in(description, options)
        })
    }

    /// The box around the scene, which is in memory then for the next render.
    ///
    /// # Errors
    /// As [`Session::render`].
    pub fn bounds(
        &mut self,
        description: &Description,
        options: &Options,
        progress: &dyn Progress,
    ) -> Result<Bounds> {
        Ok(self.contents(description, options, progress)?.bounds)
    }

    /// What is known of the scene once it is in memory.
    pub(super) fn contents(
        &mut self,
        description: &Description,
        options: &Options,
        progress: &dyn Progress,
    ) -> Result<Facts> {
        self.run(options, |shelf| {
            let ask = Ask::traced(shelf, description, options, progress);
            Measure(ask).run_in(description, options)
        })
    }

    /// Does `work` on the threads that the options ask for.
    pub(super) fn run<T: Send>(
        &mut self,
        options: &Options,
        work: impl FnOnce(&mut Shelf) -> Result<T> + Send,
    ) -> Result<T> {
        let shelf = &mut self.shelf;
        let asked = (options.threads, options.pinned);
        let pool = match &mut self.pool {
            Some(pool) if pool.asked == asked => pool,
            pool => pool.insert(Pool {
                asked,
                threads: start(options.threads, options.pinned)?,
            }),
        };
        pool.threads.install(|| work(shelf))
    }
}

/// Starts so many threads, one a processor where that is open.
fn start(threads: Option<NonZeroUsize>, pinned: bool) -> Result<ThreadPool> {
    let threads = threads.map_or(0, NonZeroUsize::get);
    let mut builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
    if pinned {
        builder = builder.start_handler(pinned::pin);
    }
    builder
        .build()
        .map_err(|e| Error::input(format!("cannot start {threads} threads: {e}")))
}
