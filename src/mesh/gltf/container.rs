//! The bytes of a glTF file: the GLB container, and buffers from `data:` and relative URIs. A file that several
//! buffers name is read once.

use std::io::Read;
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::alphabet;
use base64::engine::DecodePaddingMode;
use base64::engine::general_purpose::{GeneralPurpose, GeneralPurposeConfig};

use super::OrWhy;
use super::json::{Buffer, Root};
use crate::budget::Account;

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
        let (length, rest) = number(rest).ok_or_else(broken)?;
        // What follows the container is not its own.
        let mut rest = &rest[..rest.len().min((length as usize).saturating_sub(12))];
        let first = take_chunk(&mut rest).ok_or_else(broken)?;
        if first.kind != *b"JSON" {
            return Err(broken());
        }
        let mut binary = None;
        // Other kinds of chunks are passed over.
        while binary.is_none() && rest.len() >= 8 {
            let chunk = take_chunk(&mut rest).ok_or_else(broken)?;
            binary = (chunk.kind == *b"BIN\0").then_some(chunk.data);
        }
        Ok(Self {
            json: first.data,
            binary,
        })
    }
}

/// A little-endian number, and what follows.
fn number(bytes: &[u8]) -> Option<(u32, &[u8])> {
    let (number, rest) = bytes.split_first_chunk()?;
    Some((u32::from_le_bytes(*number), rest))
}

struct Chunk<'a> {
    kind: [u8; 4],
    data: &'a [u8],
}

/// The chunk that `bytes` begins with, which is taken off it.
fn take_chunk<'a>(bytes: &mut &'a [u8]) -> Option<Chunk<'a>> {
    let (length, rest) = number(bytes)?;
    let (kind, rest) = rest.split_first_chunk()?;
    let (data, rest) = rest.split_at_checked(length as usize)?;
    *bytes = rest;
    Some(Chunk { kind: *kind, data })
}

/// The buffers of a file. What is wrong with one is told when it is asked for: those of images are not.
pub(super) struct Buffers<'a> {
    binary: Option<&'a [u8]>,
    places: Vec<OrWhy<Place>>,
    /// What is not in the container.
    contents: Vec<Vec<u8>>,
    /// The files that were opened or tried, as they are named.
    pub(super) files: Vec<PathBuf>,
}

/// Where a buffer's bytes are.
enum Place {
    Container,
    Contents(usize),
}

impl<'a> Buffers<'a> {
    /// Loads the buffers of the file `path`.
    pub(super) fn load(
        root: &Root<'_>,
        binary: Option<&'a [u8]>,
        path: &Path,
        account: &Account,
    ) -> Self {
        let mut buffers = Self {
            binary,
            places: Vec::new(),
            contents: Vec::new(),
            files: Vec::new(),
        };
        // By the one name that a file has, whatever the way to it.
        let mut read: Vec<(PathBuf, OrWhy<usize>)> = Vec::new();
        for (index, buffer) in root.buffers.iter().enumerate() {
            let place = match &buffer.uri {
                None if index == 0 && binary.is_some() => Ok(Place::Container),
                None => Err("it is not in the file".to_owned()),
                Some(uri) if is_data(uri) => {
                    let taken = account.take(2 * uri.len() as u64);
                    let bytes = taken.map_err(|e| e.to_string()).and_then(|()| decode(uri));
                    bytes.map(|bytes| Place::Contents(buffers.keep(bytes)))
                }
                Some(uri) => beside(uri, path).and_then(|file| {
                    let resolved = file.canonicalize().unwrap_or_else(|_| file.clone());
                    let known = read.iter().find(|(known, _)| *known == resolved);
                    let place = match known {
                        Some((_, place)) => place.clone(),
                        None => {
                            let place = read_file(&file, account).map(|bytes| buffers.keep(bytes));
                            buffers.files.push(file);
                            read.push((resolved, place.clone()));
                            place
                        }
                    };
                    place.map(Place::Contents)
                }),
            };
            buffers.places.push(place);
        }
        buffers
    }

    fn keep(&mut self, bytes: Vec<u8>) -> usize {
        self.contents.push(bytes);
        self.contents.len() - 1
    }

    /// Bytes that are held in memory beside the file's own.
    #[cfg(test)]
    pub(super) fn held(&self) -> usize {
        self.contents.iter().map(Vec::len).sum()
    }

    /// The bytes of buffer `index`, at least as many as the file says.
    pub(super) fn get(&self, index: usize, buffers: &[Buffer<'_>]) -> OrWhy<&[u8]> {
        let wrong = |why: &str| format!("buffer {index}: {why}");
        let declared = super::json::at(buffers, index, "buffer")?.byte_length;
        let bytes = match self.places.get(index) {
            Some(Ok(Place::Container)) => self.binary.unwrap_or_default(),
            Some(Ok(Place::Contents(at))) => &self.contents[*at],
            Some(Err(why)) => return Err(wrong(why)),
            None => return Err(wrong("it is not in the file")),
        };
        if bytes.len() < declared {
            let why = format!("it has {} bytes, and should have {declared}", bytes.len());
            return Err(wrong(&why));
        }
        Ok(bytes)
    }
}

/// Whether a URI holds what it names.
pub(super) fn is_data(uri: &str) -> bool {
    let scheme = uri.get(..5);
    scheme.is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:"))
}

/// The bytes that a `data:` URI holds (RFC 2397): in base64, or as they are with escapes.
pub(super) fn decode(uri: &str) -> OrWhy<Vec<u8>> {
    /// With or without `=` at the end.
    const BASE64: GeneralPurpose = GeneralPurpose::new(
        &alphabet::STANDARD,
        GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
    );
    let damaged = |why: &dyn std::fmt::Display| format!("its data URI is damaged: {why}");
    let (about, data) = (uri[5..].split_once(',')).ok_or_else(|| damaged(&"it has no comma"))?;
    let last = about.rsplit(';').next().unwrap_or_default().trim();
    if !last.eq_ignore_ascii_case("base64") {
        return unescape(data).ok_or_else(|| damaged(&"an escape is malformed"));
    }
    let text: Vec<u8>;
    let mut digits = data.as_bytes();
    if digits.contains(&b'%') || digits.iter().any(u8::is_ascii_whitespace) {
        let unescaped = unescape(data).ok_or_else(|| damaged(&"an escape is malformed"))?;
        text = (unescaped.into_iter())
            .filter(|byte| !byte.is_ascii_whitespace())
            .collect();
        digits = &text;
    }
    BASE64.decode(digits).map_err(|e| damaged(&e))
}

/// The file beside `path` that a URI names.
pub(super) fn beside(uri: &str, path: &Path) -> OrWhy<PathBuf> {
    if uri.contains("://") {
        return Err(format!(
            "{uri:?} is not a file beside this one, and nothing is fetched"
        ));
    }
    let name = unescape(uri).and_then(|name| String::from_utf8(name).ok());
    let name = name.ok_or_else(|| format!("the URI {uri:?} is malformed"))?;
    Ok(path.with_file_name("").join(name))
}

fn read_file(file: &Path, account: &Account) -> OrWhy<Vec<u8>> {
    let read = || -> std::io::Result<Vec<u8>> {
        let opened = crate::file::open(file)?;
        let about = opened.metadata()?;
        (account.take(about.len())).map_err(std::io::Error::other)?;
        let mut bytes = Vec::new();
        opened.take(about.len()).read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    read().map_err(|e| format!("cannot read {}: {e}", file.display()))
}

/// Replaces `%20` and its like.
fn unescape(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        rest = after;
        if byte == b'%' {
            let (&[high, low], after) = rest.split_first_chunk()?;
            let digit = |byte: u8| char::from(byte).to_digit(16);
            bytes.push((16 * digit(high)? + digit(low)?) as u8);
            rest = after;
        } else {
            bytes.push(byte);
        }
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uris_are_unescaped_and_broken_escapes_refused() {
        let file = |uri| beside(uri, Path::new("there/a.gltf"));
        assert_eq!(file("a%20b.bin").unwrap(), Path::new("there/a b.bin"));
        assert_eq!(file("../%C3%89/x").unwrap(), Path::new("there/../É/x"));
        assert_eq!(
            beside("b.bin", Path::new("a.gltf")).unwrap(),
            Path::new("b.bin")
        );
        for broken in ["%", "%2", "%zz", "%ff", "%+1"] {
            assert!(file(broken).is_err(), "{broken}");
        }
    }

    #[test]
    fn data_uris_hold_bytes_in_base64_or_plain_and_with_any_parameters() {
        for uri in [
            "data:application/octet-stream;base64,AP8gQQ==",
            "data:;base64,AP8gQQ",
            "DATA:application/gltf-buffer;charset=utf-8;BASE64,AP8g%51Q%3D%3D",
            "data:text/plain;charset=utf-8;base64,AP8\n gQQ==",
            "data:,%00%ff A",
            "data:application/octet-stream,%00%FF%20%41",
        ] {
            assert_eq!(decode(uri).unwrap(), b"\x00\xff A", "{uri}");
        }
        for broken in ["data:AP8g", "data:;base64,A", "data:;base64,!", "data:,%4"] {
            let why = decode(broken).unwrap_err();
            assert!(why.starts_with("its data URI is damaged"), "{why}");
        }
    }

    #[test]
    fn a_glb_file_may_have_more_chunks_and_more_bytes_than_are_read() {
        let chunk = |kind: &[u8; 4], data: &[u8]| {
            let length = (data.len() as u32).to_le_bytes();
            [&length[..], kind, data].concat()
        };
        let file = |chunks: &[Vec<u8>], after: &[u8]| {
            let chunks = chunks.concat();
            let length = (12 + chunks.len() as u32).to_le_bytes();
            [b"glTF\x02\0\0\0", &length[..], &chunks, after].concat()
        };
        let json = chunk(b"JSON", b"{}  ");
        let binary = chunk(b"BIN\0", b"1234");
        let other = chunk(b"MORE", b"abcdefgh");
        for (bytes, expected) in [
            (
                file(&[json.clone(), binary.clone()], b""),
                Some(&b"1234"[..]),
            ),
            (
                file(
                    &[json.clone(), other.clone(), binary.clone(), other],
                    b"\0\0",
                ),
                Some(b"1234"),
            ),
            (file(std::slice::from_ref(&json), &binary), None),
        ] {
            let container = Container::open(&bytes).ok().unwrap();
            assert_eq!(container.json, b"{}  ");
            assert_eq!(container.binary, expected);
        }
        for bytes in [
            file(std::slice::from_ref(&binary), b""),
            file(&[json, binary[..10].to_vec()], b""),
            b"glTF\x02\0\0\0".to_vec(),
        ] {
            assert!(Container::open(&bytes).is_err());
        }
    }
}
