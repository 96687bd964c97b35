//! A scene on both sides: both load it, then render the seeds in turns, so that neither has the machine while
//! the other works and what slows it for a while slows both. The side that begins changes with every seed.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use serde::Serialize;

use super::cost::{self, Cost};
use super::images::{self, Images, Pictures};
use super::order::{Order, Reply};
use super::process::Worker;
use super::{Failure, Settings, Side, Watch};
use crate::budget::Budget;
use crate::compare::Layer;
use crate::compare::seeds::Verdict;
use crate::description::{self, Description};
use crate::error::Error;

/// Mitsuba's side.
const WORKER: &str = include_str!("worker.py");
/// The values that are given, and those that follow from them here and do not in Mitsuba.
fn defines(scene: &Path, settings: &Settings) -> Vec<(String, String)> {
    let mut defines = settings.defines.clone();
    if !defines.is_empty() {
        let options = description::Options {
            defines: defines.clone(),
            ..description::Options::default()
        };
        // What is wrong with the scene is told by who renders it.
        if let Ok(read) = Description::read(scene, &options, &Budget::default()) {
            defines.extend_from_slice(read.implied());
        }
    }
    defines
}

/// What Mitsuba is taught of Étendue's plugins.
const PLUGINS: [(&str, &str); 3] = [
    ("ambient.py", include_str!("../../tools/mitsuba/ambient.py")),
    ("phong.py", include_str!("../../tools/mitsuba/phong.py")),
    ("shapes.py", include_str!("../../tools/mitsuba/shapes.py")),
];

/// A scene that both sides have rendered.
#[derive(Clone, Debug, Serialize)]
pub struct Crosscheck {
    /// Whether the images agree; absent where only times were asked for.
    pub verdict: Option<Verdict>,
    /// What was made, where it was asked for.
    #[serde(skip)]
    pub pictures: Option<Pictures>,
    /// Samples a pixel and seed.
    pub spp: u32,
    /// Renders a side.
    pub seeds: u32,
    /// What is not the same on both sides, or not as the scene has it.
    pub notes: Vec<String>,
    /// The Python that ran Mitsuba, and who named it.
    pub python: String,
    /// What Étendue took.
    pub etendue: Cost,
    /// What Mitsuba took.
    pub mitsuba: Cost,
    /// How many times as long Mitsuba takes to render a seed: the median over the seeds.
    pub seconds_ratio: Option<f64>,
    /// How many times as much of the processors Mitsuba takes: the median over the seeds.
    pub cpu_ratio: Option<f64>,
}

/// Renders the scene on both sides.
///
/// # Errors
/// Where one of the sides cannot render the scene, ends before its time or takes too long, where the images
/// have nothing in common, and where `watch` asks to stop.
pub fn crosscheck(
    scene: &Path,
    settings: &Settings,
    watch: &dyn Watch,
) -> Result<Crosscheck, Failure> {
    let folder = tempfile::Builder::new()
        .prefix("etendue-crosscheck-")
        .tempdir()
        .map_err(|e| Error::system("write in", &std::env::temp_dir(), &e))?;
    let plugins = match &settings.plugins {
        Some(plugins) => plugins.clone(),
        None => own_plugins(folder.path())?,
    };
    let overrides = &settings.overrides;
    let order = |scene: &Path| Order {
        scene: scene.to_owned(),
        defines: defines(scene, settings),
        strict: settings.strict,
        size: overrides.size,
        crop: overrides.crop.map(|w| [w.x, w.y, w.width, w.height]),
        spp: overrides.spp,
        shutter: overrides.shutter,
        sampler: overrides.sampler.clone(),
        integrator: overrides.integrator.clone(),
        max_depth: overrides.max_depth,
        sensor: settings.sensor.clone(),
        threads: settings.threads,
        bands: settings.bands,
        variant: settings.variant.clone(),
        plugins: plugins.clone(),
        own_plugins: settings.plugins.is_none(),
        folder: folder.path().to_owned(),
    };
    if let Some(folder) = &settings.keep {
        // Before the work, for it may be refused.
        fs::create_dir_all(folder).map_err(|e| Error::system("make", folder, &e))?;
    }
    let total = 2 * settings.seeds;
    watch.at(Side::Etendue, 0, total);
    let (program, arguments) = &settings.etendue;
    let mut command = Command::new(program);
    command.args(arguments);
    let etendue = Runner::start(Side::Etendue, command, &order(scene), settings, watch)?;
    watch.at(Side::Mitsuba, 0, total);
    let script = folder.path().join("worker.py");
    write(&script, WORKER)?;
    let mut command = Command::new(&settings.python.path);
    command.arg(&script);
    let other = order(settings.reference.as_deref().unwrap_or(scene));
    let mitsuba = Runner::start(Side::Mitsuba, command, &other, settings, watch);
    let mitsuba = mitsuba.map_err(|failure| match failure {
        Failure::Died { words, .. } if words.contains("No module named 'mitsuba'") => {
            Failure::NoMitsuba(settings.python.path.clone())
        }
        other => other,
    })?;

    let mut sides = [etendue, mitsuba];
    let mut images = Images::default();
    for i in 0..settings.seeds {
        let seed = settings.first_seed.wrapping_add(i.into());
        let mut layers = [None, None];
        let first = (i % 2) as usize;
        for (turn, side) in [first, 1 - first].into_iter().enumerate() {
            watch.at(sides[side].side, 2 * i + turn as u32, total);
            layers[side] = Some(sides[side].render(seed, settings, watch)?);
        }
        if let ([Some(ours), Some(theirs)], false) = (layers, settings.timing_only) {
            images.push(theirs, ours)?;
        }
    }
    let notes = notes(&sides);
    let spp = sides[0].spp;
    let [etendue, mitsuba] = sides.map(Runner::finish);
    let judged = !settings.timing_only;
    let verdict = judged.then(|| images.judge()).transpose()?;
    let wanted = judged && (settings.pictures || settings.keep.is_some());
    let mut pictures = wanted.then(|| images.pictures()).transpose()?;
    if let (Some(folder), Some(pictures)) = (&settings.keep, &pictures) {
        pictures.keep(folder)?;
    }
    if !settings.pictures {
        pictures = None;
    }
    Ok(Crosscheck {
        verdict,
        pictures,
        spp,
        seeds: settings.seeds,
        notes,
        python: settings.python.to_string(),
        seconds_ratio: cost::ratio(&mitsuba, &etendue, |t| Some(t.seconds)),
        cpu_ratio: cost::ratio(&mitsuba, &etendue, |t| t.cpu),
        etendue,
        mitsuba,
    })
}

/// Writes the plugins that Étendue has for Mitsuba to a folder in `folder`.
fn own_plugins(folder: &Path) -> Result<PathBuf, Failure> {
    let plugins = folder.join("plugins");
    fs::create_dir(&plugins).map_err(|e| Error::system("make", &plugins, &e))?;
    for (name, text) in PLUGINS {
        write(&plugins.join(name), text)?;
    }
    Ok(plugins)
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    fs::write(path, text).map_err(|e| Error::system("write", path, &e).into())
}

/// What was changed about the scene, and a difference that the scene does not have.
fn notes(sides: &[Runner; 2]) -> Vec<String> {
    let mut notes = Vec::new();
    for note in sides.iter().flat_map(|side| &side.notes) {
        if !notes.contains(note) {
            notes.push(note.clone());
        }
    }
    let [ours, theirs] = [0, 1].map(|i| sides[i].spp);
    if ours != theirs {
        notes.push(format!(
            "Étendue takes {ours} samples a pixel and Mitsuba {theirs}"
        ));
    }
    notes
}

/// A side at work.
#[derive(Debug)]
struct Runner {
    side: Side,
    worker: Worker,
    notes: Vec<String>,
    /// Samples a pixel; 0 before the first image.
    spp: u32,
    cost: Cost,
}

impl Runner {
    /// Starts a side and waits until it has loaded the scene.
    fn start(
        side: Side,
        command: Command,
        order: &Order,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Result<Self, Failure> {
        let begin = Instant::now();
        let mut worker = Worker::start(side, command)?;
        let loaded = match worker.ask(order, settings.timeout, watch)? {
            Reply::Loaded(loaded) => loaded,
            Reply::Refused(why) => return Err(Failure::NotComparable(why)),
            Reply::Rendered(_) => return Err(confused(side)),
        };
        let cost = Cost {
            renderer: loaded.renderer,
            start: begin.elapsed().as_secs_f64(),
            load: loaded.time,
            render: Vec::new(),
            peak_memory: None,
        };
        Ok(Self {
            side,
            worker,
            notes: loaded.notes,
            spp: 0,
            cost,
        })
    }

    /// Renders a seed.
    fn render(
        &mut self,
        seed: u64,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> Result<Layer, Failure> {
        let Reply::Rendered(rendered) = self.worker.ask(&seed, settings.timeout, watch)? else {
            return Err(confused(self.side));
        };
        self.cost.render.push(rendered.time);
        self.spp = rendered.spp;
        let layer = images::read(&rendered.image)?;
        // Read once: a thousand seeds need not lie on the disk together.
        let _ = fs::remove_file(&rendered.image);
        Ok(layer)
    }

    /// What it took; the end of the runner ends the worker.
    fn finish(mut self) -> Cost {
        self.cost.peak_memory = self.worker.peak_memory();
        self.cost
    }
}

fn confused(side: Side) -> Failure {
    Failure::Broken(format!("{side} answered what it was not asked"))
}
