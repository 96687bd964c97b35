//! PFM, the portable float map (Paul Debevec, 1999): "PF" (RGB) or "Pf" (grey), width, height and a number whose size
//! multiplies the values and whose sign says the order of bytes, below 0 the least significant one first; then
//! floats, the bottom row first. Values are linear.

use super::raster::check_size;
use crate::budget::Account;
use crate::error::{Error, Result};
use crate::image::{Encoding, Image, Picture};

/// The next word of the header, and what follows the one space or line end behind it.
fn word(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let bytes = bytes.trim_ascii_start();
    let end = bytes.iter().position(u8::is_ascii_whitespace)?;
    let (word, rest) = bytes.split_at(end);
    let rest = rest.strip_prefix(b"\r\n").unwrap_or(&rest[1..]);
    Some((str::from_utf8(word).ok()?, rest))
}

/// What stands before the pixels.
struct Header<'a> {
    width: u32,
    height: u32,
    scale: f32,
    pixels: &'a [u8],
}

impl<'a> Header<'a> {
    /// From what follows the file's mark.
    fn read(bytes: &'a [u8]) -> Option<Self> {
        let (width, bytes) = word(bytes)?;
        let (height, bytes) = word(bytes)?;
        let (scale, pixels) = word(bytes)?;
        let scale: f32 = scale.parse().ok()?;
        scale.is_finite().then_some(Self {
            width: width.parse().ok()?,
            height: height.parse().ok()?,
            scale,
            pixels,
        })
    }
}

/// The bytes of a PFM file with an image's main colour.
pub(super) fn encode(image: &Image) -> Result<Vec<u8>> {
    let Some(rgb) = image.rgb() else {
        return Err(Error::input("a PFM image needs channels R, G, B or Y")
            .help("write EXR, which takes any channels"));
    };
    let (mark, colour) = match rgb {
        [r, g, _] if r == g => ("Pf", &rgb[..1]),
        _ => ("PF", &rgb[..]),
    };
    let (width, height) = (image.width(), image.height());
    let mut bytes = format!("{mark}\n{width} {height}\n-1.0\n").into_bytes();
    for y in (0..height).rev() {
        for x in 0..width {
            let pixel = image.pixel(x, y);
            bytes.extend(colour.iter().flat_map(|c| pixel[*c].to_le_bytes()));
        }
    }
    Ok(bytes)
}

/// Decodes the bytes of a PFM file.
pub(super) fn decode(bytes: &[u8], account: &Account) -> Result<Picture> {
    let names: &[&str] = if bytes.starts_with(b"PF") {
        &["R", "G", "B"]
    } else {
        &["Y"]
    };
    let Some(header) = Header::read(&bytes[2..]) else {
        let error = Error::input("the header of the PFM file is damaged");
        return Err(error.help("it must have a width, a height and a scale"));
    };
    let Header {
        width,
        height,
        scale,
        pixels,
    } = header;
    check_size([width, height], names.len(), 1, bytes, account)?;
    let length = width as usize * names.len();
    let Some(pixels) = pixels.get(..length * height as usize * 4) else {
        return Err(Error::input("the file ends too early"));
    };
    let (values, _) = pixels.as_chunks::<4>();
    let value = |&bytes: &[u8; 4]| {
        let value = if scale > 0.0 {
            f32::from_be_bytes(bytes)
        } else {
            f32::from_le_bytes(bytes)
        };
        if scale.abs() == 1.0 {
            value
        } else {
            value * scale.abs()
        }
    };
    let rows = values.chunks_exact(length).rev();
    let data = rows.flatten().map(value).collect();
    Ok(Picture {
        image: Image::from_data(
            width,
            height,
            names.iter().map(ToString::to_string).collect(),
            data,
        )?,
        encoding: Encoding::Linear,
        metadata: Vec::new(),
        warnings: Vec::new(),
    })
}
