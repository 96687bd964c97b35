//! The bytes behind a glTF file: the GLB container, buffers from `data:` and relative URIs, and accessors
//! as rows of numbers. Nothing is read through an offset that was not held against its buffer's length.

use std::io::Read;
use std::path::Path;

use base64::Engine;
use gltf::Document;
use gltf::accessor::{Accessor, DataType};
use gltf::buffer::Source;

use super::OrWhy;

/// A GLB file's two parts.
pub(super) struct Container<'a> {
    pub(super) json: &'a [u8],
    pub(super) binary: Option<&'a [u8]>,
}

impl<'a> Container<'a> {
    /// Takes a GLB file apart; any other is all JSON.
    pub(super) fn open(bytes: &'a [u8]) -> OrWhy<Self> {
        let Some(rest) = bytes.strip_prefix(b"glTF") else {
            return Ok(Self {
                json: bytes,
                binary: None,
            });
        };
        let broken = || "the GLB container is broken, or the file cut short".to_owned();
        let (version, rest) = number(rest).ok_or_else(broken)?;
        if version != 2 {
            return Err(format!(
                "GLB version {version} is unknown; version 2 is wanted"
            ));
        }
        let (_length, rest) = number(rest).ok_or_else(broken)?;
        let (json, rest) = chunk(rest, *b"JSON").ok_or_else(broken)?;
        Ok(Self {
            json,
            binary: chunk(rest, *b"BIN\0").map(|(binary, _)| binary),
        })
    }
}

/// A little-endian number, and what follows.
fn number(bytes: &[u8]) -> Option<(u32, &[u8])> {
    let (number, rest) = bytes.split_first_chunk()?;
    Some((u32::from_le_bytes(*number), rest))
}

/// The chunk that `bytes` begins with, and what follows.
fn chunk(bytes: &[u8], kind: [u8; 4]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = number(bytes)?;
    rest.strip_prefix(&kind)?.split_at_checked(length as usize)
}

/// The buffers of a document, each at least as long as it says.
pub(super) struct Buffers(Vec<Vec<u8>>);

impl Buffers {
    pub(super) fn load(document: &Document, binary: Option<&[u8]>, path: &Path) -> OrWhy<Self> {
        let load = |buffer: gltf::Buffer<'_>| {
            let bytes = match buffer.source() {
                Source::Bin => binary.ok_or("it is not in the file")?.to_vec(),
                Source::Uri(uri) => from_uri(uri, path)?,
            };
            if bytes.len() < buffer.length() {
                return Err(format!(
                    "it has {} bytes, and should have {}",
                    bytes.len(),
                    buffer.length()
                ));
            }
            Ok(bytes)
        };
        let loaded = document
            .buffers()
            .enumerate()
            .map(|(i, b)| load(b).map_err(|e| format!("buffer {i}: {e}")));
        loaded.collect::<OrWhy<_>>().map(Self)
    }

    /// Rows of `N` numbers; integers are divided by their greatest value where the accessor is normalized.
    pub(super) fn rows<const N: usize>(&self, accessor: &Accessor<'_>) -> OrWhy<Vec<[f32; N]>> {
        let decode = decoder(accessor.data_type(), accessor.normalized());
        let size = accessor.data_type().size();
        let row = |bytes: &[u8]| std::array::from_fn(|i| decode(&bytes[i * size..]));
        Ok(self.bytes::<N>(accessor)?.map(row).collect())
    }

    /// An accessor of single whole numbers.
    pub(super) fn indices(&self, accessor: &Accessor<'_>) -> OrWhy<Vec<u32>> {
        let number: fn(&[u8]) -> u32 = match accessor.data_type() {
            DataType::U8 => |b| b[0].into(),
            DataType::U16 => |b| u16::from_le_bytes(first(b)).into(),
            DataType::U32 => |b| u32::from_le_bytes(first(b)),
            other => return Err(format!("indices cannot be {other:?}")),
        };
        Ok(self.bytes::<1>(accessor)?.map(number).collect())
    }

    /// The bytes of each element, which must have `N` components.
    fn bytes<const N: usize>(&self, accessor: &Accessor<'_>) -> OrWhy<impl Iterator<Item = &[u8]>> {
        let wrong = |what: &str| format!("accessor {} {what}", accessor.index());
        if accessor.dimensions().multiplicity() != N {
            return Err(wrong(&format!("should have {N} components")));
        }
        if accessor.sparse().is_some() {
            return Err(wrong("is sparse, which is not supported"));
        }
        let view = accessor.view().ok_or_else(|| wrong("has no data"))?;
        let size = N * accessor.data_type().size();
        let stride = view.stride().unwrap_or(size);
        let count = accessor.count();
        let data = self.0.get(view.buffer().index()).and_then(|buffer| {
            let end = view.offset().checked_add(view.length())?;
            let data = buffer.get(view.offset()..end)?.get(accessor.offset()..)?;
            let needed = match count {
                0 => 0,
                _ => stride.checked_mul(count - 1)?.checked_add(size)?,
            };
            data.get(..needed)
        });
        match data {
            Some(data) if stride >= size => Ok(data.chunks(stride).take(count)),
            _ => Err(wrong("reaches beyond its buffer")),
        }
    }
}

fn first<const N: usize>(bytes: &[u8]) -> [u8; N] {
    *bytes
        .first_chunk()
        .expect("the accessor's rows have been measured")
}

fn decoder(kind: DataType, normalized: bool) -> fn(&[u8]) -> f32 {
    match (kind, normalized) {
        (DataType::F32, _) => |b| f32::from_le_bytes(first(b)),
        (DataType::U32, _) => |b| u32::from_le_bytes(first(b)) as f32,
        (DataType::I8, false) => |b| i8::from_le_bytes(first(b)).into(),
        (DataType::U8, false) => |b| b[0].into(),
        (DataType::I16, false) => |b| i16::from_le_bytes(first(b)).into(),
        (DataType::U16, false) => |b| u16::from_le_bytes(first(b)).into(),
        (DataType::I8, true) => |b| (f32::from(i8::from_le_bytes(first(b))) / 127.0).max(-1.0),
        (DataType::U8, true) => |b| f32::from(b[0]) / 255.0,
        (DataType::I16, true) => |b| (f32::from(i16::from_le_bytes(first(b))) / 32767.0).max(-1.0),
        (DataType::U16, true) => |b| f32::from(u16::from_le_bytes(first(b))) / 65535.0,
    }
}

/// What a URI names: data in itself, or a file beside `path`.
fn from_uri(uri: &str, path: &Path) -> OrWhy<Vec<u8>> {
    if let Some(data) = uri.strip_prefix("data:") {
        let (_, text) = data
            .split_once(";base64,")
            .ok_or("its data URI is not in base64")?;
        let decoded = base64::engine::general_purpose::STANDARD.decode(text.trim_end());
        return decoded.map_err(|e| format!("its data URI is damaged: {e}"));
    }
    if uri.contains("://") {
        return Err(format!(
            "{uri:?} is not a file beside this one, and nothing is fetched"
        ));
    }
    let name = unescape(uri).ok_or_else(|| format!("the URI {uri:?} is malformed"))?;
    let file = path.with_file_name(name);
    let read = || {
        let opened = std::fs::File::open(&file)?;
        let about = opened.metadata()?;
        if !about.is_file() {
            return Err(std::io::Error::other("no regular file"));
        }
        let mut bytes = Vec::new();
        opened.take(about.len()).read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    read().map_err(|e| format!("cannot read {}: {e}", file.display()))
}

/// Replaces `%20` and its like.
fn unescape(uri: &str) -> Option<String> {
    let mut bytes = Vec::new();
    let mut rest = uri.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        rest = after;
        if byte == b'%' {
            let (digits, after) = rest.split_at_checked(2)?;
            bytes.push(u8::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok()?);
            rest = after;
        } else {
            bytes.push(byte);
        }
    }
    String::from_utf8(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uris_are_unescaped_and_broken_escapes_refused() {
        assert_eq!(unescape("a%20b.bin").as_deref(), Some("a b.bin"));
        assert_eq!(unescape("%C3%89").as_deref(), Some("É"));
        for broken in ["%", "%2", "%zz", "%ff"] {
            assert_eq!(unescape(broken), None, "{broken}");
        }
    }
}
