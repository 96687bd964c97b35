//! From a description to an image: scene, sensor, film and integrator are prepared, the film is cut into
//! tiles and the samples into passes, and (tile, pass) units are rendered in parallel and summed in a
//! fixed order, so that one seed gives one image.

mod bare;
mod options;
mod prepare;
mod progress;
mod sums;
mod unit;

use std::num::NonZeroUsize;
use std::time::{Duration, Instant};

use serde::Serialize;

use crate::color::{Bands, ColorModel, Rgb};
use crate::description::Description;
use crate::error::{Error, Problem, Result};
use crate::image::{Image, Metadata, Window};
use crate::integrator::Stats;

pub use bare::{UpAxis, describe_mesh, is_mesh};
pub use options::{Colors, Options, Overrides};
pub use progress::{Phase, Progress, Silent};

/// A rendered image and how it came about.
#[derive(Debug)]
pub struct Rendered {
    /// The crop of the film.
    pub image: Image,
    /// Where the crop lies on the film.
    pub window: Window,
    /// How the image was made, for the file.
    pub metadata: Metadata,
    /// What was done, counted and timed.
    pub report: Report,
    /// What the user should know.
    pub warnings: Vec<Problem>,
}

/// What a render did.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Pixels across and down.
    pub size: [u32; 2],
    /// Samples a pixel.
    pub spp: u32,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Threads used.
    pub threads: usize,
    /// Triangles and other primitives.
    pub primitives: u64,
    /// Lights.
    pub lights: usize,
    /// Bytes of geometry and of trees.
    pub bytes: [usize; 2],
    /// Rays, steps and tests.
    pub stats: Stats,
    /// Samples that were not finite and were dropped.
    pub dropped_samples: u64,
    /// One of their pixels.
    pub dropped_pixel: Option<[u32; 2]>,
    /// Seconds by phase.
    pub seconds: Seconds,
}

/// Wall-clock seconds by phase.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Seconds {
    /// Reading meshes.
    pub load: f64,
    /// Building trees, materials and lights.
    pub build: f64,
    /// Tracing and shading.
    pub render: f64,
}

/// Renders what `description` says. `description` has the options' overrides already: see
/// [`Overrides::apply`].
///
/// # Errors
/// Names everything that is wrong with the scene, unread properties included.
pub fn render(
    description: &Description,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Rendered> {
    let threads = options.threads.map_or(0, NonZeroUsize::get);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|e| Error::input(format!("cannot start {threads} threads: {e}")))?;
    pool.install(|| match options.colors {
        Colors::Rgb => render_as(description, options, Rgb, progress),
        Colors::Bands(n @ 1..=8) => render_bands::<8>(n, description, options, progress),
        Colors::Bands(n @ 9..=16) => render_bands::<16>(n, description, options, progress),
        Colors::Bands(n) => render_bands::<32>(n, description, options, progress),
    })
}

fn render_bands<const N: usize>(
    count: usize,
    description: &Description,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Rendered> {
    let bands = Bands::<N>::new(count)
        .ok_or_else(|| Error::input(format!("{count} bands; 1 to 32 are possible")))?;
    render_as(description, options, bands, progress)
}

fn render_as<C: ColorModel>(
    description: &Description,
    options: &Options,
    color: C,
    progress: &dyn Progress,
) -> Result<Rendered> {
    let mut seconds = Seconds::default();
    let assets = timed(&mut seconds.load, || prepare::load(description, progress))?;
    let job = timed(&mut seconds.build, || {
        prepare::prepare(description, &assets, options, color, progress)
    })?;
    let sums = timed(&mut seconds.render, || {
        unit::run(&job, options.seed, progress)
    });
    let mut report = job.report(options, &assets);
    report.seconds = seconds;
    report.stats = sums.stats;
    report.dropped_samples = sums.dropped;
    report.dropped_pixel = sums.dropped_pixel;
    let mut warnings = job.warnings.clone();
    warnings.extend(sums.warning());
    Ok(Rendered {
        image: sums.develop(&job.film)?,
        window: job.window(),
        metadata: job.metadata(&report),
        report,
        warnings,
    })
}

fn timed<T>(seconds: &mut f64, work: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = work();
    *seconds = start.elapsed().as_secs_f64();
    result
}

/// A duration as people say it: `4.2 s`, `3 min 20 s`.
pub fn human_duration(duration: Duration) -> String {
    match duration.as_secs() {
        0..60 => format!("{:.1} s", duration.as_secs_f64()),
        s @ 60..3600 => format!("{} min {} s", s / 60, s % 60),
        s => format!("{} h {} min", s / 3600, s % 3600 / 60),
    }
}
