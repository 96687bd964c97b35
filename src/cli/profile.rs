//! `etendue profile`: what rendering costs as it grows.

use std::fs;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::thread;

use clap::Args;
use etendue::error::{Error, Result};
use etendue::file;
use etendue::profile::{self, Axis, Comparison, Effort, Profile, Settings, Subject, Watch};

use super::memory::MemoryArguments;
use super::overrides::MethodArguments;
use super::progress::{self, Count, Steps, Told};
use super::scene::{SceneArguments, check};
use super::stop::Stop;
use super::{growth, output, parse, status};

/// Measure what rendering costs as it grows
///
/// The textbook's cost is O(P·O·L) for P pixels, O triangles and L lights by brute force, × N/3 for N spectral
/// bands; a tree makes O into log O. Each is swept while all others stay, by brute force and by tree, and
/// samples, depth and threads as well. Rays, node steps, tests and shading calls are counted, which gives the
/// same numbers on every machine; phases are timed, in rounds over all renders. Exponents are fitted with
/// intervals, and each loop is confirmed or not; where the machine is too noisy, times are not judged.
///
/// INPUT is a mesh, which is profiled in parts and subdivided, or a scene (.xml), as it is and with lights
/// added. Without INPUT a landscape is generated.
#[derive(Args, Debug)]
#[command(after_help = format!("{EXAMPLES}\n\n{}", status::HELP))]
pub(super) struct Arguments {
    /// A mesh or a scene; a generated landscape where absent
    #[arg(value_name = "INPUT")]
    input: Option<PathBuf>,
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    method: MethodArguments,
    /// Sweep these only: P (pixels), O (triangles), L (lights), N (bands), samples, depth, threads
    #[arg(long, value_name = "AXES", value_delimiter = ',')]
    sweep: Vec<Axis>,
    /// Fewer and smaller renders, in under fifteen seconds
    #[arg(long, conflicts_with = "full")]
    quick: bool,
    /// Up to ten million triangles, in about ten minutes
    #[arg(long)]
    full: bool,
    /// Rounds over all renders; by default as many as there is time for, and three at least
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    rounds: Option<u32>,
    /// The most threads; one a processor by default. All sweeps but that of threads take one
    #[arg(long, value_name = "N", value_parser = parse::threads)]
    threads: Option<NonZeroUsize>,
    #[command(flatten)]
    memory: MemoryArguments,
    /// Write profile.html (all in one page), profile.json, profile.csv and the plots (.svg) to this folder
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Say what changed since an older profile.json
    #[arg(long, value_name = "OLD.json")]
    compare: Option<PathBuf>,
    /// Print the profile as JSON in place of tables
    #[arg(long)]
    json: bool,
    /// No progress
    #[arg(short, long)]
    quiet: bool,
    /// How progress is told on standard error
    #[arg(long, value_enum, value_name = "HOW", default_value_t = Told::Auto)]
    progress: Told,
}

const EXAMPLES: &str = "\
Examples:
  etendue profile --quick
  etendue profile -o out
  etendue profile dragon.ply --sweep O,threads -o out
  etendue profile scenes/cornell-box.xml --sweep P,L,N
  etendue profile --full --sweep O --compare before/profile.json";

impl Arguments {
    fn settings(&self, stop: &Stop) -> Result<Settings> {
        if let Some(input) = &self.input {
            check(input)?;
        }
        let axes = match &*self.sweep {
            [] => Axis::ALL.to_vec(),
            some => some.to_vec(),
        };
        let processors = thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        Ok(Settings {
            subject: Subject::of(
                self.input.clone(),
                self.scene.up_axis(),
                self.scene.options(None),
            ),
            axes,
            effort: match (self.quick, self.full) {
                (true, _) => Effort::Quick,
                (_, true) => Effort::Full,
                _ => Effort::Usual,
            },
            threads: self.threads.unwrap_or(processors),
            rounds: self.rounds.map(|n| n as usize),
            overrides: self.method.overrides(),
            sensor: self.method.sensor()?,
            budget: self.memory.budget_until(stop),
        })
    }
}

/// Runs the command; the answer is the exit status.
pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    let told = arguments.progress.unless(arguments.quiet);
    let status = profile(arguments, told).unwrap_or_else(|error| {
        progress::fail(told, &error);
        status::of(&error)
    });
    progress::done(told, status);
    Ok(status)
}

fn profile(arguments: &Arguments, told: Told) -> Result<u8> {
    let stop = Stop::on_signals()?;
    let settings = arguments.settings(&stop)?;
    let old = arguments.compare.as_deref().map(read).transpose()?;
    if let Some(folder) = &arguments.output {
        fs::create_dir_all(folder).map_err(|e| Error::system("make the folder", folder, &e))?;
    }
    let steps = Steps::new(told, "profiling", Count::Percent);
    let watch = Progress { steps, stop };
    let profile = profile::run(&settings, &watch);
    watch.steps.finish();
    let profile = match profile {
        Ok(Some(profile)) => profile,
        Err(error) if !watch.stop.signalled() => return Err(error),
        _ => return Ok(status::INTERRUPTED),
    };
    let comparison = old.map(|old| profile.since(&old));
    if let Some(folder) = &arguments.output {
        write(folder, &profile, comparison.as_ref())?;
    }
    if arguments.json {
        let mut object =
            serde_json::to_value(&profile).expect("a profile has only names and numbers");
        if let Some(comparison) = &comparison {
            object["since"] = serde_json::to_value(comparison).expect("and so has a comparison");
        }
        output::object(object);
    } else {
        growth::print(&profile, comparison.as_ref());
    }
    Ok(if watch.stop.signalled() {
        status::INTERRUPTED
    } else {
        status::DONE
    })
}

fn read(path: &Path) -> Result<Profile> {
    let text = fs::read_to_string(path).map_err(|e| Error::system("read", path, &e))?;
    Profile::from_json(&text).map_err(|error| Error::input(format!("{}: {error}", path.display())))
}

fn write(folder: &Path, profile: &Profile, comparison: Option<&Comparison>) -> Result<()> {
    let mut files = vec![
        ("profile.json".to_owned(), profile.to_json()),
        ("profile.csv".to_owned(), profile.to_csv()),
        ("profile.html".to_owned(), profile.to_html(comparison)),
    ];
    files.extend(
        profile
            .plots()
            .into_iter()
            .map(|plot| (format!("{}.svg", plot.name), plot.svg)),
    );
    for (name, text) in files {
        let path = folder.join(name);
        file::write_atomically(&path, text.as_bytes())?;
    }
    Ok(())
}

/// Progress on standard error.
struct Progress {
    steps: Steps,
    stop: Stop,
}

/// Steps of which progress consists.
const STEPS: f64 = 1000.0;

impl Watch for Progress {
    fn at(&self, what: &str, part: f64) {
        self.steps.at((part * STEPS) as u64, STEPS as u64, what);
    }

    fn stop(&self) -> bool {
        self.stop.asked()
    }
}
