//! `etendue crosscheck`: scenes on both sides, here and in Mitsuba, and whether the images agree.

use std::num::NonZeroUsize;
use std::path::{Component, Path, PathBuf};
use std::time::Duration;

use clap::{Args, ValueEnum};
use etendue::budget::Budget;
use etendue::crosscheck::{self, Failure, Python, Settings, Side, Watch};
use etendue::description;
use etendue::error::{Error, Result};
use etendue::render::{Staging, describe_mesh, is_mesh};
use tempfile::TempDir;

use super::oracle::Subject;
use super::overrides::ImageArguments;
use super::page::{self, Page};
use super::progress::{self, Count, Steps, Told};
use super::scene::ReadArguments;
use super::stop::Stop;
use super::verdicts::{self, Ending, Style};
use super::{output, parse, status};

/// Hold scenes against what Mitsuba renders, or rays against the z-buffer, and say whether they agree
///
/// Each side renders each scene with several seeds. How much the seeds of a side differ is the yardstick:
/// the images differ where the means over the seeds, of the whole, of tiles or of pixels, are further apart
/// than chance explains, by Welch's test at 1 % for the scene. The interval around the bias says how small
/// a difference would have been found.
///
/// Each side is a process that loads the scene once and renders the seeds in turns with the other. Seconds
/// are the median of a seed's, without starting and loading; ratios are medians over pairs of seeds.
///
/// Mitsuba is driven through Python: that of --python, else of $ETENDUE_PYTHON, else of the environment that
/// --install makes. A scene that asks for what one side lacks is told as not comparable.
///
/// With --against raster no image is rendered and nothing else is needed: what rays see at pixel centres is held
/// against what this program's z-buffer sees there, away from silhouettes: depth, position, normals, texture
/// coordinates, shapes and triangles.
///
/// Of a bare mesh the scene around it is compared, as `etendue render --write-scene` writes it.
#[derive(Args, Debug)]
#[command(after_help = HELP)]
pub(super) struct Arguments {
    /// Scene files (.xml), or bare meshes
    #[arg(required_unless_present = "install", value_name = "SCENE")]
    scenes: Vec<PathBuf>,
    #[command(flatten)]
    read: ReadArguments,
    #[command(flatten)]
    image: ImageArguments,
    /// What scenes are held against
    #[arg(long, value_enum, default_value_t = Against::Mitsuba, value_name = "WHAT")]
    against: Against,
    /// Let Mitsuba render this scene instead: the same in words that Mitsuba knows
    #[arg(long, value_name = "SCENE")]
    reference: Option<PathBuf>,

    /// How often each side renders a scene
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(2..=100_000))]
    seeds: u32,
    /// The first seed; the others follow it
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(..1 << 31))]
    seed: u64,

    /// Mitsuba's variant; with a spectral one, 8 bands are rendered here [default: scalar_rgb, and with --bands
    /// scalar_spectral]
    #[arg(long, value_name = "NAME")]
    variant: Option<String>,
    /// The Python that has Mitsuba
    #[arg(long, value_name = "PATH")]
    python: Option<PathBuf>,
    /// First make an environment with Mitsuba in Étendue's folder for caches, by --python or python3, which takes it
    /// from the Python package index
    #[arg(long)]
    install: bool,
    /// A folder of Python files that register plugins with Mitsuba, in place of Étendue's own phong, ambient, plane and
    /// cone
    #[arg(long, value_name = "DIR")]
    plugins: Option<PathBuf>,
    /// Threads of each side; one a processor by default
    #[arg(long, value_name = "N", value_parser = parse::threads, allow_negative_numbers = true)]
    threads: Option<NonZeroUsize>,
    /// The longest that a side may take to load a scene, and to render a seed
    #[arg(long, value_name = "SECONDS", default_value = "300", value_parser = parse::seconds)]
    timeout: Duration,

    /// Where the images agree and the interval around the bias is wider than ± this part of the mean, they
    /// are too noisy to say
    #[arg(long, value_name = "PART", default_value = "0.05", value_parser = parse::positive)]
    precision: f64,
    /// Do not judge the images, compare the times
    #[arg(long)]
    timing_only: bool,
    /// Keep both sides' mean images and two maps, in a folder of DIR for each scene: error.png, how many standard errors
    /// they are apart, and signed.png, where Étendue's is brighter (red) and where darker (blue)
    #[arg(long, value_name = "DIR", conflicts_with = "timing_only")]
    keep: Option<PathBuf>,
    /// Write DIR/index.html, a page that shows the images side by side, where they differ, and what each side took
    #[arg(long, value_name = "DIR", conflicts_with = "timing_only")]
    report: Option<PathBuf>,
    /// Print a JSON object for each scene
    #[arg(long)]
    json: bool,
    /// No progress, no paragraph on scenes that agree
    #[arg(short, long)]
    quiet: bool,
    /// How progress is told on standard error, which --against raster has none of
    #[arg(long, value_enum, value_name = "HOW", default_value_t = Told::Auto)]
    progress: Told,
}

/// What scenes are held against.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Against {
    /// What Mitsuba renders
    Mitsuba,
    /// What the z-buffer sees
    Raster,
}

const HELP: &str = "\
Examples:
  etendue crosscheck --install
  etendue crosscheck scenes/*.xml --size 96x96 --spp 64
  etendue crosscheck scene.xml --seeds 16 --precision 0.002 --keep out
  etendue crosscheck scenes/*.xml --report out && xdg-open out/index.html
  etendue crosscheck scene.xml --variant llvm_ad_rgb --timing-only --json
  etendue crosscheck scenes/*.xml --against raster

Exit status: 0 done; all scenes agree; 1 one differs; 2 none differs and one could not be compared or was \
too noisy to say, Mitsuba is not there, or the command line is wrong; 3 the system refused; 130 stopped by \
Ctrl-C, SIGTERM or SIGHUP.";

impl Arguments {
    /// The Python to use, installed where that is asked for.
    fn python(&self) -> Result<Python> {
        if !self.install {
            return crosscheck::find_python(self.python.as_deref());
        }
        let path = crosscheck::install(self.python.as_deref())?;
        let from = "just installed";
        Ok(Python { path, from })
    }

    fn settings(&self) -> Result<Settings> {
        let executable = std::env::current_exe()
            .map_err(|e| Error::input(format!("cannot find this program's own file: {e}")))?;
        let spectral = |variant: &String| variant.contains("spectral");
        let bands = self
            .image
            .bands
            .or_else(|| self.variant.as_ref().filter(|v| spectral(v)).map(|_| 8));
        let variant = match (&self.variant, bands) {
            (Some(variant), _) => variant.clone(),
            (None, Some(_)) => "scalar_spectral".to_owned(),
            (None, None) => "scalar_rgb".to_owned(),
        };
        if bands.is_some() && !spectral(&variant) {
            let message = format!("--bands has no like in Mitsuba's variant {variant:?}");
            return Err(Error::input(message).help("take one such as scalar_spectral"));
        }
        if self.image.band_range.is_some() {
            let message = "--band-range has no like in Mitsuba";
            let error = Error::input(message);
            return Err(error.help("give the scene a specfilm, and compare its channels"));
        }
        if self.reference.is_some() && self.scenes.len() > 1 {
            let message = "--reference is another form of one scene, and there are several";
            return Err(Error::input(message));
        }
        let plugins = self.plugins.clone();
        if let Some(folder) = plugins.as_ref().filter(|folder| !folder.is_dir()) {
            return Err(Error::input(format!("{} is no folder", folder.display())));
        }
        let read = self.read.options(None);
        Ok(Settings {
            python: self.python()?,
            etendue: (executable, vec![super::CROSSCHECK_WORKER.to_owned()]),
            plugins,
            variant,
            bands,
            reference: self.reference.clone(),
            defines: read.defines,
            strict: read.strict,
            overrides: self.image.overrides(),
            sensor: self.image.sensor()?,
            seeds: self.seeds,
            first_seed: self.seed,
            threads: self.threads.map(|n| n.get() as u32),
            timeout: self.timeout,
            keep: None,
            pictures: self.report.is_some(),
            timing_only: self.timing_only,
        })
    }
}

/// Runs the command; the answer is the exit status.
pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    if arguments.against == Against::Raster {
        let subject = Subject {
            scenes: &arguments.scenes,
            read: &arguments.read,
            image: &arguments.image,
            threads: arguments.threads,
            json: arguments.json,
            quiet: arguments.quiet,
        };
        return subject.run();
    }
    let told = arguments.progress.unless(arguments.quiet);
    let status = beside_mitsuba(arguments, told)?;
    progress::done(told, status);
    Ok(status)
}

/// The scene around a bare mesh, in a file for both sides to read.
struct Around {
    scene: PathBuf,
    /// Where that is, as long as it is wanted.
    _folder: TempDir,
}

impl Around {
    fn mesh(mesh: &Path) -> Result<Self> {
        let refused = |e| Error::system("write in", &std::env::temp_dir(), &e);
        let folder = TempDir::with_prefix("etendue-").map_err(refused)?;
        let options = description::Options::default();
        let bare = describe_mesh(mesh, &Staging::default(), &options, &Budget::default())?;
        let scene = folder.path().join("scene.xml");
        etendue::file::write_atomically(&scene, bare.text.as_bytes())?;
        Ok(Self {
            scene,
            _folder: folder,
        })
    }
}

fn beside_mitsuba(arguments: &Arguments, told: Told) -> Result<u8> {
    if let Some(folder) = &arguments.report {
        page::check_writable(folder)?;
    }
    let folders = folders(&arguments.scenes);
    let mut settings = match arguments.settings() {
        Ok(settings) => settings,
        Err(error) => {
            progress::fail(told, &error);
            return Ok(status::CANNOT_COMPARE);
        }
    };
    if arguments.scenes.is_empty() {
        output::line(&format!("Mitsuba is there: {}", settings.python));
    }
    let style = Style {
        quiet: arguments.quiet,
        json: arguments.json,
        precision: arguments.precision,
    };
    let stop = Stop::on_signals()?;
    let mut endings = Vec::new();
    for (i, scene) in arguments.scenes.iter().enumerate() {
        settings.keep = arguments
            .keep
            .as_ref()
            .map(|folder| folder.join(&folders[i]));
        let name = scene.display().to_string();
        let steps = Steps::new(told, &name, Count::Images);
        let watch = Progress { steps, stop: &stop };
        let compare = |scene: &Path| crosscheck::crosscheck(scene, &settings, &watch);
        let result = match is_mesh(scene) {
            true => match Around::mesh(scene) {
                Ok(around) => compare(&around.scene),
                Err(error) => Err(Failure::NotComparable(error.to_string())),
            },
            false => compare(scene),
        };
        watch.steps.finish();
        let ending = Ending::of(result, style);
        verdicts::tell(style, &name, &ending);
        let hopeless = ending.is_hopeless() || stop.signalled();
        endings.push((name, ending));
        if hopeless {
            break;
        }
    }
    if endings.len() > 1 {
        verdicts::table(style, &endings);
    }
    if let Some(folder) = &arguments.report {
        let scenes = endings.iter().map(|(name, ending)| ending.on_page(name));
        let page = Page {
            title: "Étendue beside Mitsuba",
            sides: ["Mitsuba", "Étendue"],
            scenes: scenes.collect(),
        };
        page.write(folder)?;
    }
    Ok(if stop.signalled() {
        status::INTERRUPTED
    } else {
        verdicts::status(&endings)
    })
}

/// What the scenes' folders are called: by their file names, or whole paths where names are shared.
fn folders(scenes: &[PathBuf]) -> Vec<String> {
    let stem = |scene: &PathBuf| {
        scene
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    };
    let stems: Vec<String> = scenes.iter().map(stem).collect();
    let path = |scene: &PathBuf| {
        let parts = scene.components().filter_map(|part| match part {
            Component::Normal(name) => Some(name.to_string_lossy().into_owned()),
            _ => None,
        });
        parts.collect::<Vec<_>>().join("-")
    };
    let shared = |name: &String| stems.iter().filter(|other| *other == name).count() > 1;
    let named = scenes.iter().zip(&stems);
    named
        .map(|(scene, stem)| {
            if shared(stem) {
                path(scene)
            } else {
                stem.clone()
            }
        })
        .collect()
}

/// Serves as Étendue's side: see [`crosscheck::serve`].
pub(super) fn serve() -> Result<u8> {
    crosscheck::serve(std::io::stdin().lock(), std::io::stdout().lock())?;
    Ok(status::DONE)
}

/// Progress over the images of a scene.
struct Progress<'a> {
    steps: Steps,
    stop: &'a Stop,
}

impl Watch for Progress<'_> {
    fn at(&self, side: Side, done: u32, total: u32) {
        let what = format!("{side} at work");
        self.steps.at(done.into(), total.into(), &what);
    }

    fn stop(&self) -> bool {
        self.stop.asked()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_of_one_name_are_kept_apart() {
        let scenes = ["a/scene.xml", "../b/scene.xml", "c/box.xml"].map(PathBuf::from);
        assert_eq!(folders(&scenes), ["a-scene.xml", "b-scene.xml", "box"]);
    }
}
