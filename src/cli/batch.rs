//! `etendue batch`: all images of a manifest, each by a call of `etendue render` in a process of its own.

mod manifest;
mod work;

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use etendue::error::Result;
use etendue::render::human_duration;
use serde_json::{Value, json};

use self::manifest::{Manifest, Unit};
use self::work::{Done, Status, Worker};
use super::memory::MemoryArguments;
use super::progress::Told;
use super::render::Looked;
use super::stop::Stop;
use super::summary::samples;
use super::{output, report, status};

/// Render all images of a manifest
///
/// JOB.toml lists images, each of which becomes a call of `etendue render`. A key is a long option of that command,
/// without its dashes; a list of values makes an image for each of them, all combinations. What stands under [defaults]
/// holds for all. Files are named from the folder of JOB.toml. An image that fails does not keep the others from being
/// rendered, and what is there of the same scene, files, settings and version is not rendered again.
#[derive(Args, Debug)]
#[command(after_help = format!("{EXAMPLE}\n\n{}", status::HELP))]
pub(super) struct Arguments {
    /// The manifest
    #[arg(value_name = "JOB.toml")]
    job: PathBuf,
    /// Render nothing: list the images with what they may take of time and memory, and what is wrong with them
    #[arg(long)]
    dry_run: bool,
    /// Print the calls of `etendue render`, one a line, and do nothing: for other programs that start processes
    #[arg(long, conflicts_with_all = ["dry_run", "json"])]
    commands: bool,
    /// How often an image is tried again whose process was killed or refused something by the system
    #[arg(long, default_value_t = 0, value_name = "N")]
    retries: u32,
    /// How the progress of an image is told on standard error
    #[arg(long, value_enum, value_name = "HOW", default_value_t = Told::Auto)]
    progress: Told,
    /// Print no line for each image
    #[arg(short, long)]
    quiet: bool,
    /// Print JSON: an object for each image of a dry run, else one for all
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    memory: MemoryArguments,
}

const EXAMPLE: &str = r#"A manifest of eight images:
  [defaults]
  size = "640x360"
  spp = 64

  [[images]]
  scenes = ["room.xml", "hall.xml"]
  output = "out/{name}-{frame:02}-{light}.exr"
  frames = "0:2"
  define = { light = [1, 2.5], body = "body-{frame:04}.ply" }"#;

/// Runs the command; the answer is the exit status.
pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    let stop = Stop::on_signals()?;
    let budget = arguments.memory.budget_until(&stop);
    let manifest = Manifest::read(&arguments.job, &budget)?;
    if arguments.commands {
        let commands = manifest.units.iter().map(Unit::shell);
        commands.for_each(|command| output::line(&command));
        return Ok(failures(&manifest, status::DONE));
    }
    if arguments.dry_run {
        return Ok(list(arguments, &manifest, &stop));
    }
    let began = Instant::now();
    let worker = Worker {
        folder: &manifest.folder,
        told: arguments.progress,
        memory: arguments.memory.words(),
        retries: arguments.retries,
        stop: &stop,
    };
    let mut done = Vec::new();
    for (i, unit) in manifest.units.iter().enumerate() {
        let ended = match stop.signalled() {
            true => Done::not_begun(),
            false => worker.render(unit)?,
        };
        if !arguments.quiet && !arguments.json {
            let (n, name, all) = (i + 1, unit.item.output.display(), manifest.units.len());
            // Why is told by the process, and at the end.
            let ended = match ended.status {
                Status::Failed => ended.status.name().to_owned(),
                _ => ended.to_string(),
            };
            output::line(&format!("{n} of {all}: {name}: {ended}"));
        }
        done.push(ended);
    }
    Ok(tell(arguments, &manifest, &done, began, stop.signalled()))
}

/// Says what is wrong with entries of the manifest; the exit status, which is `so_far` where nothing is.
fn failures(manifest: &Manifest, so_far: u8) -> u8 {
    manifest.failed.iter().fold(so_far, |worst, error| {
        report::error(error);
        worst.max(status::of(error))
    })
}

/// The images, and what they may take.
fn list(arguments: &Arguments, manifest: &Manifest, stop: &Stop) -> u8 {
    let mut worst = failures(manifest, status::DONE);
    let (mut seconds, mut most, mut current) = (0.0, 0, 0);
    for (number, unit) in manifest.units.iter().enumerate() {
        let looked = manifest.look(unit, arguments.memory.budget_until(stop), stop);
        let mut object = json!({
            "image": number,
            "input": unit.item.input.display().to_string(),
            "output": unit.item.output.display().to_string(),
            "frame": unit.item.frame,
            "sensor": unit.item.sensor,
            "directory": manifest.folder.display().to_string(),
            "arguments": unit.arguments,
            "current": false,
        });
        let text = match &looked {
            Ok(Looked {
                outline,
                current: is_current,
            }) => {
                let outlined =
                    serde_json::to_value(outline).expect("it has only names and numbers");
                if let (Value::Object(object), Value::Object(outlined)) = (&mut object, outlined) {
                    object.extend(outlined);
                }
                object["current"] = (*is_current).into();
                most = most.max(outline.bytes);
                if *is_current {
                    current += 1;
                    "there already".to_owned()
                } else {
                    seconds += outline.seconds;
                    words(outline)
                }
            }
            Err(error) => {
                object["problems"] = report::json(error.problems());
                worst = worst.max(status::of(error));
                format!("failed: {error}")
            }
        };
        match arguments.json {
            true => output::object(object),
            false => output::line(&format!("{}: {text}", unit.item.output.display())),
        }
    }
    if !arguments.json {
        let (all, bytes) = (manifest.units.len(), etendue::budget::human_bytes(most));
        output::line(&format!(
            "{all} images, {current} of them there already; about {} of a processor's time and {bytes} of memory",
            human_duration(std::time::Duration::from_secs_f64(seconds))
        ));
    }
    worst
}

fn words(outline: &etendue::render::Outline) -> String {
    let taken = match outline.adaptive {
        true => format!("up to {}", samples(outline.spp)),
        false => samples(outline.spp),
    };
    format!(
        "{}×{}, {taken}, about {} of a processor's time, {}",
        outline.crop.width,
        outline.crop.height,
        human_duration(std::time::Duration::from_secs_f64(outline.seconds)),
        etendue::budget::human_bytes(outline.bytes)
    )
}

/// The report at the end; the answer is the exit status.
fn tell(
    arguments: &Arguments,
    manifest: &Manifest,
    done: &[Done],
    began: Instant,
    signalled: bool,
) -> u8 {
    let count = |status: Status| done.iter().filter(|done| done.status == status).count();
    let counts = Status::ALL.map(|status| (status.name(), count(status)));
    let worst = failures(manifest, done.iter().map(|d| d.exit).max().unwrap_or(0));
    if arguments.json {
        let images = manifest.units.iter().zip(done).map(|(unit, done)| {
            let mut object = done.object();
            object["input"] = unit.item.input.display().to_string().into();
            object["output"] = unit.item.output.display().to_string().into();
            object["frame"] = unit.item.frame.into();
            object["sensor"] = unit.item.sensor.into();
            object
        });
        let mut object = json!({
            "images": images.collect::<Vec<Value>>(),
            "seconds": began.elapsed().as_secs_f64(),
            "problems": manifest.failed.iter().map(|e| report::json(e.problems())).collect::<Value>(),
        });
        for (name, count) in counts {
            object[name.replace(' ', "_")] = count.into();
        }
        output::object(object);
    } else {
        let counts = counts.iter().filter(|(_, count)| *count > 0);
        let counts: Vec<String> = counts
            .map(|(name, count)| format!("{count} {name}"))
            .collect();
        let time = human_duration(began.elapsed());
        let parts: Vec<&str> = match counts.is_empty() {
            true => vec!["no image is rendered"],
            false => counts.iter().map(String::as_str).collect(),
        };
        let (all, parts) = (done.len(), parts.join(", "));
        let images = if all == 1 { "image" } else { "images" };
        output::line(&format!("{all} {images} in {time}: {parts}"));
        for (unit, done) in manifest.units.iter().zip(done) {
            if !matches!(done.status, Status::Rendered | Status::Skipped) {
                output::line(&format!("  {}: {done}", unit.item.output.display()));
            }
        }
    }
    match signalled {
        true => status::INTERRUPTED,
        false => worst,
    }
}
