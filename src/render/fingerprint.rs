//! What an image depends on, as hashes: two renders of the same fingerprint have the same bits, so that a
//! checkpoint of one may be continued by the other; and a scene whose key is that of the scene in memory
//! need not be loaded again. Threads and the way rays find shapes are left out: the bits do not depend on
//! them.

use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

use blake3::Hasher;
use serde::{Deserialize, Serialize};

use super::blocks::BLOCK;
use super::options::{Colors, Options};
use super::plan::{PASS, TILE};
use crate::description::{Canonical, Description, NodeId, Part};
use crate::error::{Error, Result};
use crate::mesh;

/// What an image depends on, part by part.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Fingerprint {
    /// Of Étendue.
    version: String,
    /// Shapes, materials and lights.
    scene: String,
    /// Contents of meshes and images.
    files: String,
    /// Sensor, film, sampler and integrator.
    view: String,
    /// Seed and colours.
    settings: String,
}

impl Fingerprint {
    /// With the [`contents`] of the files that the scene names.
    pub(super) fn new(
        description: &Description,
        sensor: NodeId,
        contents: &str,
        options: &Options,
    ) -> Result<Self> {
        let scene = description.canonical(Part::Scene);
        let view = description.canonical(Part::View(sensor));
        let mut files = Hasher::new();
        files.update(contents.as_bytes());
        for path in &view.files {
            hash_file(&mut files, path)?;
        }
        let bands = match options.colors {
            Colors::Rgb => 0,
            Colors::Bands(n) => n,
        };
        let settings = format!(
            "seed {} bands {bands} tile {TILE} pass {PASS} block {BLOCK} {:?}",
            options.seed, options.adaptive
        );
        Ok(Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            scene: hash(&scene.text),
            files: hex(&files),
            view: hash(&view.text),
            settings: hash(&settings),
        })
    }

    /// What is not the same in `other`, in words.
    pub(super) fn difference(&self, other: &Self) -> Option<&'static str> {
        [
            (&self.version, &other.version, "the version of Étendue"),
            (
                &self.scene,
                &other.scene,
                "the scene (its shapes, materials or lights)",
            ),
            (
                &self.files,
                &other.files,
                "a mesh or an image that the scene names",
            ),
            (
                &self.view,
                &other.view,
                "the view (sensor, film, sampler or integrator, or an option for them)",
            ),
            (
                &self.settings,
                &other.settings,
                "a setting (the seed, the bands or adaptive sampling)",
            ),
        ]
        .into_iter()
        .find(|(a, b, _)| a != b)
        .map(|(_, _, what)| what)
    }
}

/// The hash of all files that the scene names: it takes the time to read them.
pub(super) fn contents(description: &Description) -> Result<String> {
    let mut hasher = Hasher::new();
    for path in description.files(Part::Scene) {
        hash_file(&mut hasher, &path)?;
    }
    Ok(hex(&hasher))
}

fn hash(text: &str) -> String {
    blake3::hash(text.as_bytes()).to_hex().to_string()
}

fn hex(hasher: &Hasher) -> String {
    hasher.finalize().to_hex().to_string()
}

/// Adds a file's length and content, and those of the files that a glTF file names in its turn.
fn hash_file(hasher: &mut Hasher, path: &Path) -> Result<()> {
    let refused = |e: std::io::Error| Error::system("read", path, &e);
    let file = File::open(path).map_err(refused)?;
    let length = file.metadata().map_err(refused)?.len();
    hasher.update(&length.to_le_bytes());
    hasher.update_reader(file.take(length)).map_err(refused)?;
    for buffer in buffers(path) {
        hash_file(hasher, &buffer)?;
    }
    Ok(())
}

/// The largest glTF file that is searched for names.
const MAX_GLTF: u64 = 256 << 20;

/// The existing files that a glTF file (as text) names; none of other files, nor where it is damaged,
/// which is for its reader to say.
fn buffers(path: &Path) -> Vec<PathBuf> {
    let read = || {
        let mut text = Vec::new();
        let contents = mesh::contents(path).ok()?;
        contents.take(MAX_GLTF).read_to_end(&mut text).ok()?;
        Some(text)
    };
    let is_gltf = mesh::extension(path) == "gltf";
    let text = is_gltf.then(read).flatten();
    let Some(json) = text.and_then(|text| serde_json::from_slice::<serde_json::Value>(&text).ok())
    else {
        return Vec::new();
    };
    let entries = ["buffers", "images"].map(|list| json[list].as_array().cloned());
    let folder = path.parent().unwrap_or(Path::new(""));
    let uris = entries.into_iter().flatten().flatten();
    uris.filter_map(|entry| Some(folder.join(entry["uri"].as_str()?)))
        .filter(|file| file != path && file.is_file())
        .collect()
}

/// Names the scene part of a description within this process: files stand with their length and time of
/// change in place of their content.
pub(super) fn scene_key(description: &Description) -> String {
    let Canonical { text, files } = description.canonical(Part::Scene);
    let mut hasher = Hasher::new();
    hasher.update(text.as_bytes());
    for file in files {
        let stamp = fs::metadata(&file)
            .ok()
            .map(|m| (m.len(), m.modified().ok()));
        hasher.update(format!("{}\0{stamp:?}\0", file.display()).as_bytes());
    }
    hex(&hasher)
}
