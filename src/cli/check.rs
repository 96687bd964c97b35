//! `etendue check`: everything that is wrong with scenes, without rendering them.

use std::path::{Path, PathBuf};

use clap::Args;
use etendue::error::{Problem, Problems, Result};
use etendue::render::{Options, Session, Silent};
use serde_json::json;

use super::folders::{Wanted, files};
use super::memory::RunArguments;
use super::overrides::{self, ImageArguments};
use super::scene::SceneArguments;
use super::{output, report, status};

/// Find everything that is wrong with scenes, without rendering
///
/// Says what `etendue render` with the same options would say: meshes and images are loaded, and sensors,
/// materials and lights are built. What is wrong goes to standard error, with the line that says it.
#[derive(Args, Debug)]
#[command(after_help = status::HELP)]
pub(super) struct Arguments {
    /// Scene files (.xml) or meshes, or folders of them
    #[arg(required = true, value_name = "SCENE")]
    inputs: Vec<PathBuf>,
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    image: ImageArguments,
    #[command(flatten)]
    run: RunArguments,
    /// Print a JSON object for each scene: ok, problems, warnings
    #[arg(long)]
    json: bool,
    /// No word on scenes that are in order, no warnings
    #[arg(short, long)]
    quiet: bool,
}

/// Runs the command; the answer is the exit status.
pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    let mut worst = status::DONE;
    for input in &files(&arguments.inputs, Wanted::Scenes)? {
        let result = check(arguments, input);
        let name = input.display().to_string();
        if arguments.json {
            let none = Vec::new();
            let (problems, warnings) = match &result {
                Ok(warnings) => (&[][..], warnings),
                Err(error) => (error.problems(), &none),
            };
            let object = json!({
                "scene": name,
                "ok": result.is_ok(),
                "problems": report::json(problems),
                "warnings": report::json(warnings),
            });
            output::object(object);
        }
        match &result {
            Err(error) => {
                if !arguments.json {
                    report::error(error);
                }
                worst = worst.max(status::of(error));
            }
            Ok(warnings) if !arguments.json && !arguments.quiet => {
                report::warnings(warnings);
                output::line(&format!("{name}: in order"));
            }
            Ok(_) => {}
        }
    }
    Ok(worst)
}

/// The warnings, through all sensors that are meant.
fn check(arguments: &Arguments, input: &Path) -> Result<Vec<Problem>> {
    let (scene, image, mut session) = (&arguments.scene, &arguments.image, Session::default());
    let budget = arguments.run.memory.budget();
    let read = scene.options(None);
    let mut description = scene.describe(input, &read, &budget, &mut session)?;
    let chosen = overrides::chosen(&description, image.sensors())?;
    image.overrides().apply(&mut description);
    let mut problems = Problems::default();
    let mut warnings: Vec<Problem> = Vec::new();
    for sensor in chosen {
        let options = Options {
            sensor: sensor.number,
            colors: image.colors(),
            threads: arguments.run.threads,
            ..Options::default()
        };
        let found = session.check(&description, &options, &Silent);
        for warning in problems.take(found).into_iter().flatten() {
            if !warnings.contains(&warning) {
                warnings.push(warning);
            }
        }
    }
    problems.finish()?;
    Ok(warnings)
}
