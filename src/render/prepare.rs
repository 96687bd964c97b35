//! From a description to a job: the scene, and what it is looked at with. What is wrong is gathered over
//! all parts; properties that nobody declares come last. The scene is kept for
//! the next render, which may be of another view or frame.

use std::any::Any;
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use super::black;
use super::colors::Model;
use super::fingerprint::{self, Contents, Fingerprint};
use super::machine::machine;
use super::memory::{self, Estimate};
use super::options::Options;
use super::origin::{Origin, Outcome};
use super::plan::{Completed, Plan};
use super::plugins;
use super::progress::{Phase, Picture, Progress};
use super::rastered;
use super::{Report, Seconds, timed};
use crate::accel::{Build, CacheUse, Method, Recipe};
use crate::color::ColorModel;
use crate::description::{Description, Kind, NodeId};
use crate::error::{self, Error, Location, Problem, Problems, Result};
use crate::film::Layout;
use crate::image::{self, Image, Window};
use crate::integrator::{self, Estimator, Footprint, Integrator, Lens};
use crate::lanes::Kernel;
use crate::mesh::ReadMesh;
use crate::sampler::Sampler;
use crate::scene::{self, Assets, Scene};
use crate::sensor::{Coordinates, Film, Sensor};
use crate::shape::Bounds;

/// A scene in memory, and what it was made from.
#[derive(Debug)]
pub(super) struct Kept {
    key: Key,
    /// Stamps of the files that the scene's files name.
    stamps: String,
    /// A `Scene<C>`, where the key's colours say which `C`.
    scene: Box<dyn Any + Send>,
    facts: Facts,
    /// The time that it took, until a render has told it.
    pub(super) spent: Seconds,
}

/// What is in memory from one render to the next.
#[derive(Debug, Default)]
pub(super) struct Shelf {
    /// The last scene.
    pub(super) kept: Option<Kept>,
    /// A mesh of the next scene.
    pub(super) given: Option<ReadMesh>,
}

impl Kept {
    /// What it took has been told.
    pub(super) fn told(&mut self) {
        self.spent = Seconds::default();
        self.facts.cache = None;
    }
}

/// What two renders must agree in to share a scene.
#[derive(Clone, Debug, PartialEq)]
struct Key {
    scene: String,
    model: Model,
    method: Method,
    build: Option<Build>,
    kernel: Kernel,
    /// The shutter's times, where anything moves.
    shutter: Option<[u32; 2]>,
}

/// What is known of a scene beside the scene.
#[derive(Clone, Debug)]
pub(super) struct Facts {
    pub(super) primitives: u64,
    pub(super) instances: usize,
    pub(super) bounds: Bounds,
    /// Bytes of geometry and of trees.
    pub(super) bytes: [usize; 2],
    pub(super) warnings: Vec<Problem>,
    /// What the folder of trees was good for, until a render has told it.
    pub(super) cache: Option<CacheUse>,
    /// The files that were read because the scene's files name them.
    files: Vec<PathBuf>,
    /// What the scene's files hold, once it was asked for.
    contents: OnceLock<Contents>,
}

impl Facts {
    /// Of the files that the scene's files name.
    fn stamps(&self) -> String {
        fingerprint::stamps(&self.files)
    }
}

/// What a scene is looked at with.
#[derive(Debug)]
pub(super) struct View<C: ColorModel> {
    pub(super) sensor: Sensor,
    pub(super) film: Film,
    pub(super) sampler: Sampler,
    pub(super) integrator: Integrator<C>,
    /// The plugin's name, for the metadata.
    integrator_name: String,
    /// What the user should know of it.
    pub(super) warnings: Vec<Problem>,
}

/// Everything that a render needs.
#[derive(Debug)]
pub(super) struct Job<'k, C: ColorModel> {
    pub(super) scene: &'k Scene<C>,
    pub(super) facts: &'k Facts,
    pub(super) view: View<C>,
    pub(super) seed: u64,
    /// Which sensor is looked through, in file order from 0.
    pub(super) sensor: usize,
    /// What loading and building took, unless that was told before.
    pub(super) spent: Seconds,
    pub(super) warnings: Vec<Problem>,
}

/// The sensor that the options choose.
pub(super) fn sensor(description: &Description, options: &Options) -> Result<NodeId> {
    let root = description.root();
    let sensors = description.sensors();
    let chosen = sensors.get(options.sensor).copied();
    chosen.ok_or_else(|| {
        let message = match sensors.len() {
            0 => "the scene has no sensor".to_owned(),
            n => format!(
                "the scene has no sensor {}; they are numbered from 0 to {}",
                options.sensor,
                n - 1
            ),
        };
        let error = Error::input(message).at(root.location());
        match sensors.len() {
            0 => {
                error.help("add a <sensor type=\"perspective\"> with a to_world to see it through")
            }
            _ => error,
        }
    })
}

/// A sensor with what stands in it, and the integrator.
pub(super) fn view<C: ColorModel>(description: &Description, sensor: NodeId) -> Result<View<C>> {
    let mut problems = Problems::default();
    let properties = description.node(sensor);
    let film = match properties.child(Kind::Film)? {
        Some(film) => problems.take(Film::build(&film)),
        None => Some(Film::default()),
    };
    let sensor = film
        .as_ref()
        .and_then(|film| problems.take(Sensor::build(&properties, film)));
    let mut warnings = Vec::new();
    let sampler = match properties.child(Kind::Sampler)? {
        Some(child) => {
            let sampler = problems.take(Sampler::build(&child, &()));
            if let Some(sampler) = &sampler {
                warnings.extend(sampler.rounding(&child)?);
            }
            sampler
        }
        None => Some(Sampler::default()),
    };
    let context = integrator::Context {
        lights: scene::light_names(description),
        medium: properties
            .child(Kind::Medium)?
            .map(|medium| medium.node_id()),
        lens: sensor
            .as_ref()
            .zip(film.as_ref())
            .and_then(|(sensor, film)| Lens::new(sensor, film)),
        shutter: (sensor.as_ref())
            .map(|sensor| sensor.shutter())
            .unwrap_or_default(),
        unprojected: sensor
            .as_ref()
            .is_some_and(|sensor| !sensor.is_projective()),
        footprint: sensor
            .as_ref()
            .filter(|sensor| sensor.is_projective())
            .zip(film.as_ref())
            .zip(sampler.as_ref())
            .map(|((sensor, film), sampler)| {
                Footprint::new(sensor.clone(), film, sampler.sample_count())
            }),
    };
    let (integrator, integrator_name) = match description.root().child(Kind::Integrator)? {
        Some(child) => {
            let integrator = problems.take(Integrator::build(&child, &context));
            warnings.extend(problems.take(integrator::timeout_note(&child)).flatten());
            (integrator, child.plugin().to_owned())
        }
        None => (Some(Integrator::preset(&context)), "path".to_owned()),
    };
    problems.finish()?;
    if integrator.as_ref().is_some_and(|i| !i.renders_media()) {
        warnings.extend(media(description, &integrator_name));
    }
    let missing = "a part that is missing is a problem";
    Ok(View {
        sensor: sensor.expect(missing),
        film: film.expect(missing),
        sampler: sampler.expect(missing),
        integrator: integrator.expect(missing),
        integrator_name,
        warnings,
    })
}

/// The warning that an integrator does not render participating media, where a scene has any.
fn media(description: &Description, integrator: &str) -> Option<Problem> {
    let (mut seen, mut media) = (HashSet::new(), Vec::new());
    let mut shapes = description.root().children(Kind::Shape);
    while let Some(shape) = shapes.pop() {
        if seen.insert(shape.node_id()) {
            shapes.extend(shape.children(Kind::Shape));
            media.extend(shape.children(Kind::Medium));
        }
    }
    let first = media.iter().min_by_key(|medium| medium.node_id())?;
    let message = format!(
        "{integrator} does not render participating media: {} shapes count as empty",
        media.len()
    );
    let warning = Error::unsupported(message).at(first.location());
    let warning = warning.help("--integrator volpath does");
    warning.problems().first().cloned()
}

/// What is wrong with the sensors that are not `chosen`: all of a scene is checked, whoever looks at it. What Étendue
/// lacks there, and what the command line's values do to them, is nobody's concern but theirs who look through them.
fn others<C: ColorModel>(description: &Description, chosen: NodeId) -> Result<Vec<Problem>> {
    let mut problems = Problems::default();
    let mut warnings = Vec::new();
    let sensors = description.sensors();
    for sensor in sensors.into_iter().filter(|sensor| *sensor != chosen) {
        let Err(error) = view::<C>(description, sensor) else {
            continue;
        };
        for problem in error.problems() {
            match problem.kind {
                error::Kind::Unsupported => warnings.push(problem.clone()),
                _ if problem
                    .location
                    .as_ref()
                    .is_some_and(Location::is_command_line) => {}
                _ => problems.extend(vec![problem.clone()]),
            }
        }
    }
    problems.finish()?;
    Ok(warnings)
}

/// Loads the shapes but for the mesh that is `given`, with the folder `cache` for what takes long, and displaces those
/// that want it as far as the `limit` on bytes allows.
fn load(
    description: &Description,
    given: Option<ReadMesh>,
    cache: Option<&Path>,
    limit: Option<u64>,
    progress: &dyn Progress,
) -> Result<Assets> {
    let shapes = description.root().children(Kind::Shape).len();
    progress.begin(Phase::Load, shapes as u64);
    let mut assets = Assets::load(description, given, cache, &|| progress.advance(1, 0))?;
    assets.displace(description, limit.map(memory::triangles))?;
    Ok(assets)
}

/// What the view says of the work to come.
#[derive(Clone, Copy, Debug, Default)]
struct Share {
    /// Bytes of the film.
    film: u64,
    /// Bytes of what is learnt from photons.
    photons: u64,
    /// How many rays are to be expected.
    rays: u64,
    /// Their first and their last time.
    shutter: (f32, f32),
}

/// What is asked of a scene.
pub(super) struct Ask<'a> {
    pub(super) shelf: &'a mut Shelf,
    pub(super) description: &'a Description,
    pub(super) options: &'a Options,
    pub(super) progress: &'a dyn Progress,
    /// Whether rays will be traced; where the scene is merely looked over, no tree is built.
    pub(super) traced: bool,
}

impl<'a> Ask<'a> {
    /// For rays to be traced.
    pub(super) fn traced(
        shelf: &'a mut Shelf,
        description: &'a Description,
        options: &'a Options,
        progress: &'a dyn Progress,
    ) -> Self {
        Self {
            shelf,
            description,
            options,
            progress,
            traced: true,
        }
    }

    /// Whether a picture is to be shown before there is a tree.
    fn previews(&self) -> bool {
        self.options.preview && self.traced
    }

    /// Shows a picture by the z-buffer.
    fn preview<C: ColorModel>(&self, scene: &Scene<C>, view: &View<C>) -> Result<()> {
        let Some(image) = rastered::preview(scene, view, self.progress)? else {
            return Ok(()); // stopped
        };
        let origin = Origin {
            integrator: rastered::NAME.to_owned(),
            ..view.origin(&self.options.scene, self.options.seed, scene.color())
        };
        self.progress.picture(&Picture {
            image,
            window: view.window(),
            metadata: origin.metadata(&rastered::preview_outcome()),
        });
        Ok(())
    }

    /// How rays find shapes, if there are any.
    fn method(&self) -> Method {
        match self.traced {
            true => self.options.method,
            false => Method::Never,
        }
    }
}

/// How many rays a film of so many samples a pixel takes, as a rule: paths of three bounces that each ask
/// for light.
pub(super) fn rays(film: &Film, samples: u32) -> u64 {
    const A_SAMPLE: u64 = 6;
    let pixels = u64::from(film.crop.width) * u64::from(film.crop.height);
    pixels.saturating_mul(u64::from(samples) * A_SAMPLE)
}

/// Loads the shapes and builds the scene, having made sure that there is room for it.
fn make<C: ColorModel>(
    ask: &Ask<'_>,
    given: Option<ReadMesh>,
    color: C,
    view: Option<&View<C>>,
    Share {
        film,
        photons,
        rays,
        shutter,
    }: Share,
) -> Result<(Scene<C>, Facts, Seconds)> {
    let Ask {
        description,
        options,
        progress,
        ..
    } = *ask;
    let mut seconds = Seconds::default();
    let announced = Estimate {
        film,
        photons,
        ..Estimate::of_files(description)
    };
    let budget = description.budget();
    announced.check(budget.limit())?;
    let of_given = given.as_ref().map_or(0, |given| given.loaded.mesh.room());
    budget.begin(film.saturating_add(photons).saturating_add(of_given));
    let assets = timed(&mut seconds.load, || {
        let others = film.saturating_add(photons);
        let limit = (budget.limit()).map(|limit| limit.saturating_sub(others));
        load(
            description,
            given,
            options.cache.as_deref(),
            limit,
            progress,
        )
    })
    .map_err(|error| {
        // What is wrong with materials is told along with what is wrong with shapes.
        let mut problems = Problems::default();
        problems.push(error);
        problems.take(scene::check_materials(description, color.clone()));
        problems.finish().expect_err("shapes have problems")
    })?;
    let primitives = assets.primitive_count();
    let loaded = Estimate {
        film,
        photons,
        assets: assets.bytes() as u64,
        trees: match options.method {
            Method::Brute | Method::Exhaustive | Method::Never => 0,
            // An instance stands in the world's tree like a primitive.
            Method::Tree => memory::trees(primitives + assets.instance_count()),
        },
    };
    loaded.check(budget.limit())?;
    // What textures take is added to it.
    budget.begin(loaded.total());
    let scene = timed(&mut seconds.build, || {
        progress.begin(Phase::Build, 1);
        let build = (options.build).unwrap_or_else(|| Build::suited(primitives, rays));
        let recipe = Recipe {
            method: ask.method(),
            build,
            cache: options.cache.clone(),
            shutter,
            kernel: options.kernel,
        };
        let Some(view) = view.filter(|_| ask.previews()) else {
            return scene::build(description, &assets, color, recipe);
        };
        let treeless = Recipe {
            method: Method::Never,
            ..recipe.clone()
        };
        let scene = scene::build(description, &assets, color, treeless)?;
        ask.preview(&scene, view)?;
        Ok(scene.rebuilt(recipe))
    })?;
    progress.advance(1, 0);
    let cache = scene.tracer().cache_use().clone();
    let warnings = (assets.warnings().iter())
        .chain(scene.warnings())
        .chain(&cache.problems);
    let facts = Facts {
        primitives,
        instances: scene.tracer().instance_count(),
        bounds: scene.tracer().bounds(),
        bytes: [assets.bytes(), scene.tracer().tree_bytes()],
        warnings: warnings.cloned().collect(),
        cache: options.cache.as_ref().map(|_| cache),
        files: assets.files().to_vec(),
        contents: OnceLock::new(),
    };
    Ok((scene, facts, seconds))
}

/// Builds the job; what is kept is its scene where the description's is equal, else it makes room for the new one.
pub(super) fn prepare<'k, C: ColorModel>(ask: &'k mut Ask<'_>, color: C) -> Result<Job<'k, C>> {
    let (description, options) = (ask.description, ask.options);
    let given = ask.shelf.given.take();
    let mut problems = Problems::default();
    let sensor = problems.take(sensor(description, options));
    let view = sensor.and_then(|sensor| problems.take(view::<C>(description, sensor)));
    let view = view.filter(|view| {
        let layout = layout(&color, &view.integrator);
        problems.take(light_anywhere(
            options,
            &view.integrator,
            &view.integrator_name,
        ));
        let fit = image::check_channels(&written(&view.film, &layout))
            .map_err(|error| integrator_at(description, error));
        problems.take(fit).is_some()
    });
    let share = view.as_ref().map(|view| Share {
        film: memory::film(
            &view.film,
            layout(&color, &view.integrator).stride(),
            options.by_blocks(),
        ),
        photons: view.integrator.photon_bytes(),
        rays: rays(&view.film, view.sampler.sample_count()),
        shutter: view.sensor.shutter(),
    });
    let share = share.unwrap_or_default();
    let Share { film, photons, .. } = share;
    let key = Key {
        scene: fingerprint::scene_key(description),
        model: Model::of(description, options)?,
        method: ask.method(),
        build: options.build,
        kernel: options.kernel,
        shutter: description
            .has_motion()
            .then(|| [share.shutter.0, share.shutter.1].map(f32::to_bits)),
    };
    let fresh = |kept: &Kept| kept.key == key && kept.stamps == kept.facts.stamps();
    let is_kept = ask.shelf.kept.as_ref().is_some_and(fresh);
    if !is_kept {
        ask.shelf.kept = None;
        let others = sensor.map(|sensor| others::<C>(description, sensor));
        let others = others.and_then(|others| problems.take(others));
        let made = problems.take(make(ask, given, color, view.as_ref(), share));
        ask.shelf.kept = made.map(|(scene, mut facts, spent)| {
            facts.warnings.extend(others.unwrap_or_default());
            Kept {
                key,
                stamps: facts.stamps(),
                scene: Box::new(scene),
                facts,
                spent,
            }
        });
    }
    let findings = plugins::examine(description);
    problems.extend(findings.problems);
    problems.finish()?;
    let (Some(mut view), Some(kept)) = (view, ask.shelf.kept.as_ref()) else {
        unreachable!("a part that is missing is a problem");
    };
    let facts = &kept.facts;
    let (assets, trees) = (facts.bytes[0] as u64, facts.bytes[1] as u64);
    Estimate {
        film,
        assets,
        trees,
        photons,
    }
    .check(description.budget().limit())?;
    let scene: &Scene<C> = kept
        .scene
        .downcast_ref()
        .expect("equal colours have equal types");
    view.sensor.enclose(scene.tracer().bounds());
    if is_kept && ask.previews() {
        ask.preview(scene, &view)?;
    }
    let mut warnings = description.warnings().to_vec();
    warnings.extend(findings.notes);
    warnings.extend(facts.warnings.iter().cloned());
    warnings.extend(view.warnings.iter().cloned());
    if let Some(message) = view.integrator.leaves_out(scene) {
        let warning = Error::unsupported(message).help("--integrator bdpt or path sees them");
        warnings.extend_from_slice(integrator_at(description, warning).problems());
    }
    warnings.extend(black::no_light(description, scene.light_count()));
    let mut spent = kept.spent;
    if ask.traced && photons > 0 {
        let mut seconds = 0.0;
        timed(&mut seconds, || view.integrator.prepare(scene));
        spent.build += seconds;
    }
    Ok(Job {
        scene,
        facts,
        view,
        seed: options.seed,
        sensor: options.sensor,
        spent,
        warnings,
    })
}

/// The error, where the integrator stands.
fn integrator_at(description: &Description, error: Error) -> Error {
    match description.root().children(Kind::Integrator).first() {
        Some(integrator) => error.at(integrator.location()),
        None => error,
    }
}

/// The names of the channels that stand beside each other: those of samples, without the red, green and blue that a film
/// does not write where its own channels are called so.
fn written(film: &Film, layout: &Layout) -> Vec<String> {
    match film.pixel_format.colors {
        Coordinates::None => layout.names()[layout.others()].to_vec(),
        _ => layout.names().to_vec(),
    }
}

/// Light that comes to the whole film does not become more where more samples are.
fn light_anywhere<C: ColorModel>(
    options: &Options,
    integrator: &Integrator<C>,
    name: &str,
) -> Result<()> {
    if !integrator.traces_light() || !options.by_blocks() {
        return Ok(());
    }
    let (how, option) = match options.gaze {
        Some(_) => ("by a gaze", "--foveate"),
        None => ("adaptively", "--noise-threshold"),
    };
    let message = format!("light of {name} comes to the whole film, and is not sampled {how}");
    let help = format!("leave out {option}, or take --integrator path");
    Err(Error::input(message).help(help))
}

/// The channels of samples.
pub(super) fn layout<C: ColorModel>(color: &C, integrator: &Integrator<C>) -> Layout {
    Layout::new(color.channels(), integrator.extra_channels())
        .with_splats(integrator.traces_light())
}

impl<C: ColorModel> Job<'_, C> {
    /// The channels of samples.
    pub(super) fn layout(&self) -> Layout {
        layout(self.scene.color(), &self.view.integrator)
    }

    /// The units of so many samples a pixel.
    pub(super) fn plan(&self, spp: u32) -> Plan {
        match self.view.integrator.traces_light() {
            true => Plan::whole(&self.view.film, spp),
            false => Plan::new(&self.view.film, spp),
        }
    }

    /// What the image depends on; the scene's files are read for it once.
    pub(super) fn fingerprint(
        &self,
        description: &Description,
        options: &Options,
    ) -> Result<Fingerprint> {
        let known = &self.facts.contents;
        let contents = match known.get() {
            Some(contents) => contents,
            None => {
                let contents = Contents::read(description, &self.facts.files)?;
                known.get_or_init(|| contents)
            }
        };
        let sensor = sensor(description, options)?;
        Fingerprint::new(description, sensor, contents, options)
    }

    /// The crop's place on the film.
    pub(super) fn window(&self) -> Window {
        self.view.window()
    }

    /// The report, but for what rendering counted.
    pub(super) fn report(&self, completed: Completed, seconds: Seconds) -> Report {
        let crop = &self.view.film.crop;
        Report {
            size: [crop.width, crop.height],
            spp: self.view.sampler.sample_count(),
            adaptive: None,
            foveated: None,
            passes: None,
            completed,
            seed: self.seed,
            threads: rayon::current_num_threads(),
            primitives: self.facts.primitives,
            lights: self.scene.light_count(),
            bytes: self.facts.bytes,
            cache: self.facts.cache.clone(),
            stats: Default::default(),
            dropped_samples: 0,
            dropped_pixel: None,
            seconds,
        }
    }

    /// The image of a render that goes on.
    pub(super) fn picture(&self, scene: &str, image: Image, outcome: &Outcome<'_>) -> Picture {
        Picture {
            image,
            window: self.window(),
            metadata: self.origin(scene).metadata(outcome),
        }
    }

    /// What the image is of.
    pub(super) fn origin(&self, scene: &str) -> Origin {
        self.view.origin(scene, self.seed, self.scene.color())
    }
}

impl<C: ColorModel> View<C> {
    /// The crop's place on the film.
    fn window(&self) -> Window {
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

    /// What the image is of.
    fn origin(&self, scene: &str, seed: u64, color: &C) -> Origin {
        let Self { sensor, .. } = self;
        let to_camera = sensor.world_to_camera(sensor.shutter().0);
        Origin {
            scene: scene.to_owned(),
            integrator: self.integrator_name.clone(),
            seed,
            machine: machine(),
            world_to_camera: to_camera.to_cols_array(),
            world_to_ndc: (sensor.projection() * to_camera).to_cols_array(),
            spectral: (color.channels().iter()).any(|name| name.starts_with("S0.")),
        }
    }
}
