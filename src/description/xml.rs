//! From bytes to an XML tree and from offsets to lines and columns. Comments and document types that XML forbids but
//! Mitsuba passes over are passed over here too; what makes an XML reader slow or greedy (entities, namespaces,
//! thousands of attributes in one tag) is refused, for a scene has no use for it.

use std::borrow::Cow;
use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

use roxmltree::{Document, ParsingOptions};

use super::encoding;
use crate::error::{Error, Location, Result};

/// Bytes in one scene file: about a million shapes.
pub(super) const MAX_BYTES: u64 = 256 << 20;
/// Elements, comments and texts in one scene file.
const MAX_NODES: u32 = 8_000_000;
/// Attributes in one tag; the XML reader compares each with all before it.
const MAX_ATTRIBUTES: usize = 1000;

/// A file's text.
#[derive(Debug)]
pub(super) struct Text {
    pub(super) text: String,
    /// What is odd about it.
    pub(super) warning: Option<Error>,
}

/// The text of a regular file of at most [`MAX_BYTES`].
pub(super) fn read_text(path: &Path) -> Result<Text> {
    let refused = |cause| Error::system("read", path, &cause);
    // Asked before it is opened, as opening a pipe may wait for ever.
    if !std::fs::metadata(path).map_err(refused)?.is_file() {
        return Err(Error::input("not a regular file").at(&Location::of_file(path)));
    }
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(refused)?;
    file.take(MAX_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(refused)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(Error::input(format!("larger than {} MiB", MAX_BYTES >> 20))
            .at(&Location::of_file(path)));
    }
    encoding::decode(bytes, path)
}

/// `text` with spaces in place of what Mitsuba passes over though XML forbids it, or has no use for: the inside of
/// comments that hold `--`, and the document type. Every offset stays what it was.
pub(super) fn tidy(text: &str) -> Cow<'_, str> {
    let mut blanks = Vec::new();
    let mut next = 0;
    while let Some(start) = text[next..].find("<!").map(|i| next + i) {
        let rest = &text[start..];
        if let Some(inside) = rest.strip_prefix("<!--") {
            let Some(length) = inside.find("-->") else {
                break;
            };
            let comment = &inside[..length];
            if comment.contains("--") || comment.ends_with('-') {
                blanks.push(start + 4..start + 4 + length);
            }
            next = start + 4 + length + 3;
        } else if rest.starts_with("<![CDATA[") {
            match rest.find("]]>") {
                Some(length) => next = start + length,
                None => break,
            }
        } else if rest.starts_with("<!DOCTYPE") {
            let Some(length) = document_type(rest) else {
                break;
            };
            blanks.push(start..start + length);
            next = start + length;
        } else {
            next = start + 2;
        }
    }
    if blanks.is_empty() {
        return Cow::Borrowed(text);
    }
    let mut tidied = String::with_capacity(text.len());
    for range in blanks {
        tidied.push_str(&text[tidied.len()..range.start]);
        // A space a byte, so that offsets stay; lines stay too.
        let blank = |b| if b == b'\n' { '\n' } else { ' ' };
        tidied.extend(text[range].bytes().map(blank));
    }
    tidied.push_str(&text[tidied.len()..]);
    Cow::Owned(tidied)
}

/// How long the document type is that `text` begins with; `None` where it does not end.
fn document_type(text: &str) -> Option<usize> {
    let (mut depth, mut quote) = (0_usize, None);
    for (i, b) in text.bytes().enumerate() {
        match (quote, b) {
            (Some(q), _) if q == b => quote = None,
            (Some(_), _) => {}
            (None, b'"' | b'\'') => quote = Some(b),
            (None, b'<' | b'[') => depth += 1,
            (None, b'>' | b']') => {
                depth = depth.checked_sub(1)?;
                if depth == 0 {
                    return Some(i + 1);
                }
            }
            _ => {}
        }
    }
    None
}

/// The XML tree of a `text` that is [tidy](tidy); syntax errors are located.
pub(super) fn parse<'t>(text: &'t str, lines: &Lines<'t>) -> Result<Document<'t>> {
    if text.len() as u64 > MAX_BYTES {
        return Err(Error::input(format!("larger than {} MiB", MAX_BYTES >> 20)).at(&lines.at(0)));
    }
    refuse_greedy_tags(text, lines)?;
    let options = ParsingOptions {
        nodes_limit: MAX_NODES,
        ..ParsingOptions::default()
    };
    Document::parse_with_options(text, options).map_err(|e| {
        let pos = e.pos();
        let message = match e {
            roxmltree::Error::DtdDetected => "the document type does not end".into(),
            roxmltree::Error::UnknownEntityReference(name, _) => {
                format!("a scene has no entities: write out what &{name}; stands for")
            }
            roxmltree::Error::NodesLimitReached => format!("more than {MAX_NODES} XML nodes"),
            roxmltree::Error::UnclosedRootNode | roxmltree::Error::UnexpectedEndOfStream => {
                "the file ends inside an element".into()
            }
            roxmltree::Error::InvalidChar(b'"' | b'\'', b'<', _) => {
                "'<' inside an attribute: close the quotes, or write &lt;".into()
            }
            roxmltree::Error::UnexpectedCloseTag(open, close, _) => {
                format!("<{open}> is still open at </{close}>: close it by </{open}>")
            }
            roxmltree::Error::MalformedEntityReference(_) => "write &amp; for &".into(),
            roxmltree::Error::InvalidChar2("a whitespace", _, _) => {
                "a space is wanted here; is a quote missing before?".into()
            }
            _ => e.to_string().replace(&format!(" at {pos}"), ""),
        };
        Error::input(format!("not well-formed XML: {message}")).at(&Location {
            file: lines.file.clone(),
            line: pos.row,
            column: pos.col,
        })
    })
}

fn refuse_greedy_tags(text: &str, lines: &Lines<'_>) -> Result<()> {
    let mut next = 0;
    for piece in text.split('<') {
        // Where its `<` stands, which the first piece lacks.
        let start = usize::saturating_sub(next, 1);
        next += piece.len() + 1;
        // A tag with its attributes has no `<` inside, so that each piece holds at most one.
        if !piece.starts_with(['!', '?', '/']) {
            if piece
                .bytes()
                .filter(|&b| b == b'=')
                .take(MAX_ATTRIBUTES + 1)
                .count()
                > MAX_ATTRIBUTES
            {
                return Err(Error::input(format!(
                    "more than {MAX_ATTRIBUTES} attributes in a tag"
                ))
                .at(&lines.at(start)));
            }
            if piece.contains("xmlns") {
                return Err(
                    Error::input("a scene has no namespaces: remove xmlns").at(&lines.at(start))
                );
            }
        }
    }
    Ok(())
}

/// Finds line and column of an offset, in time that depends neither on the offset nor on the line's length.
#[derive(Debug)]
pub(super) struct Lines<'t> {
    pub(super) file: Arc<Path>,
    text: &'t [u8],
    /// Offset of each line's first byte.
    starts: Vec<usize>,
    /// Characters before each block of [`Lines::BLOCK`] bytes.
    characters: Vec<usize>,
}

impl<'t> Lines<'t> {
    const BLOCK: usize = 1024;

    pub(super) fn new(text: &'t str, file: &Path) -> Self {
        let text = text.as_bytes();
        let newlines = text.iter().enumerate().filter(|&(_, &b)| b == b'\n');
        let starts = std::iter::once(0)
            .chain(newlines.map(|(i, _)| i + 1))
            .collect();
        let mut characters = vec![0];
        for block in text.chunks(Self::BLOCK) {
            let before = characters[characters.len() - 1];
            characters.push(before + count_characters(block));
        }
        Self {
            file: file.into(),
            text,
            starts,
            characters,
        }
    }

    pub(super) fn at(&self, offset: usize) -> Location {
        let offset = offset.min(self.text.len());
        let line = self.starts.partition_point(|&start| start <= offset);
        let start = self.starts[line - 1];
        let column = if offset - start <= Self::BLOCK {
            count_characters(&self.text[start..offset])
        } else {
            self.characters_before(offset) - self.characters_before(start)
        };
        Location {
            file: self.file.clone(),
            line: u32::try_from(line).unwrap_or(u32::MAX),
            column: u32::try_from(column + 1).unwrap_or(u32::MAX),
        }
    }

    fn characters_before(&self, offset: usize) -> usize {
        let block = offset / Self::BLOCK;
        self.characters[block] + count_characters(&self.text[block * Self::BLOCK..offset])
    }
}

/// Bytes that begin a UTF-8 character.
fn count_characters(bytes: &[u8]) -> usize {
    bytes.iter().filter(|&&b| b & 0xC0 != 0x80).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_counts_characters_from_the_start_of_its_line() {
        let text = format!("é\nüb{}x\n", "ß".repeat(5000));
        let lines = Lines::new(&text, Path::new("a.xml"));
        let x = lines.at(text.find('x').expect("it is there"));
        assert_eq!((x.line, x.column), (2, 5003));
        assert_eq!((lines.at(0).line, lines.at(0).column), (1, 1));
        let end = lines.at(usize::MAX);
        assert_eq!((end.line, end.column), (3, 1));
    }

    #[test]
    fn a_hundred_thousand_attributes_are_refused_at_once() {
        let attributes: String = (0..100_000).map(|i| format!(" a{i}='1'")).collect();
        let text = format!("<scene{attributes}/>");
        let error = parse(&text, &Lines::new(&text, Path::new("a.xml"))).unwrap_err();
        assert!(error.to_string().contains("more than 1000 attributes"));
    }

    #[test]
    fn what_is_passed_over_leaves_everything_in_its_place() {
        let plain = "<a><!-- é - x --><![CDATA[<!-- -- -->]]></a>";
        assert!(matches!(tidy(plain), Cow::Borrowed(_)));
        for (text, expected) in [
            ("<a><!--é--é\n-->b", "<a><!--      \n-->b"),
            ("<!--x---><a/>", "<!--  --><a/>"),
            (
                "<!DOCTYPE a SYSTEM 'a>' [<!ENTITY x \"]>\">]><a/>",
                "                                           <a/>",
            ),
        ] {
            assert_eq!(tidy(text), expected);
        }
        for open in [
            "<!-- -- ",
            "<!DOCTYPE a [",
            "<!DOCTYPE '>",
            "<![CDATA[ <!-- -- -->",
        ] {
            assert_eq!(tidy(open), open);
        }
    }
}
