//! What an image depends on, as hashes: two renders of the same fingerprint have the same bits, so that a
//! checkpoint of one may be continued by the other; and a scene whose key is that of the scene in memory
//! need not be loaded again. Threads and the way rays find shapes are left out: the bits do not depend on
//! them.

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

use blake3::Hasher;
use serde::{Deserialize, Serialize};

use super::options::{Colors, Options};
use super::plan::{PASS, TILE};
use crate::description::{Canonical, Description, NodeId, Part};
use crate::error::{Error, Result};
use crate::file;
use crate::film::BLOCK;

/// What an image depends on, part by part.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Fingerprint {
    /// Of Étendue.
    version: String,
    /// Shapes, materials and lights.
    scene: String,
    /// Meshes and images, with the files that they name.
    files: Vec<FileHash>,
    /// Sensor, film, sampler and integrator.
    view: String,
    /// Seed and colours.
    settings: String,
    /// The texts that say scene and view: they tell which of them is another, and may differ in what does not matter.
    sources: Vec<FileHash>,
}

/// A file and what it holds.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct FileHash {
    /// As it was found: it may be another after a move of the folder.
    name: String,
    /// Of its content; `None`: it cannot be read, which may be no error.
    hash: Option<String>,
}

/// The content of the files of a scene.
#[derive(Clone, Debug)]
pub(super) struct Contents {
    files: Vec<FileHash>,
    sources: Vec<FileHash>,
}

impl Contents {
    /// Reads all files that the scene names, and those that were read because these name them (`named`), each once:
    /// it takes the time to read them.
    pub(super) fn read(description: &Description, named: &[PathBuf]) -> Result<Self> {
        let mut files = Vec::new();
        let mut seen = HashSet::new();
        for path in description.files(Part::Scene) {
            if seen.insert(resolved(&path)) {
                let hash = hash_file(&path).map_err(|e| Error::system("read", &path, &e))?;
                files.push(FileHash::new(&path, Some(hash)));
            }
        }
        for path in named {
            if seen.insert(resolved(path)) {
                files.push(FileHash::new(path, hash_file(path).ok()));
            }
        }
        let mut sources = Vec::new();
        for path in description.sources() {
            if seen.insert(resolved(path)) {
                sources.push(FileHash::new(path, hash_file(path).ok()));
            }
        }
        Ok(Self { files, sources })
    }
}

impl FileHash {
    fn new(path: &Path, hash: Option<String>) -> Self {
        Self {
            name: path.display().to_string(),
            hash,
        }
    }
}

impl Fingerprint {
    /// With the [`Contents`] of the scene's files.
    pub(super) fn new(
        description: &Description,
        sensor: NodeId,
        contents: &Contents,
        options: &Options,
    ) -> Result<Self> {
        let scene = description.canonical(Part::Scene);
        let view = description.canonical(Part::View(sensor));
        let Contents { mut files, sources } = contents.clone();
        for path in &view.files {
            let hash = hash_file(path).map_err(|e| Error::system("read", path, &e))?;
            files.push(FileHash::new(path, Some(hash)));
        }
        let bands = match options.colors {
            Colors::Rgb => "0".to_owned(),
            Colors::Bands { count, range } => match range {
                None => format!("{count}"),
                Some([first, last]) => format!("{count} from {first} to {last} nm"),
            },
        };
        let settings = format!(
            "seed {} bands {bands} tile {TILE} passes 1, {PASS} block {BLOCK} {:?}",
            options.seed, options.adaptive
        );
        let settings = match options.gaze {
            Some(gaze) => format!("{settings} gaze {gaze:?}"),
            None => settings,
        };
        Ok(Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            scene: hash(&scene.text),
            files,
            view: hash(&view.text),
            settings: hash(&settings),
            sources,
        })
    }

    /// The files that it names beside those of the view, which has them anew.
    pub(super) fn named(&self, description: &Description, sensor: NodeId) -> Vec<PathBuf> {
        let of_view = description.canonical(Part::View(sensor)).files.len();
        let of_scene = self.files.len().saturating_sub(of_view);
        let files = self.files[..of_scene].iter();
        files.map(|file| PathBuf::from(&file.name)).collect()
    }

    /// What is not the same in `other`, in words.
    pub(super) fn difference(&self, other: &Self) -> Option<String> {
        let sources = || match &changed(&self.sources, &other.sources)[..] {
            [] => String::new(),
            names => format!("; see {}", names[..names.len().min(3)].join(", ")),
        };
        if self.version != other.version {
            Some("the version of Étendue".to_owned())
        } else if self.scene != other.scene {
            let sources = sources();
            Some(format!(
                "the scene (its shapes, materials or lights{sources})"
            ))
        } else if let Some(name) = changed(&self.files, &other.files).first() {
            Some(format!("the file {name}"))
        } else if self.view != other.view {
            let sources = sources();
            Some(format!(
                "the view (sensor, film, sampler or integrator, or an option for them{sources})"
            ))
        } else if self.settings != other.settings {
            Some("a setting (the seed, the bands, adaptive sampling or the gaze)".to_owned())
        } else {
            None
        }
    }
}

/// The files of one list whose content is not that of their counterparts in the other.
fn changed<'a>(these: &'a [FileHash], others: &'a [FileHash]) -> Vec<&'a str> {
    let common = these.iter().zip(others);
    let differ = common.filter(|(this, other)| this.hash != other.hash);
    let (fewer, more) = match these.len() < others.len() {
        true => (these, others),
        false => (others, these),
    };
    let all = differ.map(|(this, _)| this).chain(&more[fewer.len()..]);
    all.map(|file| file.name.as_str()).collect()
}

/// The same file under the one name that it has, whatever the way to it.
fn resolved(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}

fn hash(text: &str) -> String {
    blake3::hash(text.as_bytes()).to_hex().to_string()
}

pub(super) fn hash_file(path: &Path) -> std::io::Result<String> {
    let mut hasher = Hasher::new();
    hasher.update_reader(file::open(path)?)?;
    Ok(hasher.finalize().to_hex().to_string())
}

/// Names the scene part of a description within this process: files stand with their [stamps](stamps) in place of their
/// content.
pub(super) fn scene_key(description: &Description) -> String {
    let Canonical { text, files } = description.canonical(Part::Scene);
    hash(&format!("{text}{}", stamps(&files)))
}

/// Lengths and times of change of files.
pub(super) fn stamps(files: &[PathBuf]) -> String {
    let stamp = |file: &PathBuf| {
        let about = fs::metadata(file).ok();
        let stamp = about.map(|m| (m.len(), m.modified().ok()));
        format!("{}\0{stamp:?}\0", file.display())
    };
    files.iter().map(stamp).collect()
}
