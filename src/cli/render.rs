//! `etendue render`: scenes or bare meshes to images.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use etendue::accel::{Build, Method};
use etendue::budget::Budget;
use etendue::compare::map::{Map, Scale, robust_top};
use etendue::denoise::Denoiser;
use etendue::description::{self, Description};
use etendue::display;
use etendue::error::{Error, Problem, Result};
use etendue::image;
use etendue::lanes::Kernel;
use etendue::mesh::{GltfAnimation, read_gltf_animation};
use etendue::render::{
    Adaptive, Checkpoint, Framing, Options, Outline, Overrides, Passes, Picture, Progress,
    Rendered, Session, Staging, is_current, is_mesh, is_part, outline, sensors,
};
use glam::DVec3;
use serde_json::json;

use super::denoise::{self, DenoiseArguments};
use super::display::DisplayArguments;
use super::images::{Images, Item, Request};
use super::memory::{RUN, RunArguments};
use super::output::Names;
use super::overrides::{IMAGE, ImageArguments};
use super::parse::{self, Frames};
use super::progress::{self, Take, Takers, Told, Voice, Watch};
use super::scene::{Described, SceneArguments, describe};
use super::staging::StagingArguments;
use super::stereo::Eye;
use super::stop::Stop;
use super::summary::{self, Ending, Style};
use super::tev::Viewer;
use super::turntable::{self, Orbit};
use super::{output, report, status};

/// Render scenes or meshes to images
///
/// INPUT is a Mitsuba 3 scene (.xml), a bare mesh (.ply, .obj, .stl, .serialized, .gltf, .glb), which gets an automatic
/// camera on a ground under a soft sky, or a folder of these. The extension of OUT says the format: .exr (linear, float32, with metadata and
/// all channels), .hdr (linear), .png or .tif (sRGB), or .part: the sums that `etendue merge` makes images of.
///
/// Ctrl-C, SIGTERM and SIGHUP end a render early: the tiles under way are finished and the image of what
/// is complete is written. A second signal ends the process at once.
#[derive(Args, Debug)]
#[command(after_help = format!("{EXAMPLES}\n\n{}", status::HELP))]
pub(super) struct Arguments {
    /// Scenes (.xml), meshes (.ply, .obj, .stl, .serialized, .gltf, .glb) or folders of them
    #[arg(required = true, value_name = "INPUT")]
    inputs: Vec<PathBuf>,
    /// Where the image goes; a folder is OUT/{name}.png. {name} stands for the input's name, {frame} or {frame:04} for the frame's
    /// number, {sensor} for the sensor's id or number, {eye} for left or right
    #[arg(short, long, value_name = "OUT")]
    output: String,
    #[command(flatten)]
    scene: SceneArguments,

    #[command(flatten)]
    image: ImageArguments,
    #[command(flatten)]
    display: DisplayArguments,
    #[command(flatten)]
    denoising: DenoiseArguments,
    #[command(flatten)]
    staging: StagingArguments,
    /// Seed of the random numbers: one seed, one image
    #[arg(long, default_value_t = 0, value_name = "N", help_heading = IMAGE)]
    seed: u64,

    /// Give each part of the image as many samples as its noise asks for: none is noisier than T, the standard
    /// error of a pixel's luminance L divided by the square root of L. EXR gets the channels "samples" and "error"
    #[arg(long, value_name = "T", value_parser = parse::positive, conflicts_with = "spp", help_heading = ADAPTIVE)]
    noise_threshold: Option<f64>,
    /// The fewest samples a pixel, by default 32 or --max-spp; more where the sampler's sets are larger
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 24), requires = "noise_threshold", help_heading = ADAPTIVE)]
    min_spp: Option<u32>,
    /// The most samples a pixel; more where the sampler's sets are larger
    #[arg(long, default_value_t = 1024, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1 << 24), requires = "noise_threshold", help_heading = ADAPTIVE)]
    max_spp: u32,
    /// Take samples as the eye sees that looks at this place, in pixels of the whole film from its upper left corner: all of
    /// --spp there, and fewer away from it, as acuity falls with the angle to the gaze (by the camera's field of view; of an
    /// image without one, as if seen from three times its height). EXR gets the channel "samples"
    #[arg(long, value_name = "X,Y", value_parser = parse::place, conflicts_with = "noise_threshold", help_heading = ADAPTIVE)]
    foveate: Option<[f64; 2]>,

    /// Render frames START up to, and without, END; each defines $frame. A bare glTF file's animation is seen at the
    /// frame's number divided by --fps; a scene's <animation> is seen where the shutter is open (--shutter 0: sharp)
    #[arg(long, value_name = "START:END[:STEP]", value_parser = parse::frames, allow_hyphen_values = true, help_heading = SERIES)]
    frames: Option<Frames>,
    /// Let the camera go around the scene in N frames, all of them unless --frames says which
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000), help_heading = SERIES)]
    turntable: Option<u32>,
    /// The point that --turntable goes around, instead of the one that the camera looks at (the target of its lookat,
    /// or the scene's centre)
    #[arg(long, value_name = "X,Y,Z", value_parser = parse::point, allow_hyphen_values = true, requires = "turntable", help_heading = SERIES)]
    pivot: Option<DVec3>,
    /// Look at the scene with two eyes that are so far apart, in units of the scene: two images, of which {eye} in OUT says
    /// which. The camera is moved by half of that to the left and to the right along its own horizontal axis, and both eyes
    /// look the same way: their axes are parallel
    #[arg(long, value_name = "IOD", value_parser = parse::positive, help_heading = SERIES)]
    stereo: Option<f64>,
    /// Only what this eye sees
    #[arg(long, value_enum, value_name = "left|right", requires = "stereo", help_heading = SERIES)]
    eye: Option<Eye>,
    /// Leave out images whose file is there, unless a checkpoint lies beside it
    #[arg(long, help_heading = SERIES)]
    skip_existing: bool,
    /// Write OUT.fingerprint beside each image, which says what it was made of, and leave out what is there, undamaged, of
    /// the same scene, files, settings and version. A part says it itself
    #[arg(long, conflicts_with = "skip_existing", help_heading = SERIES)]
    skip_same: bool,

    /// Render only these passes, into a .part file that `etendue merge` puts together with the others: the first has
    /// one sample a pixel, the second 15, each that follows 16. Of adaptive sampling the first is the pilots
    #[arg(long, value_name = "FIRST:END", value_parser = parse::passes, help_heading = SERIES)]
    passes: Option<Passes>,

    /// Stop an image after so many seconds, and write what is complete
    #[arg(long, value_name = "SECONDS", value_parser = parse::seconds, help_heading = RUN)]
    time_limit: Option<Duration>,
    /// Keep what is done in OUT.checkpoint, every so many seconds and when stopped; it is removed in the end
    #[arg(long, value_name = "SECONDS", value_parser = parse::seconds, help_heading = RUN)]
    checkpoint: Option<Duration>,
    /// Go on from OUT.checkpoint where it is there, to the same image as without interruption
    #[arg(long, help_heading = RUN)]
    resume: bool,
    /// Write the image as it stands every so many seconds; the signal SIGUSR1 asks for it too
    #[arg(long, value_name = "SECONDS", value_parser = parse::interval, help_heading = RUN)]
    snapshot: Option<Duration>,
    /// First write a picture by the z-buffer, within moments and before there is a tree: with direct light alone, shadows
    /// by maps and nothing blurred. The image as asked for takes its place when it is done
    #[arg(long, help_heading = RUN)]
    preview: bool,
    /// Show each image while it is rendered in the viewer tev (https://github.com/Tom94/tev) that listens there, by itself at
    /// 127.0.0.1:14158: linear and with all channels, under the name of its file
    #[arg(long, value_name = "HOST:PORT", value_parser = parse::address, help_heading = RUN)]
    tev: Option<String>,
    #[command(flatten)]
    run: RunArguments,
    /// How rays find shapes; the image is the same
    #[arg(long, value_enum, default_value_t = Accel::Tree, help_heading = RUN)]
    accel: Accel,
    /// How much work goes into the tree, before rays are traced the faster; by default what suits the
    /// triangles and the rays to be expected. The image is the same
    #[arg(long, value_enum, value_name = "WORK", help_heading = RUN)]
    build: Option<Work>,
    /// Keep trees (60 to 75 bytes a triangle) and the normals of large meshes (12 bytes a vertex) in this folder, and
    /// read from there what was made before for the same triangles. Each is checked; the image is the same
    #[arg(long, value_name = "DIR", help_heading = RUN)]
    cache: Option<PathBuf>,

    /// No progress, no summary, no warnings
    #[arg(short, long, help_heading = TELL)]
    quiet: bool,
    /// How progress is told on standard error
    #[arg(long, value_enum, value_name = "HOW", default_value_t = Told::Auto, help_heading = TELL)]
    progress: Told,
    /// Print a JSON object for each image: size, counts, seconds
    #[arg(long, help_heading = TELL)]
    json: bool,
    /// Print what was counted and timed
    #[arg(long, help_heading = TELL)]
    stats: bool,
    /// Draw how many nodes of the trees the rays of each pixel enter, a sample (with --foveate in all of the pixel's), as a
    /// picture with a legend. Up to 16 samples of each pixel are traced once more for it. Names as for OUT
    #[arg(long, value_name = "OUT.png", help_heading = TELL)]
    heatmap: Option<String>,
}

const ADAPTIVE: &str = "Adaptive sampling";
const SERIES: &str = "Series of images";
const TELL: &str = "What is told";

const EXAMPLES: &str = "\
Examples:
  etendue render scenes/cornell-box.xml -o cornell-box.png
  etendue render dragon.ply -o dragon.png --size 1920x1080 --spp 256
  etendue render a.xml b.xml -o out/{name}.exr --seed 7
  etendue render meshes/ -o out/
  etendue render scene.xml -o crop.exr --crop 100,80,64,64 --max-depth 2 -D spp=16
  etendue render dragon.ply -o out/{frame:03}.png --turntable 36
  etendue render room.xml -o room-{eye}.exr --stereo 0.065
  etendue render walk.xml -o out/{frame:04}.exr --frames 0:240 -D body=body-{frame:04}.ply
  etendue render room.xml -o room.exr --noise-threshold 0.01 --sampler sobol
  etendue render room.xml -o room.exr --spp 64 --foveate 320,180 --heatmap work.png
  etendue render big.xml -o big.exr --checkpoint 300 --resume
  etendue render big.xml -o big.png --preview
  etendue render big.xml -o big.exr --tev 127.0.0.1:14158
  etendue render terrain.ply -o terrain.png --cache ~/.cache/etendue
  etendue render dragon.ply -o dragon.png --stats --heatmap steps.png
  etendue render room.xml -o room.png --exposure auto --view agx
  etendue render room.xml -o room.png --spp 16 --denoise
  etendue render part.stl -o part.png --material metal --azimuth -60 --background transparent
  etendue render scan.ply -o scan.png --light sun --write-scene scan.xml";

/// How rays find shapes.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Accel {
    /// Test every shape
    Brute,
    /// A bounding volume hierarchy
    Tree,
}

/// How much work goes into the tree.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Work {
    /// The least: rays are a fifth slower
    Quick,
    /// Twice as much
    Fast,
    /// Rays are a few percent faster
    Medium,
    /// A few percent more, for several times the work again
    Slow,
}

impl Arguments {
    pub(super) fn options(&self, item: &Item) -> Options {
        let checkpoint = Checkpoint {
            path: item.checkpoint(),
            every: self.checkpoint,
            resume: self.resume,
        };
        Options {
            scene: item.input.display().to_string(),
            seed: self.seed,
            threads: self.run.threads,
            colors: self.image.colors(),
            adaptive: self.noise_threshold.map(|noise_threshold| Adaptive {
                noise_threshold,
                min_spp: self.min_spp.unwrap_or(32).min(self.max_spp),
                max_spp: self.max_spp,
            }),
            gaze: self.foveate,
            method: match self.accel {
                Accel::Brute => Method::Brute,
                Accel::Tree => Method::Tree,
            },
            kernel: Kernel::default(),
            build: self.build.map(|work| match work {
                Work::Quick => Build::Quick,
                Work::Fast => Build::Fast,
                Work::Medium => Build::Medium,
                Work::Slow => Build::Slow,
            }),
            cache: self.cache.clone(),
            sensor: item.sensor,
            pinned: false,
            recorded: self.skip_same,
            preview: self.preview,
            checkpoint: (self.checkpoint.is_some() || self.resume).then_some(checkpoint),
        }
    }

    /// What is written into a description.
    fn overrides(&self) -> Overrides {
        Overrides {
            denoise: self.denoising.denoise,
            ..self.image.overrides()
        }
    }

    /// Refuses what cannot go together.
    fn check(&self) -> Result<()> {
        if let Some(least) = self.min_spp.filter(|least| *least > self.max_spp) {
            let message = format!("--min-spp {least} is more than --max-spp {}", self.max_spp);
            return Err(Error::input(message));
        }
        let of_whole = [
            (self.time_limit.is_some(), "--time-limit"),
            (self.checkpoint.is_some(), "--checkpoint"),
            (self.resume, "--resume"),
            (self.heatmap.is_some(), "--heatmap"),
            (self.snapshot.is_some(), "--snapshot"),
            (self.preview, "--preview"),
            (self.tev.is_some(), "--tev"),
            (self.denoising.denoise, "--denoise"),
            (self.foveate.is_some(), "--foveate"),
        ];
        let is_part = is_part(Path::new(&self.output));
        match of_whole.into_iter().find(|(given, _)| *given) {
            Some((_, option)) if is_part => {
                let message = format!("{option} is for images, and {} is a part", self.output);
                Err(Error::input(message)
                    .help("a part is whole or not there: make it smaller by --crop or --passes"))
            }
            _ if self.passes.is_some() && !is_part => {
                let message = format!(
                    "--passes makes a part of an image, and {} is an image",
                    self.output
                );
                Err(Error::input(message)
                    .help("name the output .part, and give all parts to etendue merge"))
            }
            _ => Ok(()),
        }
    }

    fn style(&self) -> Style {
        Style {
            quiet: self.quiet,
            json: self.json,
            stats: self.stats,
        }
    }

    /// How warnings are told.
    fn voice(&self) -> Voice {
        Voice {
            told: self.told(),
            quiet: self.quiet,
        }
    }

    fn skips(&self, item: &Item) -> bool {
        self.skip_existing && item.output.exists() && !item.checkpoint().exists()
    }

    /// How progress is told.
    fn told(&self) -> Told {
        self.progress.unless(self.quiet)
    }

    /// The images of this call.
    pub(super) fn images(&self, budget: &Budget) -> Result<Images> {
        let request = Request {
            inputs: &self.inputs,
            frames: self.frames.or(self.turntable.map(Frames::first)),
            sensors: self.image.sensors(),
            eyes: match (self.stereo, &self.eye) {
                (None, _) => &[],
                (Some(_), None) => &[Eye::Left, Eye::Right],
                (Some(_), Some(eye)) => std::slice::from_ref(eye),
            },
            output: &self.output,
            heatmap: self.heatmap.as_deref(),
            scene: &self.scene,
            budget,
        };
        request.images()
    }
}

/// Runs the command; the answer is the exit status.
pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    arguments.check()?;
    let stop = Stop::on_signals()?;
    stop.hear_wishes()?;
    let voice = arguments.voice();
    let viewer = (arguments.tev.as_ref()).map(|address| Viewer::connect(address, voice));
    let viewer = viewer.transpose()?;
    let budget = arguments.run.memory.budget_until(&stop);
    let Images { items, failed } = arguments.images(&budget)?;
    let files = (items.iter()).flat_map(|i| i.files().map(|file| (file, i.name())));
    let help = match arguments.stereo {
        Some(_) => {
            "give each an output of its own, such as -o out/{name}-{frame:04}-{sensor}-{eye}.exr"
        }
        None => "give each an output of its own, such as -o out/{name}-{frame:04}-{sensor}.exr",
    };
    output::check_distinct(files, help)?;
    let wanted = items.iter().filter(|item| !arguments.skips(item));
    output::check_writable(wanted.flat_map(Item::files))?;
    let display = arguments.display.transform();
    for item in items.iter().filter(|item| !is_part(&item.output)) {
        display.check(&item.output)?;
    }
    let mut series = Series::new(arguments, budget, stop);
    let threads = arguments.run.threads.map_or(0, |threads| threads.get());
    series.denoiser = arguments.denoising.denoiser(threads)?;
    series.viewer = viewer.as_ref();
    if let Some(unused) = (arguments.display).unused(items.iter().map(|item| item.output.as_path()))
    {
        series.warn(&unused);
    }
    if let Some(option) = arguments.staging.given()
        && !items.iter().any(|item| is_mesh(&item.input))
    {
        let message = format!("{option} is for bare meshes, and no input is one");
        series.warn_of(&Error::input(message).problems()[0]);
    }
    let image = &arguments.image;
    if image.has_fps() && arguments.frames.is_none() && image.shutter(0).is_none() {
        let message = "--fps says nothing without --frames or --shutter";
        series.warn_of(&Error::input(message).problems()[0]);
    }
    let style = arguments.style();
    let mut endings = Vec::new();
    for (input, error) in failed {
        series.fail(&error);
        let name = input.display().to_string();
        summary::tell_unread(style, &name, &error);
        endings.push((name, Ending::Failed(error)));
    }
    for item in &items {
        let begin = Instant::now();
        let ending = if series.stop.signalled() {
            Ending::NotBegun
        } else if arguments.skips(item) {
            Ending::Skipped
        } else {
            match series.item(item) {
                Ok(ending) => ending,
                Err(_) if series.stop.signalled() => {
                    let message = format!("{}: stopped while it was read", item.name());
                    series.warn(&Error::input(message));
                    Ending::NotBegun
                }
                Err(error) => {
                    series.fail(&error);
                    Ending::Failed(error)
                }
            }
        };
        summary::tell(style, item, &ending, begin.elapsed());
        series.event("image", || summary::object(item, &ending, begin.elapsed()));
        endings.push((item.output.display().to_string(), ending));
    }
    if endings.len() > 1 {
        summary::table(style, &endings);
    }
    let signalled = series.stop.signalled();
    let status = summary::status(&endings, signalled);
    series.event(
        "done",
        || json!({ "images": endings.len(), "status": status }),
    );
    // The process ends: the system takes the scene back at once, faster than piece by piece.
    std::mem::forget(series);
    if let Some(viewer) = viewer {
        viewer.close();
    }
    Ok(status)
}

/// Writes the image as it stands. If that fails the render goes on: the end will show whether it still does.
fn snapshot(item: &Item, picture: &Picture, display: &display::DisplayTransform) {
    let Picture {
        image,
        window,
        metadata,
    } = picture;
    if let Err(error) = display::save_window(&item.output, image, window, metadata, display) {
        report::warnings(error.problems());
    }
}

/// Images, one after another.
struct Series<'a> {
    arguments: &'a Arguments,
    session: Session,
    /// The bare mesh that was read last, and how: its frames need it read but once.
    read: Option<(PathBuf, description::Options, Description)>,
    /// What was framed of the animated mesh that was read last.
    framed: Option<(PathBuf, Framing)>,
    /// Found out before anything is loaded, for a scene in memory counts as taken.
    budget: Budget,
    /// Warnings that were told already.
    told: Vec<Problem>,
    stop: Stop,
    /// Found before anything is rendered, so that it is there in the end.
    denoiser: Option<Denoiser>,
    /// Who looks on.
    viewer: Option<&'a Viewer>,
}

/// What is known of an image before it is rendered.
#[derive(Clone, Debug)]
pub(super) struct Looked {
    pub(super) outline: Outline,
    /// Whether it is there, of the same scene, files, settings and version.
    pub(super) current: bool,
}

/// Looks at an image without rendering it. Its scene is loaded only where the camera's place depends on it and there is
/// an image that may be it.
pub(super) fn look(
    arguments: &Arguments,
    item: &Item,
    budget: Budget,
    stop: &Stop,
) -> Result<Looked> {
    arguments.check()?;
    let mut series = Series::new(arguments, budget, stop.clone());
    let options = arguments.options(item);
    let (_, description) = series.read(item)?;
    let outline = outline(&description, &options)?;
    let mut current = false;
    if item.output.exists() {
        let watch = Watch::new(&item.name(), Told::None, stop.clone(), Takers::default());
        let posed = series.pose(item, &description, &options, &watch)?;
        let seen = posed.as_ref().unwrap_or(&description);
        let passes = arguments.passes.unwrap_or_default();
        current = is_current(seen, &options, passes, &item.output)?;
    }
    Ok(Looked { outline, current })
}

impl<'a> Series<'a> {
    fn new(arguments: &'a Arguments, budget: Budget, stop: Stop) -> Self {
        Self {
            arguments,
            session: Session::default(),
            read: None,
            framed: None,
            budget,
            told: Vec::new(),
            stop,
            denoiser: None,
            viewer: None,
        }
    }

    fn item(&mut self, item: &Item) -> Result<Ending> {
        let arguments = self.arguments;
        let deadline = arguments.time_limit.map(|limit| Instant::now() + limit);
        let stop = self.stop.by(deadline);
        let options = arguments.options(item);
        if arguments.checkpoint.is_some() && !arguments.resume && item.checkpoint().exists() {
            let path = item.checkpoint();
            self.warn(&Error::input(format!(
                "{} is overwritten; --resume would go on from it",
                path.display()
            )));
        }
        self.event(
            "started",
            || json!({ "name": item.name(), "output": item.output.display().to_string() }),
        );
        let read = self.read(item)?;
        let display = arguments.display.transform();
        let name = item.output.display().to_string();
        let takers = Takers {
            write: Some(Box::new(|picture| snapshot(item, picture, &display))),
            every: arguments.snapshot,
            show: self.viewer.map(|viewer| -> Take<'_> {
                Box::new(|picture| viewer.show(&name, &picture.image))
            }),
        };
        let bar = Watch::new(&item.name(), arguments.told(), stop, takers);
        let posed = self.pose(item, &read.1, &options, &bar);
        let seen = posed.and_then(|posed| {
            let seen = posed.as_ref().unwrap_or(&read.1);
            let passes = arguments.passes.unwrap_or_default();
            if arguments.skip_same && is_current(seen, &options, passes, &item.output)? {
                return Ok(Ending::Skipped);
            }
            match is_part(&item.output) {
                true => self.part(item, seen, &options, &bar),
                false => self.image(item, seen, &options, &bar),
            }
        });
        bar.finish();
        if seen.is_ok() && is_mesh(&item.input) {
            let (as_read, description) = read;
            self.read = Some((item.input.clone(), as_read, description));
        }
        seen
    }

    /// The description at the item's time and from where the turntable has turned the camera and the eye is, where that
    /// is another.
    fn pose(
        &mut self,
        item: &Item,
        description: &Description,
        options: &Options,
        bar: &Watch<'_>,
    ) -> Result<Option<Description>> {
        let sensor = sensors(description).get(item.sensor).copied();
        let turned = self.arguments.turntable.zip(item.frame).zip(sensor);
        let mut posed = None;
        let shutter = self.arguments.image.shutter(item.frame.unwrap_or(0));
        if let (Some(_), Some(_)) = (shutter, item.frame) {
            let overrides = Overrides {
                shutter,
                ..Overrides::default()
            };
            overrides.apply(posed.insert(description.clone()));
        }
        if let Some(((count, frame), sensor)) = turned {
            let bounds = self.session.bounds(description, options, bar)?;
            let pivot = self.arguments.pivot;
            let center = pivot.unwrap_or_else(|| turntable::pivot(description, sensor, &bounds));
            let speed = self.arguments.image.fps() / f64::from(count);
            let orbit = Orbit {
                center,
                turns: match shutter {
                    Some((open, _)) => open * speed,
                    None => frame as f64 / f64::from(count),
                },
                speed,
                shutter,
            };
            let posed = posed.get_or_insert_with(|| description.clone());
            orbit.place(posed, sensor);
        }
        let sensor = sensors(description).get(item.sensor).copied();
        if let (Some(distance), Some(eye), Some(sensor)) = (self.arguments.stereo, item.eye, sensor)
        {
            let posed = posed.get_or_insert_with(|| description.clone());
            eye.place(posed, sensor, distance)?;
        }
        Ok(posed)
    }

    /// Renders an image and writes it.
    fn image(
        &mut self,
        item: &Item,
        seen: &Description,
        options: &Options,
        bar: &Watch<'_>,
    ) -> Result<Ending> {
        let rendered = self.session.render(seen, options, bar)?;
        if let (Some(path), false) = (&item.heatmap, bar.stop()) {
            self.heatmap(seen, path, options, bar)?;
        }
        bar.finish();
        self.finish(item, options, rendered)
    }

    /// Renders a part, which is written if it is whole.
    fn part(
        &mut self,
        item: &Item,
        seen: &Description,
        options: &Options,
        bar: &Watch<'_>,
    ) -> Result<Ending> {
        let passes = self.arguments.passes.unwrap_or_default();
        let parted = (self.session).render_part(seen, options, passes, &item.output, bar)?;
        bar.finish();
        for problem in &parted.warnings {
            self.warn_of(problem);
        }
        if parted.report.completed.is_whole() {
            return Ok(Ending::Rendered(parted.report));
        }
        self.warn(&summary::lost(item, &parted.report));
        Ok(Ending::NotBegun)
    }

    /// When a bare glTF file's animation is looked at; `None` where it has none, or nobody asks for a time.
    fn animation(&self, item: &Item) -> Result<Option<GltfAnimation>> {
        let shutter = self.arguments.image.shutter(item.frame.unwrap_or(0));
        let extension = etendue::mesh::extension(&item.input);
        let asked = item.frame.is_some() && self.arguments.turntable.is_none() || shutter.is_some();
        if !asked || !matches!(extension.as_str(), "gltf" | "glb") {
            return Ok(None);
        }
        let time = item.frame.unwrap_or(0) as f64 / self.arguments.image.fps();
        let (open, close) = shutter.unwrap_or((time, time));
        read_gltf_animation(&item.input, [open as f32, close as f32], &self.budget)
    }

    /// Draws the picture of node steps, unless stopped.
    fn heatmap(
        &mut self,
        description: &Description,
        path: &Path,
        options: &Options,
        bar: &Watch<'_>,
    ) -> Result<()> {
        let heat = self.session.heat(description, options, bar)?;
        if bar.stop() {
            return Ok(());
        }
        let map = Map {
            width: heat.width,
            values: &heat.node_steps,
            label: match heat.of_pixels {
                true => "node steps a pixel",
                false => "node steps a sample",
            },
            top: robust_top(&heat.node_steps),
            scale: Scale::FromZero,
        };
        image::write_codes(path, &map.draw()?, image::Tag::Srgb)
    }

    /// The description of an item, with the arguments' values in place of its own.
    fn read(&mut self, item: &Item) -> Result<(description::Options, Description)> {
        let scene = &self.arguments.scene;
        // A bare mesh has no parameters, and reading it takes time.
        let bare = is_mesh(&item.input);
        let options = scene.options(item.frame.filter(|_| !bare));
        let animation = self.animation(item)?;
        // What moves is another scene at any other time.
        if let Some((input, as_read, description)) = self.read.take()
            && input == item.input
            && as_read == options
            && animation.is_none()
        {
            return Ok((options, description));
        }
        let turns = self.arguments.turntable.is_some();
        let (arguments, up) = (&self.arguments.staging, scene.up_axis());
        let framed = (self.framed.take()).filter(|(path, _)| *path == item.input);
        let staging = Staging {
            animation,
            framing: framed.map(|(_, framing)| framing),
            ..arguments.staging(up, &self.arguments.image.overrides(), turns)
        };
        let (budget, session) = (&self.budget, &mut self.session);
        let Described {
            mut description,
            text,
            framing,
        } = describe(&item.input, &staging, &options, budget, session)?;
        self.framed = framing.map(|framing| (item.input.clone(), framing));
        if let (Some(path), Some(text)) = (&arguments.write_scene, text) {
            let names = Names {
                input: &item.input,
                frame: item.frame.unwrap_or(0),
                sensor: "0",
                eye: item.eye.map(Eye::name),
            };
            let path = names.expand(&path.to_string_lossy())?;
            etendue::file::write_atomically(&path, text.as_bytes())?;
        }
        self.arguments.overrides().apply(&mut description);
        Ok((options, description))
    }

    /// Writes the image and says what it is.
    fn finish(&mut self, item: &Item, options: &Options, rendered: Rendered) -> Result<Ending> {
        for problem in &rendered.warnings {
            self.warn_of(problem);
        }
        let completed = rendered.report.completed;
        if completed.units[0] == 0 && !completed.is_whole() {
            if self.stop.signalled() {
                return Ok(Ending::NotBegun);
            }
            let message = format!("{}: no tile was complete in time", item.name());
            return Err(Error::input(message).help("give a longer --time-limit"));
        }
        let Rendered {
            mut image,
            window,
            mut metadata,
            report,
            provenance,
            ..
        } = rendered;
        if let Some(denoiser) = &self.denoiser {
            image = denoise::applied(denoiser, &image)?;
            metadata = metadata.with("denoiser", denoise::name(denoiser));
        }
        if let Some(viewer) = self.viewer {
            viewer.finish(&item.output.display().to_string(), &image);
        }
        let display = self.arguments.display.transform();
        display::save_window(&item.output, &image, &window, &metadata, &display)?;
        if let Some(provenance) = provenance {
            provenance.write(&item.output)?;
        }
        if completed.is_whole() {
            if let Some(checkpoint) = &options.checkpoint {
                checkpoint.remove();
            }
            return Ok(Ending::Rendered(report));
        }
        self.warn(&summary::incomplete(item, &report));
        Ok(if self.stop.signalled() {
            Ending::Interrupted(report)
        } else {
            Ending::TimeLimit(report)
        })
    }

    fn warn(&mut self, error: &Error) {
        for problem in error.problems() {
            self.warn_of(problem);
        }
    }

    /// Says a warning once in a series.
    fn warn_of(&mut self, problem: &Problem) {
        if self.told.contains(problem) {
            return;
        }
        self.arguments.voice().warn_of(problem);
        self.told.push(problem.clone());
    }

    /// Says why an image is not there.
    fn fail(&self, error: &Error) {
        progress::fail(self.arguments.told(), error);
    }

    /// Says what happens to programs that want to hear it.
    fn event(&self, name: &str, about: impl FnOnce() -> serde_json::Value) {
        if self.arguments.told() == Told::Json {
            progress::emit(name, about());
        }
    }
}
