//! Tests of whole files: what is written is read again, and what is damaged is refused.

use super::*;
use crate::budget::Budget;

mod colors;
mod damaged;
mod jpegs;
mod round_trip;
mod tiffs;

/// An image whose samples all differ, brighter than a display too.
fn sample(width: u32, height: u32, names: &[&str]) -> Image {
    let names: Vec<String> = names.iter().map(ToString::to_string).collect();
    let n = width as usize * height as usize * names.len();
    let data = (0..n)
        .map(|i| (i as f32 * 0.37).sin().abs() * 4.0)
        .collect();
    Image::from_data(width, height, names, data).unwrap()
}

fn whole(image: &Image) -> Window {
    Window {
        x: 0,
        y: 0,
        full_width: image.width(),
        full_height: image.height(),
    }
}

/// The bytes of an EXR file without metadata.
fn exr_bytes(image: &Image) -> Vec<u8> {
    openexr::encode(image, &whole(image), &Metadata::default()).unwrap()
}

/// The bytes of an EXR file such as other programs write: half floats, floats and integers by any
/// compression, in tiles or in lines.
fn foreign_exr(compression: ::exr::prelude::Compression, blocks: ::exr::image::Blocks) -> Vec<u8> {
    use ::exr::prelude::*;
    let n = 40 * 70;
    let ramp = |i: usize| 1.0 + (i % 40 + i / 40) as f32 / 128.0;
    let channels = AnyChannels::sort(SmallVec::from_vec(vec![
        AnyChannel::new(
            "R",
            FlatSamples::F16((0..n).map(|i| f16::from_f32(ramp(i))).collect()),
        ),
        AnyChannel::new("G", FlatSamples::F16(vec![f16::ONE; n])),
        AnyChannel::new("Z", FlatSamples::F32((0..n).map(ramp).collect())),
        AnyChannel::new("id", FlatSamples::U32((0..n as u32).collect())),
    ]));
    let encoding = Encoding {
        compression,
        blocks,
        line_order: LineOrder::Increasing,
    };
    let layer = Layer::new((40, 70), LayerAttributes::default(), encoding, channels);
    let mut file = std::io::Cursor::new(Vec::new());
    ::exr::image::Image::from_layer(layer)
        .write()
        .non_parallel()
        .to_buffered(&mut file)
        .unwrap();
    file.into_inner()
}

/// Such a file for every compression that the crate knows, and one in tiles.
fn foreign_exrs() -> Vec<(String, Vec<u8>)> {
    use ::exr::image::Blocks;
    use ::exr::prelude::{Compression, Vec2};
    let compressions = [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::PIZ,
        Compression::PXR24,
        Compression::B44,
        Compression::B44A,
        Compression::DWAA(None),
        Compression::DWAB(None),
    ];
    let in_lines = compressions.map(|c| (format!("{c}"), foreign_exr(c, Blocks::ScanLines)));
    let tiles = foreign_exr(Compression::PIZ, Blocks::Tiles(Vec2(16, 16)));
    in_lines
        .into_iter()
        .chain([("tiles".into(), tiles)])
        .collect()
}

/// The bytes of a file of integers, by the crate `image`.
fn raster_bytes(
    width: u32,
    height: u32,
    color: ::image::ExtendedColorType,
    format: ::image::ImageFormat,
) -> Vec<u8> {
    let n = width as usize * height as usize * usize::from(color.bits_per_pixel()) / 8;
    let codes: Vec<u8> = (0..n).map(|i| (i * 37 % 251) as u8).collect();
    let mut file = std::io::Cursor::new(Vec::new());
    ::image::write_buffer_with_format(&mut file, &codes, width, height, color, format).unwrap();
    file.into_inner()
}

/// The bytes of a JPEG file of 16 × 6 pixels, whose chroma has half the resolution.
fn jpeg_bytes(progressive: bool) -> Vec<u8> {
    use libjpeg_turbo_rs::{Encoder, PixelFormat, Subsampling};
    let codes: Vec<u8> = (0..16 * 6 * 3).map(|i| (i * 37 % 251) as u8).collect();
    Encoder::new(&codes, 16, 6, PixelFormat::Rgb)
        .quality(80)
        .subsampling(Subsampling::S420)
        .progressive(progressive)
        .encode()
        .unwrap()
}

/// The bytes of a PFM file.
fn pfm_bytes(image: &Image) -> Vec<u8> {
    let mut bytes = format!("PF {} {} -1\n", image.width(), image.height()).into_bytes();
    bytes.extend(image.data().iter().flat_map(|v| v.to_le_bytes()));
    bytes
}
