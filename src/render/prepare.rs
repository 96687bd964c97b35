//! From a description to a job: the scene, and what it is looked at with. What is wrong is gathered over
//! all parts; properties that nobody read come last, for by then everybody has read.

use super::progress::{Phase, Progress};
use super::{Options, Report, Seconds};
use crate::color::ColorModel;
use crate::description::{Description, Kind, Properties};
use crate::error::{Error, Problem, Problems, Result};
use crate::image::{Metadata, Window};
use crate::integrator::{Integrator, Stats};
use crate::sampler::Sampler;
use crate::scene::{self, Assets, Scene};
use crate::sensor::{Film, Sensor};

/// Everything that a render needs.
#[derive(Debug)]
pub(super) struct Job<C: ColorModel> {
    pub(super) scene: Scene<C>,
    pub(super) sensor: Sensor,
    pub(super) film: Film,
    pub(super) sampler: Sampler,
    pub(super) integrator: Integrator<C>,
    pub(super) warnings: Vec<Problem>,
    /// The plugin's name, for the metadata.
    integrator_name: String,
    scene_name: String,
}

/// Loads the shapes.
pub(super) fn load(description: &Description, progress: &dyn Progress) -> Result<Assets> {
    progress.begin(
        Phase::Load,
        description.root().children(Kind::Shape).len() as u64,
    );
    Assets::load(description, &|| progress.advance(1, 0))
}

/// What stands in a sensor.
struct View {
    sensor: Sensor,
    film: Film,
    sampler: Sampler,
}

fn view(properties: &Properties<'_>) -> Result<View> {
    let film = match properties.children(Kind::Film).first() {
        Some(film) => Film::build(film)?,
        None => Film::default(),
    };
    let Some(sampler) = properties.children(Kind::Sampler).first().copied() else {
        return Err(properties.error("", "the sensor has no sampler"));
    };
    let sampler = Sampler::build(&sampler, &())?;
    Ok(View {
        sensor: Sensor::build(properties, &film)?,
        film,
        sampler,
    })
}

/// Builds the job.
pub(super) fn prepare<C: ColorModel>(
    description: &Description,
    assets: &Assets,
    options: &Options,
    color: C,
    progress: &dyn Progress,
) -> Result<Job<C>> {
    progress.begin(Phase::Build, 1);
    let root = description.root();
    let mut problems = Problems::default();
    let view = match root.children(Kind::Sensor).first() {
        Some(sensor) => problems.take(view(sensor)),
        None => {
            problems.push(
                Error::input("the scene has no sensor")
                    .at(root.location())
                    .help("add a <sensor> to see it through"),
            );
            None
        }
    };
    let (integrator, integrator_name) = match root.children(Kind::Integrator).first() {
        Some(child) => (
            problems.take(Integrator::build(child, &())),
            child.plugin().to_owned(),
        ),
        None => (Some(Integrator::default()), "path".to_owned()),
    };
    let scene = problems.take(scene::build(description, assets, color, options.method));
    let (
        Some(View {
            sensor,
            film,
            sampler,
        }),
        Some(integrator),
        Some(scene),
    ) = (view, integrator, scene)
    else {
        problems.finish()?;
        unreachable!("a part is missing, so there is a problem");
    };
    problems.extend(description.unread());
    problems.finish()?;
    progress.advance(1, 0);
    let mut warnings = description.warnings().to_vec();
    warnings.extend(assets.warnings().iter().cloned());
    let scene_name = options.scene.clone();
    Ok(Job {
        scene,
        sensor,
        film,
        sampler,
        integrator,
        warnings,
        integrator_name,
        scene_name,
    })
}

impl<C: ColorModel> Job<C> {
    /// The crop's place on the film.
    pub(super) fn window(&self) -> Window {
        let Film {
            width,
            height,
            crop,
            ..
        } = &self.film;
        Window {
            x: crop.x,
            y: crop.y,
            full_width: *width,
            full_height: *height,
        }
    }

    /// The report as far as it is known before rendering.
    pub(super) fn report(&self, options: &Options, assets: &Assets) -> Report {
        Report {
            size: [self.film.crop.width, self.film.crop.height],
            spp: self.sampler.sample_count(),
            seed: options.seed,
            threads: rayon::current_num_threads(),
            primitives: assets.primitive_count(),
            lights: self.scene.light_count(),
            bytes: [assets.bytes(), self.scene.tracer().tree_bytes()],
            stats: Stats::default(),
            dropped_samples: 0,
            dropped_pixel: None,
            seconds: Seconds::default(),
        }
    }

    /// How the image was made.
    pub(super) fn metadata(&self, report: &Report) -> Metadata {
        let to_camera = self.sensor.world_to_camera();
        Metadata::default()
            .with("software", concat!("etendue ", env!("CARGO_PKG_VERSION")))
            .with("scene", self.scene_name.as_str())
            .with("integrator", self.integrator_name.as_str())
            .with("spp", report.spp)
            .with("seed", i64::try_from(report.seed).unwrap_or(i64::MAX))
            .with("world_to_camera", to_camera)
            .with("world_to_ndc", self.sensor.projection() * to_camera)
    }
}
