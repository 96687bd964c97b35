//! The images of a glTF file, and how its textures look them up.

use std::collections::BTreeSet;
use std::io::{Cursor, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;

use glam::{Mat2, Mat3, Vec2};

use super::container::{beside, decode, is_data};
use super::json::{Lookup, Root, TextureInfo, at};
use super::{OrWhy, take_tree};
use crate::budget::Account;
use crate::error::{Error, Location, Result};
use crate::mesh::read::{is_compressed, open, with_input};
use crate::mesh::surface::Map;

/// The first `most` bytes of image `index` of the glTF or GLB file `path`, which lie in one of its buffers or stand in its
/// text. No more of the file is read than that takes. The account is asked for all of it.
///
/// # Errors
/// Where there is no such image, or it cannot be read.
pub fn gltf_image(path: &Path, index: usize, most: u64, account: &Account) -> Result<Vec<u8>> {
    let image = if is_compressed(path) {
        let bytes = with_input(path, account, |input| input.bytes())?;
        find(&mut Cursor::new(bytes), path, index, most, account)
    } else {
        find(&mut open(path)?.file, path, index, most, account)
    };
    image.map_err(|why| Error::input(why).at(&Location::of_file(path)))
}

/// Finds the image in a file that is opened.
fn find(
    file: &mut (impl Read + Seek),
    path: &Path,
    index: usize,
    most: u64,
    account: &Account,
) -> OrWhy<Vec<u8>> {
    let Layout { json, binary } = Layout::of(file, account)?;
    take_tree(&json, account)?;
    let root = Root::parse(&json)?;
    let image = at(&root.images, index, "image")?;
    let wrong = |why: String| format!("image {index}: {why}");
    let of_uri = |uri: &str| {
        let taken = account.take(2 * uri.len() as u64);
        taken.map_err(|e| e.to_string())?;
        decode(uri)
    };
    let view = match (&image.uri, image.buffer_view) {
        (Some(uri), _) if is_data(uri) => return of_uri(uri).map_err(wrong),
        (Some(uri), _) => return Err(wrong(format!("it is the file {uri:?}: name that"))),
        (None, None) => return Err(wrong("it says neither where it is nor what".to_owned())),
        (None, Some(view)) => at(&root.buffer_views, view, "buffer view")?,
    };
    let part = Part {
        from: view.byte_offset as u64,
        length: view.byte_length as u64,
        most,
    };
    let buffer = at(&root.buffers, view.buffer, "buffer")?;
    let bytes = match (&buffer.uri, binary) {
        (None, Some(binary)) => part.read(file, binary, account),
        (None, None) => Err("its buffer is not in the file".to_owned()),
        (Some(uri), _) if is_data(uri) => {
            let bytes = of_uri(uri)?;
            let whole = 0..bytes.len() as u64;
            part.read(&mut Cursor::new(bytes), whole, account)
        }
        (Some(uri), _) => {
            let opened = open(&beside(uri, path)?).map_err(|e| e.to_string())?;
            part.read(&mut &opened.file, 0..opened.length, account)
        }
    };
    bytes.map_err(wrong)
}

/// Where things are in a glTF or GLB file.
struct Layout {
    json: Vec<u8>,
    /// The buffer of a GLB file.
    binary: Option<Range<u64>>,
}

impl Layout {
    fn of(file: &mut (impl Read + Seek), account: &Account) -> OrWhy<Self> {
        let failed = |e: std::io::Error| format!("cannot read it: {e}");
        let end = file.seek(SeekFrom::End(0)).map_err(failed)?;
        let whole = Part {
            from: 0,
            length: end,
            most: end,
        };
        let mut at = HEAD.min(end);
        let head = Part { most: at, ..whole }.read(file, 0..end, account)?;
        if !head.starts_with(b"glTF") {
            let json = whole.read(file, 0..end, account)?;
            return Ok(Self { json, binary: None });
        }
        let mut layout = Self {
            json: Vec::new(),
            binary: None,
        };
        while layout.binary.is_none() && at + CHUNK <= end {
            file.seek(SeekFrom::Start(at)).map_err(failed)?;
            let mut about = [0; CHUNK as usize];
            file.read_exact(&mut about).map_err(failed)?;
            let [a, b, c, d, kind @ ..] = about;
            let start = at + CHUNK;
            let length = u64::from(u32::from_le_bytes([a, b, c, d]));
            let chunk = start..(start + length).min(end);
            match &kind {
                b"JSON" if layout.json.is_empty() => {
                    let all = Part {
                        length,
                        most: length,
                        ..whole
                    };
                    layout.json = all.read(file, chunk.clone(), account)?;
                }
                b"BIN\0" => layout.binary = Some(chunk.clone()),
                _ => {}
            }
            at = start + length;
        }
        Ok(layout)
    }
}

/// Bytes of a GLB file before its chunks, and of a chunk before its data.
const HEAD: u64 = 12;
const CHUNK: u64 = 8;

/// A part of a buffer, of which the first bytes are wanted.
#[derive(Clone, Copy)]
struct Part {
    from: u64,
    length: u64,
    most: u64,
}

impl Part {
    /// Reads it from a buffer that lies there in a file.
    fn read(
        self,
        file: &mut (impl Read + Seek),
        buffer: Range<u64>,
        account: &Account,
    ) -> OrWhy<Vec<u8>> {
        let Self { from, length, most } = self;
        let there = buffer.end - buffer.start;
        if from.checked_add(length).is_none_or(|end| end > there) {
            return Err(format!(
                "its {length} bytes from {from} on are not in a buffer of {there}"
            ));
        }
        let wanted = length.min(most);
        account.take(wanted).map_err(|e| e.to_string())?;
        let failed = |e: std::io::Error| format!("cannot read it: {e}");
        file.seek(SeekFrom::Start(buffer.start + from))
            .map_err(failed)?;
        let mut bytes = Vec::new();
        file.take(wanted).read_to_end(&mut bytes).map_err(failed)?;
        Ok(bytes)
    }
}

/// The textures of a file, as far as they are looked up by one set of texture coordinates.
pub(super) struct Textures<'a> {
    pub(super) root: &'a Root<'a>,
    /// Of the file.
    pub(super) path: &'a Path,
    /// Which of the primitive's texture coordinates its mesh has; `None`: it has none.
    pub(super) set: Option<u32>,
}

impl Textures<'_> {
    /// A texture of a material, which may hold `directions`; `None` where it is not shown, of which a note is taken.
    pub(super) fn map(
        &self,
        info: &TextureInfo,
        directions: bool,
        unseen: &mut BTreeSet<String>,
    ) -> OrWhy<Option<Map>> {
        let mut refuse = |why: &str| {
            unseen.insert(why.to_owned());
            Ok(None)
        };
        let texture = at(&self.root.textures, info.index, "texture")?;
        match self.set {
            None => return refuse("textures where there are no texture coordinates"),
            Some(set) if set != info.set() => {
                return refuse("textures by other texture coordinates than the base colour's");
            }
            Some(_) => {}
        }
        let Some(source) = texture.source else {
            let mut names = texture.extensions.keys();
            let name = names.next().map_or("without an image", String::as_str);
            return refuse(&format!("textures {name}"));
        };
        let image = at(&self.root.images, source, "image")?;
        let whole = match &image.uri {
            Some(uri) if !is_data(uri) => match beside(uri, self.path) {
                Ok(path) => Map::of(path),
                Err(_) => return refuse("textures whose images are no files beside this one"),
            },
            _ => Map {
                image: Some(source),
                ..Map::of(self.path.to_owned())
            },
        };
        let lookup = texture.sampler;
        let lookup = lookup.map(|index| at(&self.root.lookups, index, "sampler"));
        let default = Lookup::default();
        let lookup = lookup.transpose()?.unwrap_or(&default);
        let (turn, offset) = info.transform();
        let to_uv = Mat3::from_cols(
            turn.x_axis.extend(0.0),
            turn.y_axis.extend(0.0),
            offset.extend(1.0),
        );
        if !to_uv.is_finite() {
            return refuse("textures whose coordinates are out of all bounds");
        }
        // Where it is turned, directions in it should be turned too.
        let turned = turn.x_axis.y != 0.0 || turn.x_axis.x < 0.0 || turn.y_axis.y < 0.0;
        if directions && turned {
            unseen.insert("the turning of normal textures".to_owned());
        }
        Ok(Some(Map {
            nearest: lookup.mag_filter == Some(9728),
            wrap: [lookup.wrap_s, lookup.wrap_t].map(wrapped),
            to_uv,
            ..whole
        }))
    }
}

/// OpenGL's number as a scene's word.
fn wrapped(number: Option<u32>) -> &'static str {
    match number {
        Some(33071) => "clamp",
        Some(33648) => "mirror",
        _ => "repeat",
    }
}

impl TextureInfo {
    /// Which of a primitive's texture coordinates it is looked up by.
    pub(super) fn set(&self) -> u32 {
        let transform = self.extensions.transform.as_ref();
        transform
            .and_then(|t| t.tex_coord)
            .unwrap_or(self.tex_coord)
    }

    /// What is done to them: they are multiplied by the matrix, then the offset is added.
    pub(super) fn transform(&self) -> (Mat2, Vec2) {
        let Some(transform) = &self.extensions.transform else {
            return (Mat2::IDENTITY, Vec2::ZERO);
        };
        // Counter-clockwise where v points down, as all viewers have it (and not as the extension's listing says).
        let turn = Mat2::from_angle(-transform.rotation);
        let scale = Vec2::from(transform.scale.unwrap_or([1.0; 2]));
        (turn * Mat2::from_diagonal(scale), transform.offset.into())
    }
}
