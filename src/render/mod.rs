//! From a description to an image: scene, sensor, film and integrator are prepared, the film is cut into
//! tiles and the samples into passes, and (tile, pass) units are rendered in parallel and summed in a
//! fixed order, so that one seed gives one image.

mod options;
mod progress;

mod adaptive;
mod bare;
mod black;
mod check;
mod checkpoint;
mod colors;
mod fingerprint;
mod foveated;
mod hashing;
mod heat;
mod info;
mod machine;
mod memory;
mod merge;
mod named;
mod oracle;
mod origin;
mod outline;
mod part;
mod pinned;
mod plan;
mod plugins;
mod prepare;
mod provenance;
mod rastered;
mod rounds;
mod samples;
mod sensors;
mod session;
mod uniform;
mod unit;

use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use crate::accel::CacheUse;
use crate::description::Description;
use crate::error::{Problem, Result};
use crate::image::{Image, Metadata, Window};
use crate::integrator::Stats;

pub use adaptive::AdaptiveReport;
pub use bare::{
    Background, BareMesh, Finish, Framing, Lighting, Staging, UpAxis, describe_mesh, is_mesh,
};
pub use foveated::FoveatedReport;
pub use heat::Heat;
pub use info::{MotionInfo, NamedFile, SceneInfo, SensorInfo};
pub use machine::machine;
pub use memory::check_mesh;
pub use merge::{MergeReport, Merged, merge};
pub use options::{Adaptive, Checkpoint, Colors, Options, Overrides};
pub use outline::{Outline, outline};
pub use part::{Passes, check_part_writable, is_part};
pub(crate) use pinned::pin;
pub use plan::Completed;
pub use plugins::{Listed, plugins};
pub use progress::{Phase, Picture, Progress, Silent};
pub use provenance::{Provenance, is_current};
pub use sensors::{find_sensor, sensor_names, sensors};
pub use session::Session;

/// A rendered image and how it came about.
#[derive(Debug)]
pub struct Rendered {
    /// The crop of the film.
    pub image: Image,
    /// Where the crop lies on the film.
    pub window: Window,
    /// How the image was made, for the file.
    pub metadata: Metadata,
    /// What it was made of, where that is asked for and it is whole.
    pub provenance: Option<Provenance>,
    /// What was done, counted and timed.
    pub report: Report,
    /// What the user should know.
    pub warnings: Vec<Problem>,
}

/// A part of an image that was rendered.
#[derive(Debug)]
pub struct Parted {
    /// What was done, counted and timed.
    pub report: Report,
    /// What the user should know.
    pub warnings: Vec<Problem>,
}

/// What a render did.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Pixels across and down.
    #[serde(serialize_with = "named::size")]
    pub size: [u32; 2],
    /// Samples a pixel; on average where not all pixels get the same number.
    pub spp: u32,
    /// Where samples went, if sampling is adaptive.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adaptive: Option<AdaptiveReport>,
    /// Where samples went, if they go by the distance from a gaze.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub foveated: Option<FoveatedReport>,
    /// Which passes over the film, where it is a part of the image.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub passes: Option<std::ops::Range<u32>>,
    /// How much of it is done: all, unless the render was stopped.
    pub completed: Completed,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Threads used.
    pub threads: usize,
    /// Triangles and other primitives.
    pub primitives: u64,
    /// Lights.
    pub lights: usize,
    /// Bytes of geometry and of trees.
    #[serde(serialize_with = "named::bytes")]
    pub bytes: [usize; 2],
    /// What the folder of trees was good for, if there is one and the scene was not in memory.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cache: Option<CacheUse>,
    /// Rays, steps and tests.
    pub stats: Stats,
    /// Samples that were not finite and were dropped.
    pub dropped_samples: u64,
    /// One of their pixels.
    #[serde(serialize_with = "named::pixel")]
    pub dropped_pixel: Option<[u32; 2]>,
    /// Seconds by phase. What a session had in memory took none, and a resumed render all of its runs.
    pub seconds: Seconds,
}

/// Wall-clock seconds by phase.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Seconds {
    /// Reading meshes.
    pub load: f64,
    /// Building trees, materials and lights.
    pub build: f64,
    /// Tracing and shading.
    pub render: f64,
    /// Of rendering, the seconds of all threads in the tracer, for camera rays and bounces.
    pub closest: f64,
    /// And for shadow rays.
    pub occluded: f64,
    /// Of rendering, the seconds of all threads in cameras, materials and lights.
    pub shade: f64,
    /// Of rendering, the seconds of all threads in making pixels of samples.
    pub film: f64,
}

impl Seconds {
    /// Adds another render's.
    pub fn add(&mut self, other: &Self) {
        self.load += other.load;
        self.build += other.build;
        self.render += other.render;
        self.closest += other.closest;
        self.occluded += other.occluded;
        self.shade += other.shade;
        self.film += other.film;
    }

    /// A part of them: the mean of so many renders where they are a sum.
    #[must_use]
    pub fn divided(&self, by: f64) -> Self {
        Self {
            load: self.load / by,
            build: self.build / by,
            render: self.render / by,
            closest: self.closest / by,
            occluded: self.occluded / by,
            shade: self.shade / by,
            film: self.film / by,
        }
    }

    fn spend(&mut self, times: &crate::film::Times) {
        self.closest = times.closest;
        self.occluded = times.occluded;
        self.shade = times.shade;
        self.film = times.film;
    }
}

/// Renders a single image: see [`Session::render`].
///
/// # Errors
/// As [`Session::render`].
pub fn render(
    description: &Description,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Rendered> {
    Session::default().render(description, options, progress)
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
