//! The header of a PLY file: what elements follow, how many, and the types of their properties (Turk, "The
//! PLY polygon file format", 1994).

use crate::error::Result;
use crate::mesh::source::Source;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// A number's type in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn from_name(name: &str) -> Option<Self> {
        Some(match name.to_ascii_lowercase().as_str() {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes in a binary file.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    pub(super) fn is_integer(self) -> bool {
        self.greatest().is_some()
    }

    /// The greatest number of a type of whole numbers.
    pub(super) fn greatest(self) -> Option<f32> {
        Some(match self {
            Self::I8 => i8::MAX.into(),
            Self::U8 => u8::MAX.into(),
            Self::I16 => i16::MAX.into(),
            Self::U16 => u16::MAX.into(),
            Self::I32 => i32::MAX as f32,
            Self::U32 => u32::MAX as f32,
            Self::F32 | Self::F64 => return None,
        })
    }

    /// The number in the first bytes of `bytes`, exactly.
    ///
    /// # Panics
    /// Where there are fewer than [`Scalar::size`] bytes.
    pub(super) fn decode(self, bytes: &[u8], encoding: Encoding) -> f64 {
        fn first<const N: usize>(bytes: &[u8], encoding: Encoding) -> [u8; N] {
            let mut bytes = *bytes
                .first_chunk()
                .expect("the caller has counted the bytes");
            if encoding == Encoding::BigEndian {
                bytes.reverse();
            }
            bytes
        }
        match self {
            Self::I8 => i8::from_le_bytes(first(bytes, encoding)).into(),
            Self::U8 => u8::from_le_bytes(first(bytes, encoding)).into(),
            Self::I16 => i16::from_le_bytes(first(bytes, encoding)).into(),
            Self::U16 => u16::from_le_bytes(first(bytes, encoding)).into(),
            Self::I32 => i32::from_le_bytes(first(bytes, encoding)).into(),
            Self::U32 => u32::from_le_bytes(first(bytes, encoding)).into(),
            Self::F32 => f32::from_le_bytes(first(bytes, encoding)).into(),
            Self::F64 => f64::from_le_bytes(first(bytes, encoding)),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Scalar(Scalar),
    /// A count, then as many items.
    List {
        count: Scalar,
        item: Scalar,
    },
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: Kind,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Element {
    pub(super) name: String,
    /// Rows.
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

impl Element {
    /// Bytes of a row of a binary file, where all rows have the same.
    pub(super) fn stride(&self) -> Option<usize> {
        let size = |p: &Property| match p.kind {
            Kind::Scalar(scalar) => Some(scalar.size()),
            Kind::List { .. } => None,
        };
        self.properties.iter().map(size).sum()
    }

    /// The fewest bytes that a row can take.
    pub(super) fn least_row(&self, encoding: Encoding) -> u64 {
        let size = |p: &Property| match (encoding, p.kind) {
            // A digit and what divides it from the next.
            (Encoding::Ascii, _) => 2,
            (_, Kind::Scalar(scalar) | Kind::List { count: scalar, .. }) => scalar.size() as u64,
        };
        self.properties.iter().map(size).sum()
    }

    /// The place of the scalar property `name`, or of the first that is called so but for upper and lower case.
    pub(super) fn scalar(&self, name: &str) -> Option<usize> {
        let find = |is: fn(&str, &str) -> bool| {
            self.properties
                .iter()
                .position(|p| matches!(p.kind, Kind::Scalar(_)) && is(&p.name, name))
        };
        find(|a, b| a == b).or_else(|| find(str::eq_ignore_ascii_case))
    }
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// The pictures that comments name, as MeshLab writes them.
    pub(super) pictures: Vec<String>,
}

/// The elements that make a mesh.
pub(super) const WANTED: [&str; 2] = ["vertex", "face"];

impl Header {
    pub(super) fn read(source: &mut Source<'_>) -> Result<Self> {
        source.skip_mark()?;
        let first = source.line();
        if !first.is_ok_and(|line| line.trim_end().eq_ignore_ascii_case("ply")) {
            return Err(source
                .error_at_last_line("a PLY file begins with a line \"ply\"; this one does not"));
        }
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        let mut pictures = Vec::new();
        loop {
            let line = source.line()?;
            let mut words: Vec<&str> = line.split_ascii_whitespace().collect();
            let keyword = words.first().map(|word| word.to_ascii_lowercase());
            if let (Some(word), Some(keyword)) = (words.first_mut(), &keyword) {
                *word = keyword;
            }
            match words[..] {
                ["comment", "TextureFile", ..] => pictures.push(words[2..].join(" ")),
                [] | ["ply"] | ["comment" | "obj_info", ..] => {}
                ["format", name, "1.0"] => encoding = encoding_of(name),
                ["element", name, count] => {
                    let count = count.parse().map_err(|_| {
                        source.error_at_last_line(format!(
                            "an element needs a count from 0 on, not {count:?}"
                        ))
                    })?;
                    let name = WANTED
                        .into_iter()
                        .find(|wanted| name.eq_ignore_ascii_case(wanted))
                        .unwrap_or(name);
                    if elements.iter().any(|e| e.name == name) {
                        let message = format!("element {name:?} stands twice in the header");
                        return Err(source.error_at_last_line(message));
                    }
                    elements.push(Element {
                        name: name.to_owned(),
                        count,
                        properties: Vec::new(),
                    });
                }
                ["property", ref words @ ..] => {
                    let wrong = || {
                        let message = format!("malformed property: {:?}", shortened(&line));
                        let help = "wanted is \"property float x\" or \"property list uchar int vertex_indices\"";
                        source.error_at_last_line(message).help(help)
                    };
                    let property = property(words).ok_or_else(wrong)?;
                    elements
                        .last_mut()
                        .ok_or_else(wrong)?
                        .properties
                        .push(property);
                }
                ["end_header"] => break,
                _ => {
                    let message = format!("unknown header line {:?}", shortened(&line));
                    return Err(source.error_at_last_line(message));
                }
            }
        }
        let encoding = encoding.ok_or_else(|| {
            source.error_at_last_line("the header names no format that is known").help(
                "wanted is \"format\", then ascii, binary_little_endian or binary_big_endian, then 1.0",
            )
        })?;
        Ok(Self {
            encoding,
            elements,
            pictures,
        })
    }
}

fn encoding_of(name: &str) -> Option<Encoding> {
    Some(match name.to_ascii_lowercase().as_str() {
        "ascii" => Encoding::Ascii,
        "binary_little_endian" => Encoding::LittleEndian,
        "binary_big_endian" => Encoding::BigEndian,
        _ => return None,
    })
}

fn property(words: &[&str]) -> Option<Property> {
    let (kind, name) = match *words {
        [list, count, item, name] if list.eq_ignore_ascii_case("list") => {
            let count = Scalar::from_name(count).filter(|c| c.is_integer())?;
            (
                Kind::List {
                    count,
                    item: Scalar::from_name(item)?,
                },
                name,
            )
        }
        [scalar, name] => (Kind::Scalar(Scalar::from_name(scalar)?), name),
        _ => return None,
    };
    Some(Property {
        name: name.to_owned(),
        kind,
    })
}

fn shortened(line: &str) -> String {
    line.chars().take(60).collect()
}
