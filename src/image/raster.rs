//! Pictures of integers by the crate `image`: PNG, BMP, TGA and PPM with its kin. They become code values in
//! [0, 1] (v / 255 or v / 65535, not decoded). What else a PNG says of its colours (gAMA, cHRM, cICP, a
//! profile) changes nothing, as in Mitsuba; codes of other displays than sRGB's (cICP, or else gAMA and cHRM) are told.

use std::io::Cursor;

use ::image::{ColorType, ImageDecoder, ImageError, ImageFormat, ImageReader};

use crate::budget::Account;
use crate::color::Primaries;
use crate::error::{Error, Problem, Result};
use crate::image::{Encoding, Image, Picture};

/// Decodes the bytes of a file of this format.
pub(super) fn decode(bytes: &[u8], format: ImageFormat, account: &Account) -> Result<Picture> {
    let mut allowed = ::image::Limits::default();
    allowed.max_alloc = account.left();
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.limits(allowed);
    let decoder = reader.into_decoder().map_err(refused)?;
    let (width, height) = decoder.dimensions();
    let color = decoder.color_type();
    let names = channel_names(color)?;
    // PNG: deflate makes at most 1032 bytes of one, and a byte holds 8 pixels of up to 4 channels.
    // The others code runs of at most 255 pixels in two bytes.
    let most_per_byte = match format {
        ImageFormat::Png => 1032 * 8 * 4,
        _ => 4096,
    };
    check_size([width, height], names.len(), most_per_byte, bytes, account)?;
    let raw = bytes_of(decoder)?;
    let data = match color {
        ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => {
            let (values, _) = raw.as_chunks::<2>();
            let value = |&b: &[u8; 2]| f32::from(u16::from_ne_bytes(b)) / 65535.0;
            values.iter().map(value).collect()
        }
        _ => codes(&raw),
    };
    Ok(Picture {
        image: Image::from_data(width, height, names, data)?,
        encoding: Encoding::Srgb,
        metadata: Vec::new(),
        warnings: foreign(bytes, format),
    })
}

/// What to say of a PNG whose codes are another display's than sRGB's (ITU-T H.273; PNG, third edition, 2025).
fn foreign(bytes: &[u8], format: ImageFormat) -> Vec<Problem> {
    const BT709: u8 = 1;
    const SRGB: u8 = 13;
    if format != ImageFormat::Png {
        return Vec::new();
    }
    let chunk = |kind: &[u8; 4]| chunks(bytes).find_map(|(k, data)| (k == *kind).then_some(data));
    let Some(&[primaries, transfer, ..]) = chunk(b"cICP") else {
        // A profile, and the word that all is sRGB, go before these.
        return match chunk(b"iCCP").or(chunk(b"sRGB")) {
            Some(_) => Vec::new(),
            None => unlike_srgb(chunk(b"gAMA"), chunk(b"cHRM")),
        };
    };
    if (primaries, transfer) == (BT709, SRGB) {
        return Vec::new();
    }
    let space = match primaries {
        BT709 => "BT.709".to_owned(),
        9 => "BT.2020".to_owned(),
        12 => "P3".to_owned(),
        other => format!("number {other}"),
    };
    let curve = match transfer {
        SRGB => "sRGB".to_owned(),
        16 => "PQ".to_owned(),
        18 => "HLG".to_owned(),
        other => format!("number {other}"),
    };
    let message = format!(
        "the file says that its primaries are {space} and its curve is {curve} (cICP): it is read as sRGB"
    );
    let told = Error::input(message).help("keep linear values in an EXR file");
    told.problems().to_vec()
}

/// What to say of a PNG whose exponent or whose chromaticities are far from sRGB's. Programs write 1/2.2 for sRGB's curve.
fn unlike_srgb(gamma: Option<&[u8]>, chromaticities: Option<&[u8]>) -> Vec<Problem> {
    const UNIT: f64 = 100_000.0;
    let numbers = |data: &[u8]| -> Vec<f64> {
        let (numbers, _) = data.as_chunks::<4>();
        let number = |b: &[u8; 4]| f64::from(u32::from_be_bytes(*b)) / UNIT;
        numbers.iter().map(number).collect()
    };
    let mut says = Vec::new();
    if let Some(&[gamma]) = gamma.map(numbers).as_deref()
        && (gamma * 2.2 - 1.0).abs() > 0.01
    {
        says.push(format!(
            "its codes are light to the power of {gamma} (gAMA)"
        ));
    }
    let Primaries {
        red,
        green,
        blue,
        white,
    } = Primaries::BT709;
    let srgb = [white, red, green, blue].concat();
    let found = chromaticities
        .map(numbers)
        .filter(|found| found.len() == srgb.len());
    let differs = |found: &Vec<f64>| found.iter().zip(&srgb).any(|(a, b)| (a - b).abs() > 0.005);
    if let Some(found) = found.filter(differs) {
        let [r, g, b] = [2, 4, 6].map(|i| format!("({}, {})", found[i], found[i + 1]));
        says.push(format!("its primaries are {r}, {g} and {b} (cHRM)"));
    }
    if says.is_empty() {
        return Vec::new();
    }
    let message = format!(
        "the file says that {}: it is read as sRGB",
        says.join(" and ")
    );
    let told = Error::input(message).help("keep linear values in an EXR file");
    told.problems().to_vec()
}

/// Names and data of a PNG's chunks ahead of its pixels.
fn chunks(png: &[u8]) -> impl Iterator<Item = ([u8; 4], &[u8])> {
    const SIGNATURE: usize = 8;
    const CHECKSUM: usize = 4;
    let mut rest = png.get(SIGNATURE..).unwrap_or_default();
    std::iter::from_fn(move || {
        let (length, after) = rest.split_first_chunk::<4>()?;
        let (kind, data) = after.split_first_chunk::<4>()?;
        let length = u32::from_be_bytes(*length) as usize;
        rest = data.get(length.checked_add(CHECKSUM)?..)?;
        (kind != b"IDAT").then_some((*kind, &data[..length]))
    })
}

/// All that a decoder of the crate `image` makes.
pub(super) fn bytes_of(decoder: impl ImageDecoder) -> Result<Vec<u8>> {
    let mut raw = Vec::new();
    let length = decoder.total_bytes() as usize;
    raw.try_reserve_exact(length)
        .map_err(|_| Error::input("the image does not fit into memory"))?;
    raw.resize(length, 0);
    decoder.read_image(&mut raw).map_err(refused)?;
    Ok(raw)
}

/// 8-bit codes in [0, 1].
pub(super) fn codes(bytes: &[u8]) -> Vec<f32> {
    bytes.iter().map(|&v| f32::from(v) / 255.0).collect()
}

pub(super) fn refused(error: ImageError) -> Error {
    match error {
        ImageError::Unsupported(e) => Error::unsupported(e.to_string()),
        ImageError::IoError(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
            Error::input("the file ends too early")
        }
        other => Error::input(other.to_string()),
    }
}

fn channel_names(color: ColorType) -> Result<Vec<String>> {
    let names: &[&str] = match color {
        ColorType::L8 | ColorType::L16 => &["Y"],
        ColorType::La8 | ColorType::La16 => &["Y", "A"],
        ColorType::Rgb8 | ColorType::Rgb16 => &["R", "G", "B"],
        ColorType::Rgba8 | ColorType::Rgba16 => &["R", "G", "B", "A"],
        other => return Err(Error::unsupported(format!("pixels of type {other:?}"))),
    };
    Ok(names.iter().map(ToString::to_string).collect())
}

/// Refuses sizes that a file of these `bytes` cannot hold, where each makes `most_per_byte` samples at the most, or
/// that the limit forbids.
pub(super) fn check_size(
    [width, height]: [u32; 2],
    channels: usize,
    most_per_byte: u64,
    bytes: &[u8],
    account: &Account,
) -> Result<()> {
    if width == 0 || height == 0 {
        return Err(Error::input("the image has no pixels"));
    }
    let samples = u128::from(width) * u128::from(height) * channels as u128;
    if samples / u128::from(most_per_byte) > bytes.len() as u128 {
        return Err(Error::input(format!(
            "a file of {} bytes cannot hold {width} × {height} pixels",
            bytes.len()
        )));
    }
    // As numbers, and at most so many bytes as the decoder has them.
    let bytes = u64::try_from(samples * 8).unwrap_or(u64::MAX);
    account.take_for(bytes, &format!("the image of {width} × {height} pixels"))
}
