//! Wavefront MTL, as far as a mesh shows it: the diffuse colour `Kd` of each `newmtl`, taken as linear RGB,
//! which is what Mitsuba 0.6 took it for; of a file that is all there is also the images `map_Kd`, `map_d`, `map_Ke` and
//! `norm`, the opacity `d`, the emission `Ke`, and roughness and metal (`Pr`, `Pm` and their maps, an extension that modelling
//! programs write). An image is scaled and moved by `-s` and `-o` and clamped by `-clamp on`; other options are passed over. A
//! material that stands in several libraries is that of the first, as the format's specification has it. A library that
//! cannot be read is worth a warning, not an error: the mesh is there without it.

use std::collections::{BTreeSet, HashMap};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use glam::{Mat3, Vec2};

use super::surface::{Map, Surface};
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
    materials: HashMap<Vec<u8>, Material>,
    /// What was odd, in words.
    pub(super) warnings: Vec<String>,
    /// Libraries read or tried.
    pub(super) libraries: Vec<PathBuf>,
    /// Whether more than colours is wanted.
    whole: bool,
    /// The words of what is not shown.
    unseen: BTreeSet<&'static str>,
    /// Materials beyond [`MOST_MATERIALS`].
    left_out: usize,
    /// Lines that do not say what they should, and where the first of them stands.
    unusable: usize,
    first_unusable: Option<String>,
}

/// What is shown of a material.
#[derive(Clone, Debug, PartialEq)]
struct Material {
    /// `None`: without a colour that can be shown.
    color: Option<[f32; 3]>,
    surface: Surface,
    /// Whether `Tr` says that it is see-through: programs disagree on which way that counts.
    has_tr: bool,
}

impl Materials {
    /// Reads the libraries that the `mtllib` lines of the file `mesh` name: `named` is what follows the word. Of a file that
    /// is the `whole` of what is there, more than colours is wanted.
    pub(super) fn read(mesh: &Path, named: &[Vec<u8>], whole: bool) -> Self {
        let mut materials = Self {
            whole,
            ..Self::default()
        };
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
        let Material { color, surface, .. } = self.materials.get(name)?;
        // Many programs write no colour, or black, where an image has the say.
        let textured = surface.maps.color.is_some();
        match color {
            None | Some([0.0, 0.0, 0.0]) if textured => Some([1.0; 3]),
            color => *color,
        }
    }

    /// The rest of it; matte where there is no such material.
    pub(super) fn surface(&self, name: &[u8]) -> Surface {
        let known = self.materials.get(name);
        known.map_or(Surface::MATTE, |material| material.surface.clone())
    }

    /// Whether there is a material called `name`.
    pub(super) fn has(&self, name: &[u8]) -> bool {
        self.materials.contains_key(name)
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
                Ok(bytes) => self.parse(&bytes, &path),
                Err(why) => self.warnings.push(format!(
                    "the material library {} cannot be read: {why}",
                    path.display()
                )),
            }
        }
        self.libraries.push(path);
    }

    fn parse(&mut self, bytes: &[u8], library: &Path) {
        let folder = library.parent().unwrap_or(Path::new(""));
        let mut current = None;
        for (number, line) in text::lines(bytes).enumerate() {
            let (keyword, rest) = keyword(line);
            let keyword = keyword.to_ascii_lowercase();
            if keyword == b"newmtl" {
                self.keep(current.take());
                let empty = Material {
                    color: None,
                    surface: Surface::MATTE,
                    has_tr: false,
                };
                current = Some((rest.to_vec(), empty));
                continue;
            }
            let material = current.as_mut().map(|(_, material)| material);
            let understood = if keyword == b"kd" {
                let said = color(rest);
                material
                    .zip(said)
                    .map(|(material, said)| material.color = Some(said))
            } else if self.whole {
                self.rest(&keyword, rest, folder, material)
            } else {
                if keyword == b"map_kd" {
                    self.unseen.insert("map_Kd");
                }
                Some(())
            };
            if understood.is_none() {
                self.unusable += 1;
                let place = || format!("{}:{}", library.display(), number + 1);
                self.first_unusable.get_or_insert_with(place);
            }
        }
        self.keep(current);
    }

    /// A line that says more than a colour; `None` where it does not say it right.
    fn rest(
        &mut self,
        keyword: &[u8],
        rest: &[u8],
        folder: &Path,
        material: Option<&mut Material>,
    ) -> Option<()> {
        const UNSEEN: [(&[u8], &str); 9] = [
            (b"map_bump", "map_Bump"),
            (b"bump", "map_Bump"),
            (b"disp", "disp"),
            (b"map_ks", "map_Ks"),
            (b"map_ns", "map_Ns"),
            (b"refl", "refl"),
            (b"decal", "decal"),
            (b"tf", "Tf"),
            (b"map_tr", "map_Tr"),
        ];
        let unseen = UNSEEN.iter().filter(|(word, _)| *word == keyword);
        self.unseen.extend(unseen.map(|(_, name)| name));
        let number = || Some(color(rest)?[0]);
        let mut unplaced = None;
        let surface = match material {
            Some(material) => {
                material.has_tr |= keyword == b"tr" && number()? > 0.0;
                &mut material.surface
            }
            None => unplaced.insert(Surface::MATTE),
        };
        let maps = &mut surface.maps;
        match keyword {
            b"d" => surface.opacity = number()?,
            b"pr" => surface.roughness = number()?,
            b"pm" => surface.metallic = number()?,
            b"ke" => surface.emission = emission(rest)?,
            b"map_kd" => maps.color = Some(map(rest, folder)?),
            b"map_ke" => maps.emission = Some(map(rest, folder)?),
            b"map_d" => maps.opacity = Some(map(rest, folder)?),
            b"map_pr" => maps.roughness = Some(map(rest, folder)?.by("r")),
            b"map_pm" => maps.metallic = Some(map(rest, folder)?.by("r")),
            b"norm" => maps.normal = Some(map(rest, folder)?),
            _ => return Some(()),
        }
        // What stands before the first material is nobody's.
        unplaced.is_none().then_some(())
    }

    fn keep(&mut self, material: Option<(Vec<u8>, Material)>) {
        let Some((name, mut material)) = material else {
            return;
        };
        material.complete();
        if material.has_tr && material.surface.opacity == 1.0 {
            self.unseen.insert("Tr (write d)");
        }
        if self.materials.len() < MOST_MATERIALS {
            self.materials.entry(name).or_insert(material);
        } else if !self.materials.contains_key(&name) {
            self.left_out += 1;
        }
    }

    fn summarize(&mut self) {
        if !self.unseen.is_empty() {
            let names: Vec<&str> = self.unseen.iter().copied().collect();
            let names = names.join(", ");
            self.warnings
                .push(format!("not shown of the materials: {names}"));
        }
        if let Some(place) = &self.first_unusable {
            let lines = match self.unusable {
                1 => "1 line".to_owned(),
                many => format!("{many} lines"),
            };
            self.warnings.push(format!(
                "{lines} of material libraries passed over, the first at {place}: wanted is a material's one or three \
                 numbers from 0 to 1, or an image"
            ));
        }
        if self.left_out > 0 {
            let message = "materials left out: a mesh can have 65536 of them";
            self.warnings.push(format!("{} {message}", self.left_out));
        }
    }
}

impl Material {
    /// Takes what one line says together with what others do.
    fn complete(&mut self) {
        let Surface {
            emission,
            opacity,
            maps,
            metallic,
            roughness,
            ..
        } = &mut self.surface;
        if let Some(map) = &mut maps.opacity {
            // Where it is the colours' image, it is that one's opacity that is meant.
            let of_colors = maps.color.as_ref().is_some_and(|c| c.path == map.path);
            map.channel = if of_colors { "a" } else { "r" };
        }
        if maps.emission.is_some() && *emission == [0.0; 3] {
            *emission = [1.0; 3];
        }
        *emission = emission.map(|part| part * *opacity);
        if maps.metallic.is_some() && *metallic == 0.0 {
            *metallic = 1.0;
        }
        if maps.roughness.is_some() && *roughness == 0.0 {
            *roughness = 1.0;
        }
    }
}

/// An image, after its options: scale and offset of texture coordinates that run from the bottom, and what is beyond the
/// edge.
fn map(text: &[u8], folder: &Path) -> Option<Map> {
    let text = std::str::from_utf8(text).ok()?;
    let (mut scale, mut offset) = (Vec2::ONE, Vec2::ZERO);
    let mut wrap = ["repeat"; 2];
    let mut rest = text.trim();
    while let Some(option) = rest.strip_prefix('-') {
        let (name, after) = option.split_once(|c: char| c.is_ascii_whitespace())?;
        rest = after.trim_start();
        // One to three numbers, or a word; the last word is the image.
        let mut words = Vec::new();
        let most = match name {
            "s" | "o" | "t" => 3,
            "mm" => 2,
            _ => 1,
        };
        while words.len() < most {
            let Some((word, after)) = rest.split_once(|c: char| c.is_ascii_whitespace()) else {
                break;
            };
            if !words.is_empty() && word.parse::<f32>().is_err() {
                break;
            }
            words.push(word);
            rest = after.trim_start();
        }
        if words.is_empty() {
            return None;
        }
        let number = |place: usize, other: f32| match words.get(place) {
            None => Some(other),
            Some(word) => word.parse().ok().filter(|number: &f32| number.is_finite()),
        };
        match name {
            "s" => scale = Vec2::new(number(0, 1.0)?, number(1, 1.0)?),
            "o" => offset = Vec2::new(number(0, 0.0)?, number(1, 0.0)?),
            "clamp" if words == ["on"] => wrap = ["clamp"; 2],
            _ => {}
        }
    }
    if rest.is_empty() {
        return None;
    }
    let path = folder.join(rest.replace('\\', "/"));
    // The mesh's run from the top.
    let moved = Vec2::new(offset.x, 1.0 - scale.y - offset.y);
    let to_uv = Mat3::from_translation(moved) * Mat3::from_scale(scale);
    if !to_uv.is_finite() {
        return None;
    }
    Some(Map {
        wrap,
        to_uv,
        ..Map::of(path)
    })
}

/// The first word of `line`, and the rest without blanks around it.
pub(super) fn keyword(line: &[u8]) -> (&[u8], &[u8]) {
    let line = line.trim_ascii();
    let end = line.iter().position(u8::is_ascii_whitespace);
    let (keyword, rest) = line.split_at(end.unwrap_or(line.len()));
    (keyword, rest.trim_ascii_start())
}

/// A colour of numbers from 0 to 1.
fn color(text: &[u8]) -> Option<[f32; 3]> {
    numbers(text, 1.0)
}

/// A colour of light.
fn emission(text: &[u8]) -> Option<[f32; 3]> {
    numbers(text, f32::MAX)
}

/// `r g b`, or one number for all three, from 0 to `most`.
fn numbers(text: &[u8], most: f32) -> Option<[f32; 3]> {
    let text = text.split(|&b| b == b'#').next()?;
    let mut numbers = std::str::from_utf8(text).ok()?.split_ascii_whitespace();
    let mut number = || -> Option<Option<f32>> {
        let word = numbers.next()?;
        Some(word.parse().ok().filter(|v| (0.0..=most).contains(v)))
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
        let mut materials = Materials {
            whole: true,
            ..Materials::default()
        };
        materials.parse(text, Path::new("there/a.mtl"));
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
    fn images_and_what_is_done_to_them_are_read_with_blanks_in_their_names() {
        let materials = parse(
            b"newmtl a\nKd 0 0 0\nmap_Kd -blendu on -s 2 4 1 -o .5 0.25 -clamp on my wood.png\nd 0.5\nKe 2 4 6\n\
              map_d my wood.png\nnewmtl b\nPr 0.5\nPm 1\nmap_Pr sub\\\\r.png\nmap_Bump -bm 2 bump.png\nmap_d mask.png\n\
              norm n.png\nmap_Ke e.png\nnewmtl c\nKd 0 0 0\nNs 10\n",
        );
        let of = |name: &str| Map::of(Path::new("there").join(name));
        let Surface {
            emission,
            opacity,
            maps,
            ..
        } = materials.surface(b"a");
        // Half of the light of what is half there.
        assert_eq!((emission, opacity), ([1.0, 2.0, 3.0], 0.5));
        let wood = maps.color.unwrap();
        assert_eq!(maps.opacity, Some(of("my wood.png").by("a")));
        assert_eq!(
            (wood.path.clone(), wood.wrap),
            (of("my wood.png").path, ["clamp"; 2])
        );
        // Scaled and moved about the bottom, of coordinates that run from the top.
        let uv = wood.to_uv.transform_point2(Vec2::new(0.25, 1.0));
        assert_eq!(uv, Vec2::new(1.0, 0.75));
        assert_eq!(materials.color(b"a"), Some([1.0; 3]));
        let b = materials.surface(b"b");
        assert_eq!((b.roughness, b.metallic, b.emission), (0.5, 1.0, [1.0; 3]));
        assert_eq!(b.maps.roughness, Some(of("sub/r.png").by("r")));
        assert_eq!(b.maps.opacity, Some(of("mask.png").by("r")));
        assert_eq!(
            (b.maps.normal, b.maps.emission),
            (Some(of("n.png")), Some(of("e.png")))
        );
        assert_eq!(materials.surface(b"c"), Surface::MATTE);
        assert_eq!(materials.color(b"c"), Some([0.0; 3]));
        assert_eq!(materials.warnings, ["not shown of the materials: map_Bump"]);
        for broken in [
            "map_Kd",
            "map_Kd -s 1",
            "map_Kd -s a b.png",
            "map_Kd -clamp on",
            "d x",
            "Ke -1",
        ] {
            let materials = parse(format!("newmtl a\n{broken}\n").as_bytes());
            assert_eq!(materials.warnings.len(), 1, "{broken}");
            assert_eq!(materials.surface(b"a"), Surface::MATTE, "{broken}");
        }
    }

    #[test]
    fn what_tr_says_is_told_where_nothing_else_says_it() {
        let told = ["not shown of the materials: Tr (write d)"];
        for (text, warnings) in [
            ("Tr 0.5", &told[..]),
            ("Tr 0", &[]),
            ("Tr 0.5\nd 0.5", &[]),
            ("d 0.5\nTr 0.5", &[]),
        ] {
            let materials = parse(format!("newmtl a\n{text}\n").as_bytes());
            assert_eq!(materials.warnings, warnings, "{text}");
        }
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
        assert_eq!(materials.materials.len(), MOST_MATERIALS);
        assert!(materials.warnings[0].starts_with("2 materials left out"));

        let folder = tempfile::tempdir().unwrap();
        let large = File::create(folder.path().join("large.mtl")).unwrap();
        large.set_len(LARGEST + 1).unwrap();
        std::fs::create_dir(folder.path().join("folder.mtl")).unwrap();
        let mesh = folder.path().join("mesh.obj");
        let named = [b"large.mtl folder.mtl large.mtl".to_vec()];
        let warnings = Materials::read(&mesh, &named, true).warnings;
        assert_eq!(warnings.len(), 2);
        assert!(warnings[0].ends_with("larger than 16 MiB"));
        assert!(warnings[1].ends_with("no regular file"));

        let many: Vec<_> = (0..1000).map(|i| format!("{i}.mtl").into_bytes()).collect();
        let warnings = Materials::read(&mesh, &many, true).warnings;
        assert_eq!(warnings.len(), MOST_LIBRARIES + 1);
    }
}
