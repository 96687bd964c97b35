//! JPEG, grey or RGB with 8 bits a sample, as libjpeg-turbo decodes it, to the bit: its exact inverse transform, and
//! its interpolation of chroma (ITU-T T.81 and T.871 leave both to the decoder). The last marker may be
//! missing; what ends before its last sample is an error, and so is anything else that is damaged.

use libjpeg_turbo_rs::{DecodeLimits, Decoder, JpegError, PixelFormat};

use super::raster::{check_size, codes};
use crate::budget::Account;
use crate::error::{Error, Result};
use crate::image::{Encoding, Image, Picture};

/// How many bytes of samples a byte of the file can make: 64 in a bit.
const MOST_PER_BYTE: u64 = 4096;
/// More passes over a picture than any encoder makes; each of them takes time.
const MOST_SCANS: usize = 1000;

/// Decodes the bytes of a JPEG file.
pub(super) fn decode(bytes: &[u8], account: &Account) -> Result<Picture> {
    const END_OF_IMAGE: [u8; 2] = [0xff, 0xd9];
    match decode_marked(bytes, account) {
        // Of several scans the decoder wants to see the end.
        Err(Refusal::Early) => decode_marked(&[bytes, &END_OF_IMAGE].concat(), account),
        result => result,
    }
    .map_err(|refusal| match refusal {
        Refusal::Early => Error::input("the file ends too early"),
        Refusal::Other(error) => error,
    })
}

/// Why a file is not decoded.
enum Refusal {
    /// It ends before its picture does.
    Early,
    Other(Error),
}

impl From<Error> for Refusal {
    fn from(error: Error) -> Self {
        Self::Other(error)
    }
}

impl From<JpegError> for Refusal {
    fn from(error: JpegError) -> Self {
        Self::Other(match error {
            JpegError::UnexpectedEof => return Self::Early,
            JpegError::Unsupported(what) => Error::unsupported(what),
            other => Error::input(other.to_string()),
        })
    }
}

fn decode_marked(bytes: &[u8], account: &Account) -> std::result::Result<Picture, Refusal> {
    let most = DecodeLimits {
        max_width: u16::MAX.into(),
        max_height: u16::MAX.into(),
        max_pixels: u64::MAX,
        max_scans: MOST_SCANS,
        // The samples in all their forms take fewer bytes than the image, which the limits bound.
        max_memory: None,
    };
    let mut decoder = Decoder::new_with_limits(bytes, most)?;
    let header = decoder.header();
    let (width, height) = (u32::from(header.width), u32::from(header.height));
    let (names, pixels): (&[&str], _) = match header.components.len() {
        1 => (&["Y"], PixelFormat::Grayscale),
        3 => (&["R", "G", "B"], PixelFormat::Rgb),
        n => {
            let error =
                Error::unsupported(format!("a JPEG of {n} components is neither grey nor RGB"));
            return Err(error.help("convert it to RGB").into());
        }
    };
    if header.precision != 8 {
        let bits = header.precision;
        let error = Error::unsupported(format!("a JPEG of {bits} bits a sample"));
        return Err(error.help("convert it to 8 bits").into());
    }
    check_size([width, height], names.len(), MOST_PER_BYTE, bytes, account)?;
    decoder.set_output_format(pixels);
    // As libjpeg does where a progressive file lacks its last scans.
    decoder.set_block_smoothing(true);
    let decoded = decoder.decode_image()?;
    let names = names.iter().map(ToString::to_string).collect();
    Ok(Picture {
        image: Image::from_data(width, height, names, codes(&decoded.data))?,
        encoding: Encoding::Srgb,
        metadata: Vec::new(),
        warnings: Vec::new(),
    })
}
