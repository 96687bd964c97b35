//! Folders among inputs: what stands in them in their place, and where a folder is to hold what comes out.

use std::borrow::Cow;
use std::path::{MAIN_SEPARATOR, Path, PathBuf};

use etendue::error::{Error, Result};
use etendue::render::is_mesh;

use super::scene::{is_image, is_scene};

/// What of a folder is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wanted {
    /// Scenes and meshes.
    Scenes,
    Images,
    /// Both.
    Any,
}

impl Wanted {
    fn is(self, path: &Path) -> bool {
        let [scene, image] = [is_scene(path) || is_mesh(path), is_image(path)];
        (scene && self != Self::Images) || (image && self != Self::Scenes)
    }

    fn named(self) -> &'static str {
        match self {
            Self::Scenes => "no scene and no mesh",
            Self::Images => "no image",
            Self::Any => "no scene, no mesh and no image",
        }
    }
}

/// The inputs, with what is wanted of folders among them by name in place of these.
pub(super) fn files(inputs: &[PathBuf], wanted: Wanted) -> Result<Vec<PathBuf>> {
    let mut all = Vec::with_capacity(inputs.len());
    for input in inputs {
        if !input.is_dir() {
            all.push(input.clone());
            continue;
        }
        let refused = |e: std::io::Error| Error::system("read", input, &e);
        let entries = std::fs::read_dir(input).map_err(refused)?;
        let mut files = Vec::new();
        for entry in entries {
            let path = entry.map_err(refused)?.path();
            if wanted.is(&path) && path.is_file() {
                files.push(path);
            }
        }
        if files.is_empty() {
            let message = format!("{} is in the folder {}", wanted.named(), input.display());
            return Err(Error::input(message).help("folders in it are not looked into"));
        }
        files.sort();
        all.append(&mut files);
    }
    Ok(all)
}

/// Where images go: into a folder as pictures with the inputs' names, and the eyes' where there are several.
pub(super) fn pattern(output: &str, eyes: usize) -> Cow<'_, str> {
    if output.ends_with(['/', MAIN_SEPARATOR]) || Path::new(output).is_dir() {
        let folder = output.trim_end_matches(['/', MAIN_SEPARATOR]);
        let eye = if eyes > 1 { "-{eye}" } else { "" };
        return format!("{folder}/{{name}}{eye}.png").into();
    }
    output.into()
}
