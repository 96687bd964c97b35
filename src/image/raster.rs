//! Pictures by the crate `image`: PNG, JPEG, BMP and TGA, whose integers become code values in [0, 1]
//! (v / 255 or v / 65535, not decoded), and Radiance HDR, whose values are linear already.

use std::io::Cursor;

use ::image::{ColorType, ImageDecoder, ImageError, ImageFormat, ImageReader};

use crate::error::{Error, Result};
use crate::image::{Encoding, Image, Limits, Picture, jpeg};

/// Decodes the bytes of a file of this format.
pub(super) fn decode(bytes: &[u8], format: ImageFormat, limits: &Limits) -> Result<Picture> {
    if format == ImageFormat::Jpeg {
        jpeg::check(bytes)?;
    }
    let mut allowed = ::image::Limits::default();
    allowed.max_alloc = Some(limits.max_bytes);
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.limits(allowed);
    let decoder = reader.into_decoder().map_err(refused)?;
    let (width, height) = decoder.dimensions();
    let color = decoder.color_type();
    let names = channel_names(color)?;
    check_size(
        (width, height),
        names.len(),
        decoder.total_bytes(),
        format,
        bytes,
        limits,
    )?;

    let mut raw = Vec::new();
    let length = decoder.total_bytes() as usize;
    raw.try_reserve_exact(length)
        .map_err(|_| Error::input("the image does not fit into memory"))?;
    raw.resize(length, 0);
    decoder.read_image(&mut raw).map_err(refused)?;

    let data: Vec<f32> = match color {
        ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => {
            raw.iter().map(|&v| f32::from(v) / 255.0).collect()
        }
        ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => {
            let (values, _) = raw.as_chunks::<2>();
            let value = |&b: &[u8; 2]| f32::from(u16::from_ne_bytes(b)) / 65535.0;
            values.iter().map(value).collect()
        }
        _ => {
            let (values, _) = raw.as_chunks::<4>();
            values.iter().map(|&b| f32::from_ne_bytes(b)).collect()
        }
    };
    let encoding = if format == ImageFormat::Hdr {
        Encoding::Linear
    } else {
        Encoding::Srgb
    };
    Ok(Picture {
        image: Image::from_data(width, height, names, data)?,
        encoding,
        metadata: Vec::new(),
    })
}

fn refused(error: ImageError) -> Error {
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
        ColorType::Rgb8 | ColorType::Rgb16 | ColorType::Rgb32F => &["R", "G", "B"],
        ColorType::Rgba8 | ColorType::Rgba16 | ColorType::Rgba32F => &["R", "G", "B", "A"],
        other => return Err(Error::unsupported(format!("pixels of type {other:?}"))),
    };
    Ok(names.iter().map(ToString::to_string).collect())
}

/// Refuses sizes that the file cannot hold or the limit forbids.
fn check_size(
    (width, height): (u32, u32),
    channels: usize,
    raw_bytes: u64,
    format: ImageFormat,
    bytes: &[u8],
    limits: &Limits,
) -> Result<()> {
    if width == 0 || height == 0 {
        return Err(Error::input("the image has no pixels"));
    }
    // PNG: deflate makes at most 1032 bytes of one, and a byte holds 8 pixels of up to 4 channels.
    // The others code runs of at most 255 pixels in two bytes or, in JPEG, 64 samples in a bit.
    let most_per_byte = match format {
        ImageFormat::Png => 1032 * 8 * 4,
        _ => 4096,
    };
    if raw_bytes / most_per_byte > bytes.len() as u64 {
        return Err(Error::input(format!(
            "a file of {} bytes cannot hold {width} × {height} pixels",
            bytes.len()
        )));
    }
    let samples = u128::from(width) * u128::from(height) * channels as u128;
    limits.check(width.into(), height.into(), samples * 4)
}
