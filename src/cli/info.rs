//! `etendue info`: what scenes, meshes and images hold.

use std::path::{Path, PathBuf};

use clap::Args;
use etendue::budget::human_bytes;
use etendue::error::Result;
use etendue::image::{self, Encoding, Picture};
use etendue::mesh::{self, Per, ReadOptions};
use etendue::render::{Options, SceneInfo, Session, Silent};
use serde_json::{Map, Value, json};

use super::folders::{Wanted, files};
use super::memory::RunArguments;
use super::overrides::{self, ImageArguments};
use super::scene::{SceneArguments, is_scene};
use super::{output, report, status};

/// Print what scenes, meshes and images hold
///
/// A scene is loaded and its trees are built: plugins, primitives, bounds and bytes are those of a render.
#[derive(Args, Debug)]
#[command(after_help = status::HELP)]
pub(super) struct Arguments {
    /// Scenes (.xml), meshes (.ply, .obj, .stl, .serialized, .gltf, .glb) or images, or folders of them
    #[arg(required = true, value_name = "FILE")]
    inputs: Vec<PathBuf>,
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    image: ImageArguments,
    #[command(flatten)]
    run: RunArguments,
    /// Print a JSON object for each file
    #[arg(long)]
    json: bool,
    /// No warnings
    #[arg(short, long)]
    quiet: bool,
}

/// Runs the command; the answer is the exit status.
pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    let mut worst = status::DONE;
    for input in &files(&arguments.inputs, Wanted::Any)? {
        let mut object = match info(arguments, input) {
            Ok(object) => object,
            Err(error) => {
                report::error(&error);
                worst = worst.max(status::of(&error));
                continue;
            }
        };
        if arguments.json {
            object["file"] = input.display().to_string().into();
            output::object(object);
        } else {
            output::line(&input.display().to_string());
            print(&object, 1);
        }
    }
    Ok(worst)
}

fn info(arguments: &Arguments, input: &Path) -> Result<Value> {
    let extension = mesh::extension(input);
    let is_mesh = mesh::FORMATS
        .iter()
        .any(|format| format.extensions.contains(&extension.as_str()));
    if is_scene(input) {
        scene(arguments, input)
    } else if is_mesh {
        mesh_file(arguments, input)
    } else {
        let read = image::read(input, &arguments.run.memory.budget().open())?;
        if !arguments.quiet {
            report::warnings(&read.warnings);
        }
        Ok(picture(&read))
    }
}

fn scene(arguments: &Arguments, input: &Path) -> Result<Value> {
    let scene = &arguments.scene;
    let (image, mut session) = (&arguments.image, Session::default());
    let budget = arguments.run.memory.budget();
    let read = scene.options(None);
    let mut description = scene.describe(input, &read, &budget, &mut session)?;
    let chosen = overrides::chosen(&description, image.sensors())?;
    image.overrides().apply(&mut description);
    let options = Options {
        sensor: chosen.first().map_or(0, |sensor| sensor.number),
        colors: image.colors(),
        threads: arguments.run.threads,
        ..Options::default()
    };
    let info = session.info(&description, &options, &Silent)?;
    if !arguments.quiet {
        report::warnings(&info.warnings);
    }
    let SceneInfo { files, .. } = &info;
    let bytes: u64 = files.iter().map(|f| f.bytes).sum();
    let mut object = serde_json::to_value(&info).expect("it has only names and numbers");
    object["kind"] = "scene".into();
    object["file_bytes"] = bytes.into();
    Ok(object)
}

fn mesh_file(arguments: &Arguments, input: &Path) -> Result<Value> {
    let loaded = mesh::read(input, &ReadOptions::BARE, &arguments.run.memory.budget())?;
    if !arguments.quiet {
        report::warnings(&loaded.warnings);
    }
    let mesh = &loaded.mesh;
    let attributes: Vec<Value> = mesh
        .attributes
        .iter()
        .map(|attribute| {
            json!({
                "name": attribute.name,
                "channels": attribute.channels,
                "per": match attribute.per {
                    Per::Vertex => "vertex",
                    Per::Face => "face",
                },
            })
        })
        .collect();
    let bounds = mesh
        .bounds()
        .map(|(low, high)| [low.to_array(), high.to_array()]);
    Ok(json!({
        "kind": "mesh",
        "triangles": mesh.triangles.len(),
        "dropped_triangles": loaded.dropped_triangles,
        "vertices": mesh.positions.len(),
        "normals": !mesh.normals.is_empty(),
        "texture_coordinates": !mesh.uvs.is_empty(),
        "attributes": attributes,
        "bounds": bounds.map(|[min, max]| json!({ "min": min, "max": max })),
        "area": mesh.area(),
        "geometry_bytes": mesh.bytes(),
    }))
}

fn picture(picture: &Picture) -> Value {
    let image = &picture.image;
    let count = image.channels().len();
    let channels: Vec<Value> = image
        .channels()
        .iter()
        .enumerate()
        .map(|(c, name)| {
            let values = || image.data().iter().skip(c).step_by(count).copied();
            let finite = || values().filter(|v| v.is_finite());
            let n = finite().count();
            json!({
                "name": name,
                "least": finite().reduce(f32::min),
                "mean": (n > 0).then(|| finite().map(f64::from).sum::<f64>() / n as f64),
                "greatest": finite().reduce(f32::max),
                "not_finite": values().count() - n,
            })
        })
        .collect();
    let mut layers: Vec<&str> = Vec::new();
    for name in image.channels() {
        let layer = name.rsplit_once('.').map_or("", |(layer, _)| layer);
        if !layer.is_empty() && !layers.contains(&layer) {
            layers.push(layer);
        }
    }
    let metadata: serde_json::Map<String, Value> = picture
        .metadata
        .iter()
        .map(|(name, value)| (name.clone(), value.clone().into()))
        .collect();
    json!({
        "kind": "image",
        "size": { "width": image.width(), "height": image.height() },
        "encoding": match picture.encoding {
            Encoding::Linear => "linear",
            Encoding::Srgb => "sRGB",
        },
        "channels": channels,
        "layers": layers,
        "metadata": metadata,
    })
}

/// An object for people: a line a value, what is nested further to the right.
pub(super) fn print(value: &Value, level: usize) {
    let Value::Object(object) = value else {
        return;
    };
    for (name, value) in object {
        let label = format!("{}{}", "  ".repeat(level), name.replace('_', " "));
        match value {
            Value::Object(inner) if !inner.is_empty() && pair(inner).is_none() => {
                output::line(&label);
                print(value, level + 1);
            }
            Value::Array(entries) if entries.iter().any(Value::is_object) => {
                output::line(&label);
                for entry in entries {
                    let text = text(entry);
                    output::line(&format!("{}{text}", "  ".repeat(level + 1)));
                }
            }
            _ => {
                let bytes = value.as_u64().filter(|_| name.ends_with("bytes"));
                let text = bytes.map_or_else(|| text(value), human_bytes);
                output::line(&format!("{label:28} {text}"));
            }
        }
    }
}

/// Two numbers or corners that need no names for people.
fn pair(object: &Map<String, Value>) -> Option<String> {
    let names = [("width", "height", ", "), ("min", "max", " to ")];
    let (a, b, between) = names.into_iter().find(|(a, ..)| object.contains_key(*a))?;
    let (a, b) = (object.get(a)?, object.get(b)?);
    (object.len() == 2).then(|| format!("{}{between}{}", text(a), text(b)))
}

/// A value on one line.
fn text(value: &Value) -> String {
    match value {
        Value::Null => "none".to_owned(),
        Value::Bool(yes) => if *yes { "yes" } else { "no" }.to_owned(),
        Value::Number(number) if number.is_f64() => {
            // Most were floats of seven digits.
            (number.as_f64().unwrap_or_default() as f32).to_string()
        }
        Value::Number(number) => number.to_string(),
        Value::String(text) => text.clone(),
        Value::Array(values) if values.is_empty() => "none".to_owned(),
        Value::Array(values) => values.iter().map(text).collect::<Vec<_>>().join(", "),
        Value::Object(object) if object.is_empty() => "none".to_owned(),
        Value::Object(object) if pair(object).is_some() => pair(object).unwrap_or_default(),
        Value::Object(object) => {
            let title = ["name", "id", "path"]
                .into_iter()
                .find(|key| object.contains_key(*key));
            let fields: Vec<String> = object
                .iter()
                .filter(|(name, value)| !value.is_null() && Some(name.as_str()) != title)
                .map(
                    |(name, value)| match value.as_u64().filter(|_| name == "bytes") {
                        Some(bytes) => human_bytes(bytes),
                        None => format!("{} {}", name.replace('_', " "), text(value)),
                    },
                )
                .collect();
            let title = title
                .map(|key| &object[key])
                .filter(|title| !title.is_null());
            let title = title.map_or_else(String::new, |title| format!("{}: ", text(title)));
            title + &fields.join(", ")
        }
    }
}
