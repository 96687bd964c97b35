//! Whole scenes: CPU time a sample beside Mitsuba's, in one run.
//!
//!     cargo bench --bench scenes                                     # the scenes of ../shared/data/scenes
//!     cargo bench --bench scenes -- veach-mis --rounds 9             # only these, more rounds
//!     cargo bench --bench scenes -- my/scene.xml --size 400x225      # any scene
//!     cargo bench --bench scenes -- --reference 4096 --size 160x90  # CPU time at equal error, against so many samples
//!     DRJIT_LIBLLVM_PATH=/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1 cargo bench --bench scenes
//!
//! `ETENDUE_PYTHON` or --python names a Python that has Mitsuba (tools/venv makes one). Both sides load a scene once and
//! render it a first time, which is not measured. Then they take turns in each round, so that what disturbs the machine
//! disturbs all alike; a ratio is the median over the rounds, and beside it stand the least and the greatest. Integrator and
//! sampler are the scene's own. What is measured is the CPU time of the render call, of all threads.
//!
//! With `--reference` each side also renders with the sampler that is best for it, and what is compared is CPU time times
//! error: the mean of (x − r)²/(r² + 0.01) over pixels and channels, against an image r by Mitsuba.

#![allow(clippy::print_stdout, clippy::print_stderr)] // a bench's business

mod error;

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitCode, Stdio};

use clap::Parser;
use etendue::budget::Budget;
use etendue::crosscheck::find_python;
use etendue::description::{self, Description};
use etendue::image::Image;
use etendue::render::{Options, Overrides, Session, Silent};
use rustix::time::{ClockId, clock_gettime};

/// Whole scenes beside Mitsuba.
#[derive(Debug, Parser)]
struct Arguments {
    /// Names of known scenes, or scene files; all known ones without any.
    scenes: Vec<String>,
    /// How often each side renders each scene.
    #[arg(long, default_value_t = 5)]
    rounds: usize,
    /// Samples per pixel.
    #[arg(long, default_value_t = 64)]
    spp: u32,
    /// Width and height of the film.
    #[arg(long, default_value = "400x225")]
    size: String,
    /// The variants of Mitsuba to render beside.
    #[arg(long, value_delimiter = ',', default_value = "llvm_ad_rgb,scalar_rgb")]
    variants: Vec<String>,
    /// Compare CPU time at equal error, against a reference of so many samples per pixel.
    #[arg(long, value_name = "SPP")]
    reference: Option<u32>,
    /// A Python that has Mitsuba.
    #[arg(long)]
    python: Option<PathBuf>,
    /// What `cargo bench` passes.
    #[arg(long, hide = true)]
    bench: bool,
}

/// Scenes that others made, and their files in the folder of shared data.
const KNOWN: &[(&str, &str)] = &[
    ("veach-mis", "veach-mis/scene_m3.xml"),
    ("veach-ajar", "veach-ajar/scene_m3.xml"),
    ("classroom", "classroom/scene_m3.xml"),
    ("living-room", "living-room/scene_m3.xml"),
    ("cornell-picture", "cornell-picture/scene_picture.xml"),
];

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data/scenes");

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let size = arguments.size.split_once('x');
    let size = size.and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    let size: (u32, u32) = size.ok_or("--size is WIDTHxHEIGHT")?;
    let samples = f64::from(size.0) * f64::from(size.1) * f64::from(arguments.spp);
    println!(
        "{} × {} pixels, {} samples each, {} rounds; ns of CPU time a sample",
        size.0, size.1, arguments.spp, arguments.rounds
    );
    let scenes = scenes(&arguments.scenes)?;
    if let Some(reference) = arguments.reference {
        let together = |(name, path): &(String, PathBuf)| {
            error::compare(arguments, name, path, size, reference)
        };
        return scenes.iter().try_for_each(together);
    }
    let mut logarithms = vec![0.0; arguments.variants.len()];
    for (name, path) in &scenes {
        let mut ours = Ours::load(path, size, arguments.spp, None)?;
        let variants = arguments.variants.iter();
        let theirs: Result<Vec<Theirs>, String> = variants
            .map(|variant| Theirs::load(arguments, variant, path, (size, arguments.spp), None))
            .collect();
        let mut theirs = theirs?;
        let mut own = Vec::new();
        let mut others = vec![Vec::new(); theirs.len()];
        let mut stages = [0.0; 4];
        for round in 0..arguments.rounds {
            let (cpu, seconds, _) = ours.render(round as u64 + 1)?;
            own.push(cpu / samples * 1e9);
            for (sum, seconds) in stages.iter_mut().zip(seconds) {
                *sum += seconds / samples * 1e9 / arguments.rounds as f64;
            }
            for (other, times) in theirs.iter_mut().zip(&mut others) {
                times.push(other.render(round as u64 + 1, None)? / samples * 1e9);
            }
        }
        let [closest, occluded, shade, film] = stages;
        println!(
            "{name:16} étendue {:6.0}   (closest {closest:.0}, occluded {occluded:.0}, shade {shade:.0}, film {film:.0})",
            median(&own)
        );
        for ((variant, times), logarithm) in
            arguments.variants.iter().zip(&others).zip(&mut logarithms)
        {
            let ratios: Vec<f64> = times.iter().zip(&own).map(|(b, a)| b / a).collect();
            *logarithm += median(&ratios).ln();
            println!(
                "{:16} {variant} {:6.0}: {:.2} times as long ({:.2} to {:.2})",
                "",
                median(times),
                median(&ratios),
                ratios.iter().copied().fold(f64::INFINITY, f64::min),
                ratios.iter().copied().fold(0.0, f64::max),
            );
        }
    }
    for (variant, logarithm) in arguments.variants.iter().zip(logarithms) {
        let mean = (logarithm / scenes.len() as f64).exp();
        println!("{variant}: {mean:.2} times as long (geometric mean)");
    }
    Ok(())
}

/// The scenes that were asked for, by name and file.
fn scenes(asked: &[String]) -> Result<Vec<(String, PathBuf)>, String> {
    let known = |name: &str| KNOWN.iter().find(|(known, _)| *known == name);
    let place = |(name, file): &(&str, &str)| (name.to_string(), Path::new(FOLDER).join(file));
    if asked.is_empty() {
        return Ok(KNOWN.iter().map(place).collect());
    }
    let found = asked.iter().map(|name| match known(name) {
        Some(scene) => Ok(place(scene)),
        None if Path::new(name).is_file() => Ok((name.clone(), PathBuf::from(name))),
        None => Err(format!(
            "{name:?} is neither a file nor one of the known scenes"
        )),
    });
    found.collect()
}

fn median(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Seconds of CPU time of this process, of all its threads.
fn cpu() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

/// A scene loaded here.
struct Ours {
    description: Description,
    session: Session,
}

impl Ours {
    fn load(
        path: &Path,
        size: (u32, u32),
        spp: u32,
        sampler: Option<&str>,
    ) -> Result<Self, String> {
        let read = Description::read(path, &description::Options::default(), &Budget::default());
        let mut description = read.map_err(|e| e.to_string())?;
        let overrides = Overrides {
            spp: Some(spp),
            size: Some(size),
            sampler: sampler.map(str::to_owned),
            ..Overrides::default()
        };
        overrides.apply(&mut description);
        let mut ours = Self {
            description,
            session: Session::default(),
        };
        ours.render(0)?;
        Ok(ours)
    }

    /// Seconds of CPU time, and of threads by stage; and the image.
    fn render(&mut self, seed: u64) -> Result<(f64, [f64; 4], Image), String> {
        let options = Options {
            seed,
            ..Options::default()
        };
        let start = cpu();
        let rendered = self.session.render(&self.description, &options, &Silent);
        let took = cpu() - start;
        let rendered = rendered.map_err(|e| e.to_string())?;
        let seconds = rendered.report.seconds;
        let stages = [
            seconds.closest,
            seconds.occluded,
            seconds.shade,
            seconds.film,
        ];
        Ok((took, stages, rendered.image))
    }
}

/// A scene loaded by Mitsuba.
struct Theirs {
    process: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

impl Theirs {
    fn load(
        arguments: &Arguments,
        variant: &str,
        path: &Path,
        ((width, height), spp): ((u32, u32), u32),
        sampler: Option<&str>,
    ) -> Result<Self, String> {
        let python = find_python(arguments.python.as_deref()).map_err(|e| e.to_string())?;
        let mut process = Command::new(&python.path)
            .args(["-c", include_str!("mitsuba.py"), variant])
            .arg(path)
            .args([width, height, spp].map(|n| n.to_string()))
            .arg(sampler.unwrap_or_default())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|e| e.to_string())?;
        let input = process.stdin.take().ok_or("no input")?;
        let output = BufReader::new(process.stdout.take().ok_or("no output")?);
        let mut theirs = Self {
            process,
            input,
            output,
        };
        let said = theirs.line()?;
        match said.trim() {
            "ready" => Ok(theirs),
            other => Err(format!("Mitsuba {variant} says {other:?}")),
        }
    }

    fn line(&mut self) -> Result<String, String> {
        let mut line = String::new();
        let read = self.output.read_line(&mut line);
        read.map_err(|e| e.to_string())?;
        Ok(line)
    }

    /// Seconds of CPU time; the image goes to a file, if one is given.
    fn render(&mut self, seed: u64, image: Option<&Path>) -> Result<f64, String> {
        let image = image.unwrap_or(Path::new("")).display();
        writeln!(self.input, "{seed} {image}").map_err(|e| e.to_string())?;
        let line = self.line()?;
        let parsed = line.trim().parse();
        parsed.map_err(|_| format!("Mitsuba ended: {:?}", self.process.try_wait()))
    }
}

impl Drop for Theirs {
    fn drop(&mut self) {
        // It has nothing to lose.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
