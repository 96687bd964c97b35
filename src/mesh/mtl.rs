//! Wavefront MTL, as far as a mesh shows it: the diffuse colour `Kd` of each `newmtl`, taken as linear RGB,
//! which is what Mitsuba 0.6 took it for. A material that stands in several libraries is that of the first,
//! as the format's specification has it. A library that cannot be read is worth a warning, not an error: the
//! mesh is there without it.

use std::collections::HashMap;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::file::text;

/// The linear RGB reflectance of what has no colour of its own, in a mesh where other faces have, and of a
/// whole bare mesh: clay.
pub const BARE_COLOR: [f32; 3] = [0.65, 0.6, 0.52];

/// No library is larger, in bytes; all materials of a mesh and its libraries are no more.
const LARGEST: u64 = 16 << 20;
const MOST_MATERIALS: usize = 1 << 16;
const MOST_LIBRARIES: usize = 64;

/// The materials of all libraries of a mesh.
#[derive(Debug, Default)]
pub(super) struct Materials {
    /// By name; `None`: without a colour that can be shown.
    colors: HashMap<Vec<u8>, Option<[f32; 3]>>,
    /// What was odd, in words.
    pub(super) warnings: Vec<String>,
    /// Libraries read or tried.
    pub(super) libraries: Vec<PathBuf>,
    /// Whether a material has a picture for its colour.
    textured: bool,
    /// Materials beyond [`MOST_MATERIALS`].
    left_out: usize,
    /// `Kd` lines that say no colour.
    unusable: usize,
}

impl Materials {
    /// Reads the libraries that the `mtllib` lines of the file `mesh` name: `named` is what follows the word.
    pub(super) fn read(mesh: &Path, named: &[Vec<u8>]) -> Self {
        let mut materials = Self::default();
        let folder = mesh.parent().unwrap_or(Path::new(""));
        for line in named {
            let line = String::from_utf8_lossy(line).replace('\\', "/");
            // A line names several files, or one with blanks in its name.
            let whole = folder.join(&line);
            if whole.is_file() {
                materials.library(whole);
            } else {
                for name in line.split_ascii_whitespace() {
                    materials.library(folder.join(name));
                }
            }
        }
        materials.summarize();
        materials
    }

    /// The colour of the material called `name`; `None` where there is no such material or it has none.
    pub(super) fn color(&self, name: &[u8]) -> Option<[f32; 3]> {
        self.colors.get(name).copied().flatten()
    }

    /// Whether there is a material called `name`.
    pub(super) fn has(&self, name: &[u8]) -> bool {
        self.colors.contains_key(name)
    }

    fn library(&mut self, path: PathBuf) {
        if self.libraries.len() > MOST_LIBRARIES || self.libraries.contains(&path) {
            return;
        }
        if self.libraries.len() == MOST_LIBRARIES {
            self.warnings.push(format!(
                "only the first {MOST_LIBRARIES} material libraries are read"
            ));
        } else {
            match bytes(&path) {
                Ok(bytes) => self.parse(&bytes),
                Err(why) => self.warnings.push(format!(
                    "the material library {} cannot be read: {why}",
                    path.display()
                )),
            }
        }
        self.libraries.push(path);
    }

    fn parse(&mut self, bytes: &[u8]) {
        let mut current = None;
        for line in text::lines(bytes) {
            let (keyword, rest) = keyword(line);
            match keyword.to_ascii_lowercase().as_slice() {
                b"newmtl" => {
                    self.keep(current.take());
                    current = Some((rest.to_vec(), None));
                }
                b"kd" => match (&mut current, color(rest)) {
                    (Some((_, color)), Some(said)) => *color = Some(said),
                    _ => self.unusable += 1,
                },
                b"map_kd" => self.textured = true,
                _ => {}
            }
        }
        self.keep(current);
    }

    fn keep(&mut self, material: Option<(Vec<u8>, Option<[f32; 3]>)>) {
        let Some((name, color)) = material else {
            return;
        };
        if self.colors.len() < MOST_MATERIALS {
            self.colors.entry(name).or_insert(color);
        } else if !self.colors.contains_key(&name) {
            self.left_out += 1;
        }
    }

    fn summarize(&mut self) {
        if self.textured {
            let message = "map_Kd is not shown: faces have the colour Kd of their material";
            self.warnings.push(message.to_owned());
        }
        for (count, what) in [
            (
                self.unusable,
                "lines Kd passed over: wanted is a material's one or three numbers from 0 to 1",
            ),
            (
                self.left_out,
                "materials left out: a mesh can have 65536 of them",
            ),
        ] {
            if count > 0 {
                self.warnings.push(format!("{count} {what}"));
            }
        }
    }
}

/// The first word of `line`, and the rest without blanks around it.
pub(super) fn keyword(line: &[u8]) -> (&[u8], &[u8]) {
    let line = line.trim_ascii();
    let end = line.iter().position(u8::is_ascii_whitespace);
    let (keyword, rest) = line.split_at(end.unwrap_or(line.len()));
    (keyword, rest.trim_ascii_start())
}

/// `r g b`, or one number for all three.
fn color(text: &[u8]) -> Option<[f32; 3]> {
    let text = text.split(|&b| b == b'#').next()?;
    let mut numbers = std::str::from_utf8(text).ok()?.split_ascii_whitespace();
    let mut number = || -> Option<Option<f32>> {
        let word = numbers.next()?;
        Some(word.parse().ok().filter(|v| (0.0..=1.0).contains(v)))
    };
    let red = number()??;
    let Some(green) = number() else {
        return Some([red; 3]);
    };
    Some([red, green?, number()??])
}

/// The whole file, or what is wrong, in words.
fn bytes(path: &Path) -> Result<Vec<u8>, String> {
    // Asked before it is opened, for opening a pipe may wait for ever.
    let about = std::fs::metadata(path).map_err(|e| e.to_string())?;
    if !about.is_file() {
        return Err("it is no regular file".to_owned());
    }
    if about.len() > LARGEST {
        return Err(format!("it is larger than {} MiB", LARGEST >> 20));
    }
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(|e| e.to_string())?;
    let read = file.take(LARGEST).read_to_end(&mut bytes);
    read.map_err(|e| e.to_string())?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &[u8]) -> Materials {
        let mut materials = Materials::default();
        materials.parse(text);
        materials.summarize();
        materials
    }

    #[test]
    fn colours_are_taken_as_they_stand_and_the_first_of_a_name_holds() {
        let materials = parse(
            b"\xef\xbb\xbfnewmtl red\r\n\tKd 0.8 .1 0 # bright\r\nKs 1 1 1\r\nnewmtl two words \nKd 0.25\n\
              newmtl red\nKd 0 0 1\nnewmtl none\n",
        );
        assert_eq!(materials.color(b"red"), Some([0.8, 0.1, 0.0]));
        assert_eq!(materials.color(b"two words"), Some([0.25; 3]));
        assert!(materials.has(b"none") && materials.color(b"none").is_none());
        assert!(!materials.has(b"two") && materials.warnings.is_empty());
    }

    #[test]
    fn malformed_libraries_give_no_colour_and_one_warning() {
        for text in [
            &b"newmtl a\nKd"[..],
            b"newmtl a\nKd 1 1",
            b"newmtl a\nKd 1 nan 1",
            b"newmtl a\nKd -1 0 0",
            b"newmtl a\nKd 1e99 0 0\nKd inf\n",
            b"newmtl a\nKd spectral a.rfl 1",
            b"newmtl a\nKd \xff\xfe\x00 0 0",
            b"Kd 1 1 1\nnewmtl a",
        ] {
            let materials = parse(text);
            let shown = String::from_utf8_lossy(text);
            assert!(materials.color(b"a").is_none(), "{shown}");
            assert_eq!(materials.warnings.len(), 1, "{shown}");
        }
        for text in [&b""[..], b"\0\0\n\n \r\n", b"newmtl", b"newmtl\nnewmtl \n"] {
            let materials = parse(text);
            assert!(materials.color(b"").is_none() && materials.warnings.is_empty());
        }
    }

    #[test]
    fn materials_libraries_and_their_sizes_are_bounded() {
        let text: String = (0..MOST_MATERIALS + 2)
            .map(|i| format!("newmtl {i}\nKd 1\n"))
            .collect();
        let materials = parse(text.as_bytes());
        assert_eq!(materials.colors.len(), MOST_MATERIALS);
        assert!(materials.warnings[0].starts_with("2 materials left out"));

        let folder = tempfile::tempdir().unwrap();
        let large = File::create(folder.path().join("large.mtl")).unwrap();
        large.set_len(LARGEST + 1).unwrap();
        std::fs::create_dir(folder.path().join("folder.mtl")).unwrap();
        let mesh = folder.path().join("mesh.obj");
        let named = [b"large.mtl folder.mtl large.mtl".to_vec()];
        let warnings = Materials::read(&mesh, &named).warnings;
        assert_eq!(warnings.len(), 2);
        assert!(warnings[0].ends_with("larger than 16 MiB"));
        assert!(warnings[1].ends_with("no regular file"));

        let many: Vec<_> = (0..1000).map(|i| format!("{i}.mtl").into_bytes()).collect();
        let warnings = Materials::read(&mesh, &many).warnings;
        assert_eq!(warnings.len(), MOST_LIBRARIES + 1);
    }
}
