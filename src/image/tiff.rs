//! TIFF (Adobe, revision 6.0, 1992), grey or RGB, with or without opacity: codes of 8 or 16 bits, taken for sRGB, or
//! floats of 16 or 32 bits, which are linear. Of a file with several images the first is read. Opacity is stored
//! straight; colours that a file says to be multiplied by it are divided by it.

use std::io::Cursor;

use ::tiff::decoder::{Decoder, DecodingResult, Limits};
use ::tiff::encoder::colortype::{
    ColorType, Gray8, Gray16, Gray32Float, RGB8, RGB16, RGB32Float, RGBA8, RGBA16, RGBA32Float,
};
use ::tiff::encoder::{
    Compression, DeflateLevel, TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard, TiffValue,
};
use ::tiff::tags::{ExtraSamples, Predictor, Tag};
use ::tiff::{ColorType as Colors, TiffError, TiffResult};

use super::raster::check_size;
use crate::budget::Account;
use crate::error::{Error, Result};
use crate::image::{Encoding, Image, Layout, Picture};

/// How many samples a byte of the file can make: LZW codes 4096 of them in 12 bits at the most.
const MOST_PER_BYTE: u64 = 4096;
/// What is written into a file of the old kind, whose places have 32 bits; there is room for all but pixels.
const MOST_IN_STANDARD: u64 = (1 << 32) - (1 << 26);

/// Whether the bytes begin as a TIFF file does, of either order of bytes, old or big.
pub(super) fn is_tiff(bytes: &[u8]) -> bool {
    matches!(
        bytes,
        [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..]
    )
}

/// Decodes the bytes of a TIFF file.
pub(super) fn decode(bytes: &[u8], account: &Account) -> Result<Picture> {
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(refused)?;
    let (width, height) = decoder.dimensions().map_err(refused)?;
    let colors = decoder.colortype().map_err(refused)?;
    let extra: Vec<u16> = decoder
        .find_tag_unsigned_vec(Tag::ExtraSamples)
        .map_err(refused)?
        .unwrap_or_default();
    let names = channel_names(colors, &extra)?;
    check_size([width, height], names.len(), MOST_PER_BYTE, bytes, account)?;
    let samples = u64::from(width) * u64::from(height) * names.len() as u64;
    check_length(&mut decoder, samples * u64::from(colors.bit_depth()) / 8)?;
    let mut limits = Limits::default();
    // The account has been asked for the pixels, and a compressed part is no longer than the file.
    limits.decoding_buffer_size = usize::MAX;
    limits.intermediate_buffer_size = bytes.len();
    let mut decoder = decoder.with_limits(limits);
    let mut pixels = DecodingResult::U8(Vec::new());
    let layout = decoder.read_image_to_buffer(&mut pixels).map_err(refused)?;
    let bits = colors.bit_depth();
    let (encoding, mut data) = match pixels {
        DecodingResult::U8(codes) if bits == 8 => (Encoding::Srgb, super::raster::codes(&codes)),
        DecodingResult::U16(codes) if bits == 16 => {
            let value = |code: u16| f32::from(code) / 65535.0;
            (Encoding::Srgb, codes.into_iter().map(value).collect())
        }
        DecodingResult::F16(values) => {
            let values = values.into_iter().map(|v| v.to_f32());
            (Encoding::Linear, values.collect())
        }
        DecodingResult::F32(values) => (Encoding::Linear, values),
        _ => {
            let error = Error::unsupported(format!("a TIFF of {bits} bits of this kind a sample"));
            return Err(error.help("convert it to 8 or 16 bits without sign, or to float32"));
        }
    };
    if layout.planes > 1 {
        data = interleaved(&data, names.len());
    }
    if names.last().is_some_and(|name| name == "A") && is(&extra, ExtraSamples::AssociatedAlpha) {
        divide(&mut data, names.len());
    }
    let mut warnings = Vec::new();
    if decoder.more_images() {
        let message = "the file has several images, and the first is read";
        warnings.extend_from_slice(Error::unsupported(message).problems());
    }
    let turned = decoder.find_tag_unsigned::<u16>(Tag::Orientation);
    if turned.map_err(refused)?.is_some_and(|turned| turned > 1) {
        let message = "the file says that its image is turned, and it is read as it is stored";
        warnings.extend_from_slice(Error::unsupported(message).problems());
    }
    Ok(Picture {
        image: Image::from_data(width, height, names, data)?,
        encoding,
        metadata: Vec::new(),
        warnings,
    })
}

/// Refuses parts that are not compressed and shorter than their pixels: the decoder would read on in what follows them.
fn check_length(decoder: &mut Decoder<Cursor<&[u8]>>, needed: u64) -> Result<()> {
    const PLAIN: u16 = 1;
    let method = decoder.find_tag_unsigned::<u16>(Tag::Compression);
    if method
        .map_err(refused)?
        .is_some_and(|method| method != PLAIN)
    {
        return Ok(());
    }
    let mut there = 0;
    for tag in [Tag::StripByteCounts, Tag::TileByteCounts] {
        let lengths: Option<Vec<u64>> = decoder.find_tag_unsigned_vec(tag).map_err(refused)?;
        there = lengths
            .into_iter()
            .flatten()
            .fold(there, u64::saturating_add);
    }
    match there < needed {
        true => Err(Error::input("the file ends too early")),
        false => Ok(()),
    }
}

/// Whether the first of the samples beyond the colours is this.
fn is(extra: &[u16], kind: ExtraSamples) -> bool {
    extra.first() == Some(&kind.to_u16())
}

fn channel_names(colors: Colors, extra: &[u16]) -> Result<Vec<String>> {
    let is_alpha =
        is(extra, ExtraSamples::AssociatedAlpha) || is(extra, ExtraSamples::UnassociatedAlpha);
    let names: &[&str] = match colors {
        Colors::Gray(_) => &["Y"],
        Colors::Multiband { num_samples: 2, .. } if is_alpha => &["Y", "A"],
        Colors::RGB(_) => &["R", "G", "B"],
        Colors::RGBA(_) => &["R", "G", "B", "A"],
        other => {
            let error = Error::unsupported(format!("a TIFF with pixels of {other:?}"));
            return Err(error.help("convert it to grey or RGB, with or without opacity"));
        }
    };
    Ok(names.iter().map(ToString::to_string).collect())
}

/// Pixel by pixel what was plane by plane.
fn interleaved(planes: &[f32], channels: usize) -> Vec<f32> {
    let pixels = planes.len() / channels;
    let samples = (0..pixels).flat_map(|i| (0..channels).map(move |c| planes[c * pixels + i]));
    samples.collect()
}

/// Divides colours by the opacity behind them.
fn divide(data: &mut [f32], channels: usize) {
    for pixel in data.chunks_exact_mut(channels) {
        if let Some((alpha, colors)) = pixel.split_last_mut()
            && *alpha > 0.0
        {
            colors.iter_mut().for_each(|color| *color /= *alpha);
        }
    }
}

fn refused(error: TiffError) -> Error {
    match error {
        TiffError::UnsupportedError(what) => Error::unsupported(what.to_string()),
        TiffError::IoError(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
            Error::input("the file ends too early")
        }
        other => Error::input(other.to_string()),
    }
}

/// A sample that TIFF can hold.
pub(super) trait Sample: Copy {
    /// What precedes a row's compression: differences of neighbours, where these are integers.
    const PREDICTOR: Predictor;
    type Grey: ColorType<Inner = Self>;
    type Rgb: ColorType<Inner = Self>;
    type Rgba: ColorType<Inner = Self>;
}

impl Sample for u8 {
    const PREDICTOR: Predictor = Predictor::Horizontal;
    type Grey = Gray8;
    type Rgb = RGB8;
    type Rgba = RGBA8;
}

impl Sample for u16 {
    const PREDICTOR: Predictor = Predictor::Horizontal;
    type Grey = Gray16;
    type Rgb = RGB16;
    type Rgba = RGBA16;
}

impl Sample for f32 {
    const PREDICTOR: Predictor = Predictor::None;
    type Grey = Gray32Float;
    type Rgb = RGB32Float;
    type Rgba = RGBA32Float;
}

/// The bytes of a TIFF file with an image's main colour and opacity as floats.
pub(super) fn encode(image: &Image) -> Result<Vec<u8>> {
    let image = &*image.in_rgb();
    let Some(rgb) = image.rgb() else {
        return Err(Error::input("a TIFF image needs channels R, G, B or Y")
            .help("write EXR, which takes any channels"));
    };
    let alpha = image.alpha();
    let (layout, colors) = match (rgb[0] == rgb[1], alpha) {
        (true, None) => (Layout::Grey, &rgb[..1]),
        (true, Some(_)) => (Layout::GreyAlpha, &rgb[..1]),
        (false, None) => (Layout::Rgb, &rgb[..]),
        (false, Some(_)) => (Layout::Rgba, &rgb[..]),
    };
    let pixels = image.data().chunks_exact(image.channels().len());
    let samples = pixels.flat_map(|pixel| colors.iter().copied().chain(alpha).map(|c| pixel[c]));
    let samples: Vec<f32> = samples.collect();
    encode_samples([image.width(), image.height()], layout, &samples)
}

/// The bytes of a TIFF file with these samples, interleaved.
pub(super) fn encode_samples<T: Sample>(
    size: [u32; 2],
    layout: Layout,
    samples: &[T],
) -> Result<Vec<u8>>
where
    [T]: TiffValue,
{
    let is_large = size_of_val(samples) as u64 > MOST_IN_STANDARD;
    let written = match is_large {
        true => written::<T, TiffKindBig>(size, layout, samples),
        false => written::<T, TiffKindStandard>(size, layout, samples),
    };
    written.map_err(|e| Error::input(format!("the image cannot be stored as TIFF: {e}")))
}

fn written<T: Sample, K: TiffKind>(
    [width, height]: [u32; 2],
    layout: Layout,
    samples: &[T],
) -> TiffResult<Vec<u8>>
where
    [T]: TiffValue,
{
    let straight = ExtraSamples::UnassociatedAlpha;
    let mut file = Cursor::new(Vec::new());
    // Noise hardly gets smaller by more work.
    let tiff = TiffEncoder::<_, K>::new_generic(&mut file)?
        .with_compression(Compression::Deflate(DeflateLevel::Fast));
    match layout {
        Layout::Grey => {
            let mut tiff = tiff.with_predictor(T::PREDICTOR);
            tiff.write_image::<T::Grey>(width, height, samples)?;
        }
        Layout::GreyAlpha => {
            // The crate's predictor knows of no samples beyond the colours.
            let mut tiff = tiff.with_predictor(Predictor::None);
            let mut image = tiff.new_image::<T::Grey>(width, height)?;
            image.extra_samples(&[straight])?;
            image.write_data(samples)?;
        }
        Layout::Rgb => {
            let mut tiff = tiff.with_predictor(T::PREDICTOR);
            tiff.write_image::<T::Rgb>(width, height, samples)?;
        }
        Layout::Rgba => {
            let mut tiff = tiff.with_predictor(T::PREDICTOR);
            let mut image = tiff.new_image::<T::Rgba>(width, height)?;
            let extra = &[straight.to_u16()][..];
            image.encoder().write_tag(Tag::ExtraSamples, extra)?;
            image.write_data(samples)?;
        }
    }
    Ok(file.into_inner())
}
