//! Radiance HDR (RGBE: three mantissas of 8 bits and a shared exponent; Greg Ward, "Real Pixels", Graphics Gems
//! II, 1991). About 1 % precision, no negative values and no opacity. XYZE files become RGB; what the header says of
//! exposure is not applied, as in Mitsuba.

use std::io::{Cursor, Read};

use ::image::Rgb;
use ::image::codecs::hdr::{HdrDecoder, HdrEncoder};

use super::raster::{bytes_of, check_size, refused};
use crate::budget::Account;
use crate::color::Primaries;
use crate::error::{Error, Result};
use crate::image::{Encoding, Image, Picture};

/// The range of the shared exponent; what is smaller becomes 0, what is larger the largest.
const SMALLEST: f32 = 1e-38;
const LARGEST: f32 = 1.7e38;
/// A scan line's length is stored in 15 bits.
const WIDEST: u32 = 32_767;
/// How many samples a byte of the file can make: runs are of at most 255 pixels.
const MOST_PER_BYTE: u64 = 1024;

/// What the lines before the pixels say.
#[derive(Debug)]
struct Header<'a> {
    width: u32,
    height: u32,
    xyz: bool,
    pixels: &'a [u8],
}

impl<'a> Header<'a> {
    /// Reads lines up to the one with the resolution, whichever programs and remarks stand there.
    fn read(mut bytes: &'a [u8]) -> Result<Self> {
        let mut xyz = false;
        loop {
            let Some(end) = bytes.iter().position(|&b| b == b'\n') else {
                return Err(Error::input("the file ends too early, in its header"));
            };
            let line = bytes[..end].trim_ascii();
            bytes = &bytes[end + 1..];
            if let Some(format) = line.strip_prefix(b"FORMAT=") {
                xyz = match format {
                    b"32-bit_rle_rgbe" => false,
                    b"32-bit_rle_xyze" => true,
                    _ => {
                        let name = String::from_utf8_lossy(format);
                        let error = Error::unsupported(format!("HDR pixels of format {name:?}"));
                        return Err(error.help("there are 32-bit_rle_rgbe and 32-bit_rle_xyze"));
                    }
                };
            } else if let Some([height, width]) = resolution(line)? {
                return Ok(Self {
                    width,
                    height,
                    xyz,
                    pixels: bytes,
                });
            }
        }
    }
}

/// Rows and columns, if the line gives them: `-Y 768 +X 1024`.
fn resolution(line: &[u8]) -> Result<Option<[u32; 2]>> {
    let line = String::from_utf8_lossy(line);
    let words: Vec<&str> = line.split_ascii_whitespace().collect();
    let axis = |word: &str| matches!(word, "-X" | "+X" | "-Y" | "+Y");
    let [first, rows, second, columns] = words[..] else {
        return Ok(None);
    };
    if !axis(first) || !axis(second) {
        return Ok(None);
    }
    if [first, second] != ["-Y", "+X"] {
        let error = Error::unsupported(format!("an HDR image whose pixels run by {line:?}"));
        return Err(error.help("those by -Y rows +X columns, from the top left, are read"));
    }
    match (rows.parse(), columns.parse()) {
        (Ok(rows), Ok(columns)) => Ok(Some([rows, columns])),
        _ => Err(Error::input(format!("{line:?} is no size of an image"))),
    }
}

/// Decodes the bytes of a Radiance HDR file.
pub(super) fn decode(bytes: &[u8], account: &Account) -> Result<Picture> {
    let Header {
        width,
        height,
        xyz,
        pixels,
    } = Header::read(bytes)?;
    check_size([width, height], 3, MOST_PER_BYTE, bytes, account)?;
    // The crate decodes the pixels, but does not know all headers that are in use.
    let header = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n");
    let whole = Cursor::new(header).chain(pixels);
    let raw = bytes_of(HdrDecoder::new(whole).map_err(refused)?)?;
    let (values, _) = raw.as_chunks::<4>();
    let mut data: Vec<f32> = values.iter().map(|&b| f32::from_ne_bytes(b)).collect();
    if xyz {
        let to_rgb = Primaries::XYZ.to_bt709().expect("XYZ is a space");
        let (pixels, _) = data.as_chunks_mut::<3>();
        for pixel in pixels {
            *pixel = to_rgb(*pixel);
        }
    }
    let names = ["R", "G", "B"].map(String::from).to_vec();
    Ok(Picture {
        image: Image::from_data(width, height, names, data)?,
        encoding: Encoding::Linear,
        metadata: Vec::new(),
        warnings: Vec::new(),
    })
}

/// The bytes of a Radiance HDR file of the image's main colour.
pub(super) fn encode(image: &Image) -> Result<Vec<u8>> {
    let image = &*image.in_rgb();
    let Some(colour) = image.rgb() else {
        return Err(Error::input("an HDR file needs channels R, G, B or Y")
            .help("write EXR, which takes any channels"));
    };
    if image.width() > WIDEST || image.width() == 0 || image.height() == 0 {
        return Err(Error::input(format!(
            "an HDR file cannot hold {} × {} pixels",
            image.width(),
            image.height()
        ))
        .help("write EXR"));
    }
    // NaN is neither, and becomes 0.
    let storable = |v: f32| if v >= SMALLEST { v.min(LARGEST) } else { 0.0 };
    let pixels: Vec<Rgb<f32>> = image
        .data()
        .chunks_exact(image.channels().len())
        .map(|pixel| Rgb(colour.map(|c| storable(pixel[c]))))
        .collect();
    let mut bytes = Vec::new();
    HdrEncoder::new(&mut bytes)
        .encode(&pixels, image.width() as usize, image.height() as usize)
        .map_err(|e| Error::input(format!("the image cannot be stored as HDR: {e}")))?;
    Ok(bytes)
}
