//! Reading OpenEXR: every part's every channel, as half, float or unsigned integer, in its full
//! resolution, into one interleaved image. Colours come first (R, G, B, A or X, Y, Z), in capitals however the
//! file writes them, then the channels in the file's order. Parts that do not lie where the first one lies
//! are left out. The header is checked against the file's length before a pixel is allocated.

use std::collections::{HashMap, HashSet};
use std::io::Cursor;

use ::exr::block::chunk::Chunk;
use ::exr::block::reader::ChunksReader;
use ::exr::block::{self, BlockIndex, UncompressedBlock};
use ::exr::meta::header::Header;
use ::exr::prelude::{AttributeValue, Compression, SampleType, Vec2, f16};
use rayon::prelude::*;

use super::sampling::{self, Sampling};
use super::{WORLD_TO_CAMERA, WORLD_TO_NDC, batch_length, colors, dwa};
use crate::budget::Account;
use crate::error::{Error, Problem, Result};
use crate::image::{Encoding, Image, Picture};

/// The first bytes of every OpenEXR file.
pub(crate) const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// Decodes the bytes of an OpenEXR file.
pub(crate) fn decode(bytes: &[u8], account: &Account) -> Result<Picture> {
    let (sampling, bytes) = Sampling::take(bytes);
    let reader = block::read(Cursor::new(&*bytes), false).map_err(refused)?;
    let mut headers = reader.headers().to_vec();
    sampling.put_back(&mut headers)?;
    check_size(&headers, bytes.len(), account)?;

    let channels = Channels::of(&headers)?;
    let Vec2(width, height) = headers[0].layer_size;
    let mut image = Image::try_new(width as u32, height as u32, channels.names.clone())?;
    let mut coarse = channels.coarse(&headers)?;

    let full = Vec2(0, 0);
    let is_read = |block: &BlockIndex| block.level == full && channels.has_part(block.layer);
    let mut chunks = reader
        .filter_chunks(false, |_, _, block| is_read(&block))
        .map_err(refused)?;
    let meta = chunks.meta_data().clone();
    let largest = headers.iter().map(block_bytes).max().unwrap_or(1);
    let batch = batch_length(largest);
    let mut seen = HashSet::new();
    loop {
        let compressed: Vec<Chunk> = chunks
            .by_ref()
            .take(batch)
            .collect::<::exr::error::Result<_>>()
            .map_err(refused)?;
        if compressed.is_empty() {
            break;
        }
        for chunk in &compressed {
            dwa::check(chunk, &headers)?;
        }
        let blocks: Vec<UncompressedBlock> = compressed
            .into_par_iter()
            .map(|chunk| match headers.get(chunk.layer_index) {
                Some(header) if sampling::is_subsampled(header) => {
                    sampling::decompress(chunk, header)
                }
                _ => UncompressedBlock::decompress_chunk(chunk, &meta, false).map_err(refused),
            })
            .collect::<Result<_>>()?;
        for block in blocks {
            // As many blocks as the image has are read; if none comes twice, none is missing.
            if !is_read(&block.index)
                || !seen.insert((block.index.layer, block.index.pixel_position))
            {
                return Err(Error::input("invalid: offset table"));
            }
            let header = &headers[block.index.layer];
            channels.place(&block, header, &mut image, &mut coarse);
        }
    }
    for (slot, coarse) in coarse {
        sampling::spread(&coarse, &mut image, slot)?;
    }
    let chromaticities = headers[0].shared_attributes.chromaticities.as_ref();
    colors::convert(&mut image, chromaticities)?;
    Ok(Picture {
        image,
        encoding: Encoding::Linear,
        metadata: metadata(&headers[0]),
        warnings: channels.warnings,
    })
}

pub(super) fn refused(error: ::exr::error::Error) -> Error {
    match error {
        ::exr::error::Error::NotSupported(what) => Error::unsupported(what.into_owned()),
        ::exr::error::Error::Io(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
            Error::input("the file ends too early")
        }
        other => Error::input(other.to_string()),
    }
}

/// The channels of the main colour, as they are spoken.
const MAIN: [&str; 9] = ["R", "G", "B", "X", "Y", "Z", "RY", "BY", "A"];

/// The bytes of one block of this part, as large as blocks can be within its window.
fn block_bytes(header: &Header) -> usize {
    let Vec2(width, height) = header.max_block_pixel_size();
    let Vec2(full_width, full_height) = header.layer_size;
    (width.min(full_width))
        .saturating_mul(height.min(full_height))
        .saturating_mul(header.channels.bytes_per_pixel)
}

/// Refuses headers that claim more pixels than the file can hold or the limit allows.
fn check_size(headers: &[Header], file_bytes: usize, account: &Account) -> Result<()> {
    let mut samples = 0_u128;
    let mut coded = 0_u128;
    let mut chunks = 0_u128;
    for header in headers {
        let Vec2(width, height) = header.layer_size;
        if width == 0 || height == 0 {
            return Err(Error::input("invalid: the data window is empty"));
        }
        let pixels = width as u128 * height as u128;
        let mut bytes = 0;
        for channel in &header.channels.list {
            let Vec2(across, down) = channel.sampling;
            let here = pixels / (across * down) as u128;
            bytes += here * channel.sample_type.bytes_per_sample() as u128;
            samples += pixels;
            if channel.sampling != Vec2(1, 1) {
                // On the way to the whole image: as they are, and as wide as the image.
                samples += here + pixels / down as u128;
            }
        }
        chunks += header.chunk_count as u128;
        // Deflate packs at most 1032 bytes into one and is the tightest of the lossless codes. B44 knows
        // no ratio above 11; DWA may leave one deflated half a block of 8 × 8 pixels.
        coded += match header.compression {
            Compression::Uncompressed => bytes,
            Compression::DWAA(_) | Compression::DWAB(_) => bytes / (1100 * 256),
            _ => bytes / 1400,
        };
    }
    let Vec2(width, height) = headers[0].layer_size;
    // Each block takes an entry of 8 bytes in the offset table.
    if chunks * 8 + coded > file_bytes as u128 {
        return Err(Error::input(format!(
            "invalid: a file of {file_bytes} bytes cannot hold {width} × {height} pixels"
        )));
    }
    // Of each batch the blocks as they are, and on their way through the decoder.
    let largest = headers.iter().map(block_bytes).max().unwrap_or(1);
    let batch = largest.saturating_mul(batch_length(largest)) as u128;
    let bytes = samples * 4 + 3 * batch.min(samples * 4);
    let bytes = u64::try_from(bytes).unwrap_or(u64::MAX);
    account.take_for(bytes, &format!("the image of {width} × {height} pixels"))
}

/// Which sample of the image each channel of the file becomes.
struct Channels {
    names: Vec<String>,
    /// By part and by channel of the part; a part that is left out has none.
    slots: Vec<Vec<usize>>,
    /// What is left out.
    warnings: Vec<Problem>,
}

/// Channels with fewer samples than the image, by the slots that they are for.
type Coarse = HashMap<usize, Image>;

impl Channels {
    /// Those of the first part, and of the others that lie where it lies.
    fn of(headers: &[Header]) -> Result<Self> {
        let mut named = Vec::new();
        let mut left_out = Vec::new();
        for (part, header) in headers.iter().enumerate() {
            let layer = (headers.len() > 1)
                .then_some(header.own_attributes.layer_name.as_ref())
                .flatten()
                .map(|name| String::from_utf8_lossy(name.as_slice()).into_owned())
                .filter(|name| !name.is_empty());
            let place = |h: &Header| (h.layer_size, h.own_attributes.layer_position);
            if place(header) != place(&headers[0]) {
                left_out.push(layer.unwrap_or_else(|| part.to_string()));
                continue;
            }
            for (channel, description) in header.channels.list.iter().enumerate() {
                let name = String::from_utf8_lossy(description.name.as_slice()).into_owned();
                let name = match &layer {
                    Some(layer) if !name.starts_with(&format!("{layer}.")) => {
                        format!("{layer}.{name}")
                    }
                    _ => name,
                };
                named.push((name, part, channel));
            }
        }
        for i in 0..named.len() {
            if let Some(upper) = in_capitals(&named[i].0)
                && named.iter().all(|(name, ..)| *name != upper)
            {
                named[i].0 = upper;
            }
        }
        // A stable sort: within a rank the file's order stays.
        named.sort_by_key(|(name, ..)| rank(name));
        let mut slots: Vec<Vec<usize>> = vec![Vec::new(); headers.len()];
        for (slot, &(_, part, channel)) in named.iter().enumerate() {
            slots[part].resize(headers[part].channels.list.len(), 0);
            slots[part][channel] = slot;
        }
        let mut warnings = Vec::new();
        if !left_out.is_empty() {
            let names = left_out.join(", ");
            let message =
                format!("parts with another data window than the first are left out: {names}");
            warnings.extend_from_slice(Error::unsupported(message).problems());
        }
        Ok(Self {
            names: named.into_iter().map(|(name, ..)| name).collect(),
            slots,
            warnings,
        })
    }

    /// Whether a part is read.
    fn has_part(&self, part: usize) -> bool {
        self.slots.get(part).is_some_and(|slots| !slots.is_empty())
    }

    /// Room for the channels with fewer samples than the image.
    fn coarse(&self, headers: &[Header]) -> Result<Coarse> {
        let mut coarse = Coarse::new();
        for (header, slots) in headers.iter().zip(&self.slots) {
            for (channel, slot) in header.channels.list.iter().zip(slots) {
                if channel.sampling != Vec2(1, 1) {
                    let Vec2(width, height) = header.layer_size / channel.sampling;
                    let name = vec![self.names[*slot].clone()];
                    coarse.insert(*slot, Image::try_new(width as u32, height as u32, name)?);
                }
            }
        }
        Ok(coarse)
    }

    /// Copies a block's samples to where they belong: line by line, in each all channels that have samples there.
    fn place(
        &self,
        block: &UncompressedBlock,
        header: &Header,
        image: &mut Image,
        coarse: &mut Coarse,
    ) {
        let Vec2(left, top) = block.index.pixel_position;
        let Vec2(width, height) = block.index.pixel_size;
        let mut rest = &block.data[..];
        for y in top..top + height {
            for (channel, &slot) in header
                .channels
                .list
                .iter()
                .zip(&self.slots[block.index.layer])
            {
                let Vec2(across, down) = channel.sampling;
                if y % down != 0 {
                    continue;
                }
                let bytes = width / across * channel.sample_type.bytes_per_sample();
                let (line, after) = rest.split_at(bytes);
                rest = after;
                let (target, slot) = match coarse.get_mut(&slot) {
                    Some(coarse) => (coarse, 0),
                    None => (&mut *image, slot),
                };
                let stride = target.channels().len();
                let first = (y / down * target.width() as usize + left / across) * stride + slot;
                let samples = target.data_mut()[first..].iter_mut().step_by(stride);
                match channel.sample_type {
                    SampleType::F16 => copy(samples, line, |b| f16::from_ne_bytes(b).to_f32()),
                    SampleType::F32 => copy(samples, line, f32::from_ne_bytes),
                    SampleType::U32 => copy(samples, line, |b| u32::from_ne_bytes(b) as f32),
                }
            }
        }
    }
}

/// The name with its channel's letters in capitals, where they are those of a colour: `diffuse.R` of `diffuse.r`.
fn in_capitals(name: &str) -> Option<String> {
    let (layer, channel) = name.split_at(name.rfind('.').map_or(0, |dot| dot + 1));
    let upper = channel.to_uppercase();
    (upper != channel && MAIN.contains(&&*upper)).then(|| format!("{layer}{upper}"))
}

/// Converts `N` bytes a sample.
fn copy<'a, const N: usize>(
    samples: impl Iterator<Item = &'a mut f32>,
    bytes: &[u8],
    convert: impl Fn([u8; N]) -> f32,
) {
    let (values, _) = bytes.as_chunks::<N>();
    for (sample, &value) in samples.zip(values) {
        *sample = convert(value);
    }
}

/// Where a channel stands: the main colours first, as they are spoken.
fn rank(name: &str) -> usize {
    MAIN.iter()
        .position(|&main| main == name)
        .unwrap_or(usize::MAX)
}

/// The attributes that are no matter of the file's structure, by name.
fn metadata(header: &Header) -> Vec<(String, String)> {
    let numbers = |values: &[f32]| {
        let texts: Vec<String> = values.iter().map(f32::to_string).collect();
        texts.join(" ")
    };
    let mut entries: Vec<(String, String)> = header
        .all_named_attributes()
        .filter_map(|(name, value)| {
            let name = String::from_utf8_lossy(name);
            let text = match value {
                AttributeValue::Text(text) => String::from_utf8_lossy(text.as_slice()).into_owned(),
                AttributeValue::F32(v) => v.to_string(),
                AttributeValue::F64(v) => v.to_string(),
                AttributeValue::I32(v) if name != "chunkCount" => v.to_string(),
                AttributeValue::FloatVec2(Vec2(x, y)) => numbers(&[x, y]),
                AttributeValue::Matrix4x4(rows) => numbers(&rows),
                AttributeValue::Chromaticities(c) => {
                    let [r, g, b, w] = [c.red, c.green, c.blue, c.white];
                    numbers(&[r.0, r.1, g.0, g.1, b.0, b.1, w.0, w.1])
                }
                AttributeValue::IntegerBounds(b) => format!(
                    "{} {} {} {}",
                    b.position.0, b.position.1, b.size.0, b.size.1
                ),
                _ => return None,
            };
            let name = match &*name {
                n if n == WORLD_TO_CAMERA.1 => WORLD_TO_CAMERA.0,
                n if n == WORLD_TO_NDC.1 => WORLD_TO_NDC.0,
                n => n,
            };
            Some((name.to_owned(), text))
        })
        .collect();
    entries.sort();
    entries
}
