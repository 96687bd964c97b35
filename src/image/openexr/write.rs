//! Writing OpenEXR: float32 channels, scan lines in blocks of 16 packed by ZIP where that pays. The same image and
//! metadata give the same bytes: blocks stand in the order of their lines and attributes in that of
//! their names.

use std::collections::HashMap;
use std::io::Cursor;

use ::exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock};
use ::exr::block::writer::ChunksWriter;
use ::exr::block::{self, BlockIndex, UncompressedBlock};
use ::exr::meta::BlockDescription;
use ::exr::meta::attribute::Chromaticities;
use ::exr::meta::header::{Header, LayerAttributes, standard_names};
use ::exr::prelude::{
    AttributeValue, ChannelDescription, Compression, IntegerBounds, LineOrder, SampleType,
    SmallVec, Text, Vec2,
};
use glam::Mat4;
use rayon::prelude::*;

use super::{WORLD_TO_CAMERA, WORLD_TO_NDC, batch_length};
use crate::color::Primaries;
use crate::error::{Error, Result};
use crate::image::{Image, MetaValue, Metadata, Window};

/// Names up to this many bytes need no mark in the file's version field.
const SHORT_NAME: usize = 31;
const LONGEST_NAME: usize = 255;
/// Coordinates beyond this are refused by OpenEXR.
const LARGEST_COORDINATE: u32 = i32::MAX as u32 / 2;

/// Blocks that packing makes smaller by less than this share are left as they are.
const LEAST_GAIN: f64 = 0.1;

/// The bytes of an OpenEXR file of this image, which may be a part of a whole.
pub(crate) fn encode(image: &Image, window: &Window, metadata: &Metadata) -> Result<Vec<u8>> {
    check_window(image, window)?;
    let mut order: Vec<usize> = (0..image.channels().len()).collect();
    order.sort_by_key(|&c| image.channels()[c].as_bytes());
    let header = header(image, window, &order, metadata)?;

    let mut file = Cursor::new(Vec::new());
    block::write(
        &mut file,
        [header].into_iter().collect(),
        true,
        |meta, writer| {
            let header = &meta.headers[0];
            let blocks: Vec<(usize, BlockIndex)> =
                meta.enumerate_ordered_header_block_indices().collect();
            for batch in blocks.chunks(batch_length(header.max_block_byte_size())) {
                let chunks: Vec<_> = batch
                    .par_iter()
                    .map(|&(number, index)| {
                        let block = fill(image, &order, header, index);
                        let chunk = match shrinks(&block, header)? {
                            true => block.compress_to_chunk(&meta.headers)?,
                            false => as_it_is(block, header)?,
                        };
                        Ok((number, chunk))
                    })
                    .collect::<::exr::error::Result<_>>()?;
                for (number, chunk) in chunks {
                    writer.write_chunk(number, chunk)?;
                }
            }
            Ok(())
        },
    )
    .map_err(|e| Error::input(format!("the image cannot be stored as EXR: {e}")))?;

    let mut bytes = file.into_inner();
    sort_attributes(&mut bytes);
    if image.channels().iter().any(|name| name.len() > SHORT_NAME) {
        // The crate sets bit 10 of the version, "long names", for attributes only.
        bytes[5] |= 1 << 2;
    }
    Ok(bytes)
}

fn check_window(image: &Image, window: &Window) -> Result<()> {
    if image.width() == 0 || image.height() == 0 || image.channels().is_empty() {
        return Err(Error::input("an image without pixels cannot be stored"));
    }
    let inside = |start: u32, size: u32, full: u32| {
        full < LARGEST_COORDINATE && start.checked_add(size).is_some_and(|end| end <= full)
    };
    if !inside(window.x, image.width(), window.full_width)
        || !inside(window.y, image.height(), window.full_height)
    {
        return Err(Error::input(format!(
            "an image of {} × {} pixels at ({}, {}) lies outside of {} × {}",
            image.width(),
            image.height(),
            window.x,
            window.y,
            window.full_width,
            window.full_height
        )));
    }
    Ok(())
}

/// Refuses channels that a file cannot hold side by side.
///
/// # Errors
/// Where two have one name, or a name is empty, too long or holds a zero.
pub fn check_channels(names: &[String]) -> Result<()> {
    for (i, name) in names.iter().enumerate() {
        text_name("channel", name)?;
        if names[..i].contains(name) {
            return Err(Error::input(format!("two channels are named {name:?}")));
        }
    }
    Ok(())
}

fn header(image: &Image, window: &Window, order: &[usize], metadata: &Metadata) -> Result<Header> {
    check_channels(image.channels())?;
    let mut channels = SmallVec::new();
    for &c in order {
        let name = utf8(&image.channels()[c]);
        // Lossy codes would treat opacity apart from light; ZIP loses nothing, so all are alike.
        channels.push(ChannelDescription::new(name, SampleType::F32, false));
    }
    let size = Vec2(image.width() as usize, image.height() as usize);
    let full = Vec2(window.full_width as usize, window.full_height as usize);
    let mut attributes = attributes(metadata)?;
    attributes.layer_position = Vec2(window.x as i32, window.y as i32);
    let mut header = Header::new(Text::default(), size, channels)
        .with_encoding(
            Compression::ZIP16,
            BlockDescription::ScanLines,
            LineOrder::Increasing,
        )
        .with_display_window(IntegerBounds::new((0, 0), full))
        .with_attributes(attributes);
    header.shared_attributes.chromaticities = chromaticities(image);
    Ok(header)
}

/// What the image's colours are, if it has any.
fn chromaticities(image: &Image) -> Option<Chromaticities> {
    let primaries = match (image.xyz(), image.rgb()) {
        (Some(_), _) => Primaries::XYZ,
        (None, Some(_)) => Primaries::BT709,
        (None, None) => return None,
    };
    let point = |[x, y]: [f64; 2]| Vec2(x as f32, y as f32);
    Some(Chromaticities {
        red: point(primaries.red),
        green: point(primaries.green),
        blue: point(primaries.blue),
        white: point(primaries.white),
    })
}

fn attributes(metadata: &Metadata) -> Result<LayerAttributes> {
    let mut attributes = LayerAttributes::default();
    let mut other = HashMap::new();
    for (name, value) in &metadata.entries {
        let value = match value {
            MetaValue::Matrix(m) if name == WORLD_TO_CAMERA.0 => {
                attributes.world_to_camera = Some(row_vectors(m));
                continue;
            }
            MetaValue::Matrix(m) if name == WORLD_TO_NDC.0 => {
                attributes.world_to_normalized_device = Some(row_vectors(m));
                continue;
            }
            MetaValue::Matrix(m) => AttributeValue::Matrix4x4(row_vectors(m)),
            MetaValue::Text(text) => AttributeValue::Text(utf8(text)),
            MetaValue::Integer(v) => match i32::try_from(*v) {
                Ok(v) => AttributeValue::I32(v),
                Err(_) => AttributeValue::Text(utf8(&v.to_string())),
            },
            MetaValue::Number(v) if f64::from(*v as f32) == *v || v.is_nan() => {
                AttributeValue::F32(*v as f32)
            }
            MetaValue::Number(v) => AttributeValue::F64(*v),
        };
        let key = text_name("metadata", name)?;
        match (key.as_slice(), &value) {
            // The standard's own attributes of descriptive kind are welcome in their standard type.
            (standard_names::SOFTWARE, AttributeValue::Text(v)) => {
                attributes.software_name = Some(v.clone());
            }
            (standard_names::COMMENTS, AttributeValue::Text(v)) => {
                attributes.comments = Some(v.clone());
            }
            (standard_names::OWNER, AttributeValue::Text(v)) => attributes.owner = Some(v.clone()),
            (standard_names::CAPTURE_DATE, AttributeValue::Text(v)) => {
                attributes.capture_date = Some(v.clone());
            }
            (reserved, _) if standard_names::ALL.contains(&reserved) => {
                return Err(Error::input(format!(
                    "the metadata name {name:?} is one of OpenEXR's own"
                )));
            }
            _ => {
                if other.insert(key, value).is_some() {
                    return Err(Error::input(format!(
                        "the metadata name {name:?} stands twice"
                    )));
                }
            }
        }
    }
    attributes.other = other;
    Ok(attributes)
}

/// OpenEXR multiplies row vectors from the left, p' = p·M, so its rows are our columns.
fn row_vectors(matrix: &Mat4) -> [f32; 16] {
    matrix.to_cols_array()
}

fn utf8(text: &str) -> Text {
    Text::from_slice_unchecked(text.as_bytes())
}

fn text_name(what: &str, name: &str) -> Result<Text> {
    if name.is_empty() || name.len() > LONGEST_NAME || name.contains('\0') {
        return Err(
            Error::input(format!("the {what} name {name:?} cannot be stored as EXR"))
                .help("use 1 to 255 bytes, none of them zero"),
        );
    }
    Ok(utf8(name))
}

/// A block of the file: its lines, for each line its channels in the file's order.
fn fill(image: &Image, order: &[usize], header: &Header, index: BlockIndex) -> UncompressedBlock {
    UncompressedBlock::from_lines(&header.channels, index, |line| {
        let Vec2(x, y) = line.location.position;
        let stride = order.len();
        let first = (y * image.width() as usize + x) * stride + order[line.location.channel];
        let samples = image.data()[first..].iter().step_by(stride);
        let (bytes, _) = line.value.as_chunks_mut::<4>();
        for (target, sample) in bytes.iter_mut().zip(samples) {
            *target = sample.to_ne_bytes();
        }
    })
}

/// Whether packing makes a block smaller by more than [`LEAST_GAIN`], judged by its middle line: noise in 32 bits takes
/// long to pack and hardly shrinks.
fn shrinks(block: &UncompressedBlock, header: &Header) -> ::exr::error::Result<bool> {
    let Vec2(width, height) = block.index.pixel_size;
    let size = width * header.channels.bytes_per_pixel;
    let line = block.data[height / 2 * size..][..size].to_vec();
    let area = IntegerBounds::new((0, 0), (width, 1));
    let packed = (header.compression).compress_image_section_to_le(header, line, area)?;
    Ok((packed.len() as f64) < (1.0 - LEAST_GAIN) * size as f64)
}

/// A block that is not packed, which readers know by its size.
fn as_it_is(block: UncompressedBlock, header: &Header) -> ::exr::error::Result<Chunk> {
    let UncompressedBlock { index, data } = block;
    let area = IntegerBounds::new((0, 0), index.pixel_size);
    let compressed_pixels_le =
        Compression::Uncompressed.compress_image_section_to_le(header, data, area)?;
    let y = index.pixel_position.y() as i32 + header.own_attributes.layer_position.y();
    Ok(Chunk {
        layer_index: index.layer,
        compressed_block: CompressedBlock::ScanLine(CompressedScanLineBlock {
            y_coordinate: y,
            compressed_pixels_le,
        }),
    })
}

/// Puts the header's attributes into the order of their names: the crate keeps ours in a hash map, whose
/// order changes from run to run. The header's length stays, and with it every offset in the file.
fn sort_attributes(file: &mut [u8]) {
    const START: usize = 8;
    const INTACT: &str = "the encoder has just written this header";
    let mut attributes: Vec<Vec<u8>> = Vec::new();
    let mut at = START;
    while file[at] != 0 {
        let zero = |from: usize| {
            let length = file[from..].iter().position(|&b| b == 0).expect(INTACT);
            from + length
        };
        let size_at = zero(zero(at) + 1) + 1;
        let size: [u8; 4] = file[size_at..][..4].try_into().expect(INTACT);
        let end = size_at + 4 + u32::from_le_bytes(size) as usize;
        attributes.push(file[at..end].to_vec());
        at = end;
    }
    // Names differ before their closing zero, so the values are never compared.
    attributes.sort();
    file[START..at].copy_from_slice(&attributes.concat());
}
