//! From a scene file's bytes to its text: UTF-8, UTF-16 by its byte-order mark or its first tag, ISO-8859-1 where the
//! XML declaration says so, or with a warning where the text is nothing else.

use std::path::Path;

use super::xml::Text;
use crate::error::{Error, Location, Result};

/// The text that `bytes` stand for.
pub(super) fn decode(bytes: Vec<u8>, path: &Path) -> Result<Text> {
    let decoded = |text| Text {
        text,
        warning: None,
    };
    match bytes[..] {
        [0xFF, 0xFE, 0, 0, ..]
        | [0, 0, 0xFE, 0xFF, ..]
        | [b'<', 0, 0, 0, ..]
        | [0, 0, 0, b'<', ..] => {
            let error = Error::input("the text is UTF-32, which is not read");
            return Err(error.at(&Location::of_file(path)).help("save it as UTF-8"));
        }
        [0xFF, 0xFE, ..] => return utf16(&bytes[2..], u16::from_le_bytes, path).map(decoded),
        [0xFE, 0xFF, ..] => return utf16(&bytes[2..], u16::from_be_bytes, path).map(decoded),
        [b'<', 0, ..] => return utf16(&bytes, u16::from_le_bytes, path).map(decoded),
        [0, b'<', ..] => return utf16(&bytes, u16::from_be_bytes, path).map(decoded),
        _ => {}
    }
    if declares_latin1(&bytes) {
        return Ok(decoded(latin1(&bytes)));
    }
    let wrong = match String::from_utf8(bytes) {
        Ok(text) => return Ok(decoded(text)),
        Err(wrong) => wrong,
    };
    let valid = wrong.utf8_error().valid_up_to();
    let line = 1 + wrong.as_bytes()[..valid]
        .iter()
        .filter(|&&b| b == b'\n')
        .count();
    let place = Location::of_line(path, u32::try_from(line).unwrap_or(u32::MAX));
    let warning = Error::input("the text is not UTF-8, and is read as ISO-8859-1").at(&place);
    Ok(Text {
        text: latin1(wrong.as_bytes()),
        warning: Some(warning.help("save it as UTF-8, or declare its encoding in <?xml … ?>")),
    })
}

fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16, path: &Path) -> Result<String> {
    let (pairs, rest) = bytes.as_chunks::<2>();
    let units = pairs.iter().map(|pair| unit(*pair));
    let text: std::result::Result<String, _> = char::decode_utf16(units).collect();
    match text {
        Ok(text) if rest.is_empty() => Ok(text),
        _ => Err(Error::input("the text is not valid UTF-16").at(&Location::of_file(path))),
    }
}

/// Every byte is the character of that number.
fn latin1(bytes: &[u8]) -> String {
    bytes.iter().copied().map(char::from).collect()
}

/// Whether the XML declaration names ISO-8859-1, or windows-1252, which differs in punctuation alone.
fn declares_latin1(bytes: &[u8]) -> bool {
    const LONGEST: usize = 200;
    const NAMES: [&[u8]; 5] = [
        b"iso-8859-1",
        b"iso_8859-1",
        b"latin1",
        b"latin-1",
        b"windows-1252",
    ];
    let Some(rest) = bytes.strip_prefix(b"<?xml") else {
        return false;
    };
    let rest = &rest[..rest.len().min(LONGEST)];
    let declaration = rest
        .split(|&b| b == b'>')
        .next()
        .unwrap_or_default()
        .to_ascii_lowercase();
    let mut words = declaration
        .split(|b| b" \t\r\n='\"?".contains(b))
        .filter(|word| !word.is_empty());
    words.any(|word| word == b"encoding") && words.next().is_some_and(|word| NAMES.contains(&word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_encoding_gives_the_same_text() {
        let scene = "<scene version='3.0.0' id='grün'/>";
        let utf16 = |unit: fn(u16) -> [u8; 2], text: &str| -> Vec<u8> {
            text.encode_utf16().flat_map(unit).collect()
        };
        let marked = format!("\u{feff}{scene}");
        let latin1: Vec<u8> = scene.chars().map(|c| c as u8).collect();
        for bytes in [
            scene.as_bytes().to_vec(),
            utf16(u16::to_le_bytes, scene),
            utf16(u16::to_be_bytes, scene),
            utf16(u16::to_le_bytes, &marked),
            utf16(u16::to_be_bytes, &marked),
        ] {
            let read = decode(bytes, Path::new("a.xml")).unwrap();
            assert_eq!(read.text, scene);
            assert!(read.warning.is_none());
        }
        let read = decode(latin1.clone(), Path::new("a.xml")).unwrap();
        assert_eq!(read.text, scene);
        let warning = read.warning.unwrap().to_string();
        assert!(
            warning.starts_with("a.xml:1: the text is not UTF-8"),
            "{warning}"
        );
        for name in ["ISO-8859-1", "latin1", "Windows-1252"] {
            let declaration = format!("<?xml version=\"1.0\" encoding = '{name}' ?>");
            let bytes = [declaration.as_bytes(), &latin1].concat();
            let read = decode(bytes, Path::new("a.xml")).unwrap();
            assert_eq!(read.text, format!("{declaration}{scene}"));
            assert!(read.warning.is_none());
        }
    }

    #[test]
    fn what_is_cut_or_unknown_is_refused() {
        for (bytes, part) in [
            (&b"\xff\xfe\0\0<\0\0\0"[..], "UTF-32"),
            (b"<\0s", "not valid UTF-16"),
            (b"\xfe\xff\xd8\0\0<", "not valid UTF-16"),
        ] {
            let message = decode(bytes.to_vec(), Path::new("a.xml"))
                .unwrap_err()
                .to_string();
            assert!(message.contains(part), "{message}");
        }
    }
}
