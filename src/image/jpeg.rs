//! What the JPEG decoder does not tell: it fills the rest of a broken picture with grey, and it guesses
//! at inks. So the file's markers (ITU-T T.81, annex B) are walked first, which finds a file that ends
//! before its picture does, and a picture of other than one (grey) or three (colour) components.

use crate::error::{Error, Result};

const START_OF_IMAGE: u8 = 0xd8;
const END_OF_IMAGE: u8 = 0xd9;
const START_OF_SCAN: u8 = 0xda;

/// Refuses truncated files and those of other colours than grey and RGB.
pub(super) fn check(bytes: &[u8]) -> Result<()> {
    let mut rest = bytes;
    while let Some((marker, after)) = next_marker(rest) {
        rest = after;
        match marker {
            START_OF_IMAGE | 0x01 | 0xd0..=0xd7 => continue,
            END_OF_IMAGE => return Err(Error::input("the file holds no picture")),
            _ => {}
        }
        let Some(segment) = segment(rest) else { break };
        if marker == START_OF_SCAN {
            // Coded data holds no marker but restarts, so the picture's end cannot be mistaken.
            let ends = rest.windows(2).any(|pair| pair == [0xff, END_OF_IMAGE]);
            return if ends {
                Ok(())
            } else {
                Err(Error::input("the file ends in the middle of the picture"))
            };
        }
        // SOF0..SOF15, without the tables DHT, JPG and DAC that share the range.
        if (0xc0..=0xcf).contains(&marker) && ![0xc4, 0xc8, 0xcc].contains(&marker) {
            let components = segment.get(5).copied().unwrap_or(0);
            if components != 1 && components != 3 {
                return Err(Error::unsupported(format!(
                    "a JPEG of {components} components is neither grey nor RGB"
                ))
                .help("convert it to RGB"));
            }
        }
        rest = &rest[segment.len() + 2..];
    }
    Err(Error::input("the file ends before the picture begins"))
}

/// The next marker's code, and what follows it.
fn next_marker(bytes: &[u8]) -> Option<(u8, &[u8])> {
    let at = bytes
        .windows(2)
        .position(|pair| pair[0] == 0xff && pair[1] != 0 && pair[1] != 0xff)?;
    Some((bytes[at + 1], &bytes[at + 2..]))
}

/// The content of the segment that begins with its own length.
fn segment(bytes: &[u8]) -> Option<&[u8]> {
    let length = usize::from(u16::from_be_bytes([*bytes.first()?, *bytes.get(1)?]));
    bytes.get(2..length)
}
