//! Channels of a lower resolution than the image's, as luminance-chroma files have them. The crate `exr` decodes
//! their blocks but refuses their headers, so it is shown a header that says nothing of sampling, and what that said
//! is put back afterwards. As in Mitsuba, samples stand in the middle of the pixels that they are for, and what lies
//! between them is found by a Lanczos filter of two lobes.

use std::borrow::Cow;
use std::f64::consts::PI;

use ::exr::block::chunk::{Chunk, CompressedBlock};
use ::exr::block::{BlockIndex, UncompressedBlock};
use ::exr::meta::BlockDescription;
use ::exr::meta::header::Header;
use ::exr::prelude::Vec2;
use rayon::prelude::*;

use super::read::refused;
use crate::error::{Error, Result};
use crate::image::Image;

/// How many pixels lie from one sample to the next, across and down.
type Step = [u32; 2];

const FULL: Step = [1, 1];

/// The steps of all channels by part and channel.
#[derive(Debug, Default)]
pub(super) struct Sampling {
    parts: Vec<Vec<Step>>,
    /// Where the steps stand in the file.
    places: Vec<usize>,
}

impl Sampling {
    /// Takes the sampling out of a file. A header that cannot be followed is left to the
    /// crate to refuse.
    pub(super) fn take(file: &[u8]) -> (Self, Cow<'_, [u8]>) {
        let mut sampling = Self::default();
        let followed = sampling.find(file).is_some();
        if !followed || sampling.parts.iter().flatten().all(|step| *step == FULL) {
            return (Self::default(), Cow::Borrowed(file));
        }
        let mut patched = file.to_vec();
        for &place in &sampling.places {
            for axis in [place, place + 4] {
                patched[axis..axis + 4].copy_from_slice(&1_u32.to_le_bytes());
            }
        }
        (sampling, Cow::Owned(patched))
    }

    /// Walks the headers (openexr.com, "OpenEXR File Layout").
    fn find(&mut self, file: &[u8]) -> Option<()> {
        const SEVERAL_PARTS: u32 = 1 << 12;
        let several = number(file, 4)? & SEVERAL_PARTS != 0;
        let mut at = 8;
        loop {
            let start = at;
            let mut steps = Vec::new();
            while *file.get(at)? != 0 {
                let name = text(file, at)?;
                let kind = text(file, at + name.len() + 1)?;
                let value = at + name.len() + kind.len() + 6;
                at = value + number(file, value - 4)? as usize;
                if (name, kind) == (b"channels", b"chlist") {
                    steps = self.channels(file, value)?;
                }
            }
            at += 1;
            // The last part is followed by an empty one.
            if at == start + 1 {
                return Some(());
            }
            self.parts.push(steps);
            if !several {
                return Some(());
            }
        }
    }

    /// The steps in a list of channels that begins at a place.
    fn channels(&mut self, file: &[u8], mut at: usize) -> Option<Vec<Step>> {
        let mut steps = Vec::new();
        while *file.get(at)? != 0 {
            // After the name come its zero, the type of the samples, and whether they are linear.
            let place = at + text(file, at)?.len() + 9;
            steps.push([number(file, place)?, number(file, place + 4)?]);
            self.places.push(place);
            at = place + 8;
        }
        Some(steps)
    }

    /// Puts it into the headers.
    pub(super) fn put_back(&self, headers: &mut [Header]) -> Result<()> {
        let invalid = |what: &str| Err(Error::input(format!("invalid: {what}")));
        for (header, steps) in headers.iter_mut().zip(&self.parts) {
            if steps.iter().all(|step| *step == FULL) {
                continue;
            }
            if header.deep || header.blocks != BlockDescription::ScanLines {
                return invalid("subsampling is only for flat scan lines");
            }
            let Vec2(width, height) = header.layer_size;
            let Vec2(x, y) = header.own_attributes.layer_position;
            for (channel, &[across, down]) in header.channels.list.iter_mut().zip(steps) {
                if across == 0 || down == 0 {
                    return invalid("zero sampling factor");
                }
                let whole = |size: usize, position: i32, step: u32| {
                    (size as u64).is_multiple_of(u64::from(step))
                        && i64::from(position) % i64::from(step) == 0
                };
                if !whole(width, x, across) || !whole(height, y, down) {
                    return invalid("the sampling factors do not divide the data window");
                }
                channel.sampling = Vec2(across as usize, down as usize);
            }
        }
        Ok(())
    }
}

/// The text at a place, without its closing zero.
fn text(file: &[u8], at: usize) -> Option<&[u8]> {
    file.get(at..)?.split(|&b| b == 0).next()
}

fn number(file: &[u8], at: usize) -> Option<u32> {
    let bytes = file.get(at..at.checked_add(4)?)?;
    Some(u32::from_le_bytes(bytes.try_into().ok()?))
}

/// Whether a part has such channels.
pub(super) fn is_subsampled(header: &Header) -> bool {
    header
        .channels
        .list
        .iter()
        .any(|c| c.sampling != Vec2(1, 1))
}

/// Unpacks a block of a part that has such channels.
pub(super) fn decompress(chunk: Chunk, header: &Header) -> Result<UncompressedBlock> {
    let tile = header
        .get_block_data_indices(&chunk.compressed_block)
        .map_err(refused)?;
    let area = header
        .get_absolute_block_pixel_coordinates(tile)
        .map_err(refused)?;
    area.validate(Some(header.layer_size)).map_err(refused)?;
    let CompressedBlock::ScanLine(block) = chunk.compressed_block else {
        return Err(Error::unsupported(
            "subsampled channels in other blocks than lines",
        ));
    };
    let position = area.position.to_usize("block").map_err(refused)?;
    let bytes: usize = (position.1..position.1 + area.size.1)
        .flat_map(|y| header.channels.list.iter().map(move |channel| (y, channel)))
        .filter(|(y, channel)| y % channel.sampling.1 == 0)
        .map(|(_, c)| area.size.0 / c.sampling.0 * c.sample_type.bytes_per_sample())
        .sum();
    // The crate takes a block to have so many bytes for each of its pixels.
    if !bytes.is_multiple_of(area.size.area()) {
        return Err(Error::unsupported("channels of such sampling factors"));
    }
    let mut header = header.clone();
    header.channels.bytes_per_pixel = bytes / area.size.area();
    let data = header
        .compression
        .decompress_image_section_from_le(&header, block.compressed_pixels_le, area, false)
        .map_err(refused)?;
    Ok(UncompressedBlock {
        index: BlockIndex {
            layer: chunk.layer_index,
            pixel_position: position,
            pixel_size: area.size,
            level: Vec2(0, 0),
        },
        data,
    })
}

/// The weights of the four samples around a pixel, the first of which lies `first` samples from its own.
struct Taps {
    first: isize,
    weights: [f64; 4],
}

/// For the first, second, … pixel of a sample.
fn taps(step: usize) -> Vec<Taps> {
    (0..step)
        .map(|pixel| {
            let center = (pixel as f64 + 0.5) / step as f64;
            let first = (center - 1.5).floor();
            let weight = |i: usize| lanczos(first + i as f64 + 0.5 - center);
            let weights = [0, 1, 2, 3].map(weight);
            let sum: f64 = weights.iter().sum();
            Taps {
                first: first as isize,
                weights: weights.map(|w| w / sum),
            }
        })
        .collect()
}

fn lanczos(x: f64) -> f64 {
    let sinc = |x: f64| {
        if x == 0.0 {
            1.0
        } else {
            (PI * x).sin() / (PI * x)
        }
    };
    if x.abs() < 2.0 {
        sinc(x) * sinc(x / 2.0)
    } else {
        0.0
    }
}

impl Taps {
    /// The weighted sum around sample `i` of `n`; what lies beyond an end counts as that end.
    fn sum(&self, i: usize, n: usize, sample: impl Fn(usize) -> f32) -> f32 {
        let at = |tap: usize| (i as isize + self.first + tap as isize).clamp(0, n as isize - 1);
        let term = |tap: usize| self.weights[tap] * f64::from(sample(at(tap) as usize));
        (term(0) + term(1) + term(2) + term(3)) as f32
    }
}

/// Spreads a coarse channel over the whole image, of which it becomes channel `slot`.
pub(super) fn spread(coarse: &Image, image: &mut Image, slot: usize) -> Result<()> {
    let (width, height) = (image.width() as usize, image.height() as usize);
    let (columns, rows) = (coarse.width() as usize, coarse.height() as usize);
    let mut wide = Image::try_new(image.width(), coarse.height(), vec!["".into()])?;
    let across = taps(width / columns);
    let lines = wide.data_mut().par_chunks_exact_mut(width);
    (lines.zip(coarse.data().par_chunks_exact(columns))).for_each(|(line, samples)| {
        for (x, value) in line.iter_mut().enumerate() {
            let taps = &across[x % across.len()];
            *value = taps.sum(x / across.len(), columns, |i| samples[i]);
        }
    });
    let down = taps(height / rows);
    let stride = image.channels().len();
    let lines = image.data_mut().par_chunks_exact_mut(width * stride);
    lines.enumerate().for_each(|(y, line)| {
        let taps = &down[y % down.len()];
        for x in 0..width {
            let sample = |row: usize| wide.data()[row * width + x];
            line[x * stride + slot] = taps.sum(y / down.len(), rows, sample);
        }
    });
    Ok(())
}
