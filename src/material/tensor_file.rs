//! Tensor files, which hold named arrays: the format of the measured materials of EPFL's Realistic Graphics Lab, and of
//! Mitsuba. After the magic `tensor_file\0` and a version of two bytes stands the number of fields (32 bits); each has
//! its name (16 bits for the length), its number of dimensions (16 bits), its type (8 bits), the place of its data in the
//! file (64 bits) and its dimensions (64 bits each). All numbers are little-endian.

use std::collections::HashMap;
use std::path::Path;

use crate::budget::Budget;
use crate::error::{Error, Result};

/// The fields of a file that are of a kind that is used here.
#[derive(Debug)]
pub(super) struct TensorFile {
    arrays: HashMap<String, Array>,
}

/// An array of numbers.
#[derive(Clone, Debug)]
pub(super) struct Array {
    /// The outermost dimension first; at least one, and none is 0.
    pub(super) shape: Vec<usize>,
    /// Row by row, finite; integers of eight bits are here as numbers too.
    pub(super) values: Vec<f32>,
}

const MAGIC: &[u8] = b"tensor_file\0";
/// Codes of types: eight bits without sign, and single precision.
const BYTE: u8 = 1;
const SINGLE: u8 = 10;
/// The most dimensions and fields.
const DIMENSIONS: usize = 16;
const FIELDS: usize = 1024;

/// The bytes of a file that are not read yet.
struct Cursor<'a>(&'a [u8]);

impl<'a> Cursor<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn number(&mut self, bytes: usize) -> Option<u64> {
        let taken = self.take(bytes)?;
        Some(
            taken
                .iter()
                .rev()
                .fold(0, |n, byte| n << 8 | u64::from(*byte)),
        )
    }
}

impl TensorFile {
    /// Reads the arrays of bytes and of single precision; those of other types are left out.
    ///
    /// # Errors
    /// Where the file is none, is cut off, holds what is no number, or is larger than the budget has room for.
    pub(super) fn read(path: &Path, budget: &Budget) -> Result<Self> {
        let length = std::fs::metadata(path)
            .map_err(|e| Error::system("read", path, &e))?
            .len();
        // The file, and its numbers.
        budget.open().take(2 * length)?;
        let bytes = std::fs::read(path).map_err(|e| Error::system("read", path, &e))?;
        let wrong = |what: &str| Error::input(format!("{}: {what}", path.display()));
        Self::parse(&bytes).map_err(|what| wrong(&what))
    }

    fn parse(bytes: &[u8]) -> std::result::Result<Self, String> {
        let cut = || "the file is cut off".to_owned();
        let mut cursor = Cursor(bytes);
        if cursor.take(MAGIC.len()) != Some(MAGIC) {
            return Err("no tensor file".to_owned());
        }
        cursor.number(2).ok_or_else(cut)?;
        let count = cursor.number(4).ok_or_else(cut)? as usize;
        if count > FIELDS {
            return Err(format!("{count} fields are more than {FIELDS}"));
        }
        let mut arrays = HashMap::new();
        for _ in 0..count {
            let length = cursor.number(2).ok_or_else(cut)? as usize;
            let name = String::from_utf8_lossy(cursor.take(length).ok_or_else(cut)?).into_owned();
            let dimensions = cursor.number(2).ok_or_else(cut)? as usize;
            if dimensions == 0 || dimensions > DIMENSIONS {
                return Err(format!("field {name:?} has {dimensions} dimensions"));
            }
            let kind = cursor.number(1).ok_or_else(cut)? as u8;
            let offset = cursor.number(8).ok_or_else(cut)?;
            let mut shape = Vec::with_capacity(dimensions);
            let mut total = 1usize;
            for _ in 0..dimensions {
                let size = cursor.number(8).ok_or_else(cut)?;
                let size = usize::try_from(size).ok().filter(|size| *size > 0);
                let size = size.ok_or_else(|| format!("field {name:?} is empty"))?;
                total = total.checked_mul(size).ok_or_else(cut)?;
                shape.push(size);
            }
            let width = match kind {
                BYTE => 1,
                SINGLE => 4,
                _ => continue,
            };
            let begin = usize::try_from(offset).map_err(|_| cut())?;
            let end = total
                .checked_mul(width)
                .and_then(|size| begin.checked_add(size));
            let data = end.and_then(|end| bytes.get(begin..end)).ok_or_else(cut)?;
            let single = |b: &[u8]| f32::from_le_bytes(b.try_into().expect("four bytes"));
            let values: Vec<f32> = match kind {
                BYTE => data.iter().map(|b| f32::from(*b)).collect(),
                _ => data.chunks_exact(4).map(single).collect(),
            };
            if values.iter().any(|value| !value.is_finite()) {
                return Err(format!("field {name:?} holds what is no finite number"));
            }
            arrays.insert(name, Array { shape, values });
        }
        Ok(Self { arrays })
    }

    /// The array of that name and number of dimensions.
    pub(super) fn array(
        &mut self,
        name: &str,
        dimensions: usize,
    ) -> std::result::Result<Array, String> {
        let array = self
            .arrays
            .remove(name)
            .ok_or_else(|| format!("the field {name:?} is lacking"))?;
        match array.shape.len() == dimensions {
            true => Ok(array),
            false => Err(format!(
                "field {name:?} has {} dimensions, and not {dimensions}",
                array.shape.len()
            )),
        }
    }

    /// Whether there is an array of that name.
    pub(super) fn has(&self, name: &str) -> bool {
        self.arrays.contains_key(name)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A file of these fields: bytes where all values are, and the name ends in `*`.
    pub(in crate::material) fn written(fields: &[(&str, &[usize], Vec<f32>)]) -> Vec<u8> {
        let name = |name: &str| name.trim_end_matches('*').to_owned();
        let head: usize = fields
            .iter()
            .map(|(n, s, _)| 2 + name(n).len() + 2 + 1 + 8 + 8 * s.len())
            .sum();
        let mut offset = MAGIC.len() + 6 + head;
        let mut file = [MAGIC, &[1, 0], &(fields.len() as u32).to_le_bytes()].concat();
        let mut data = Vec::new();
        for (text, shape, values) in fields {
            let bytes = text.ends_with('*');
            let text = name(text);
            file.extend((text.len() as u16).to_le_bytes());
            file.extend(text.as_bytes());
            file.extend((shape.len() as u16).to_le_bytes());
            file.push(if bytes { BYTE } else { SINGLE });
            file.extend((offset as u64).to_le_bytes());
            for size in *shape {
                file.extend((*size as u64).to_le_bytes());
            }
            let own: Vec<u8> = match bytes {
                true => values.iter().map(|v| *v as u8).collect(),
                false => values.iter().flat_map(|v| v.to_le_bytes()).collect(),
            };
            offset += own.len();
            data.extend(own);
        }
        file.extend(data);
        file
    }

    #[test]
    fn arrays_come_back_and_damaged_files_are_refused() {
        let bytes = written(&[
            ("a", &[2, 2], vec![1.0, 2.0, 3.0, 4.5]),
            ("text*", &[3], vec![7.0, 8.0, 9.0]),
        ]);
        let mut file = TensorFile::parse(&bytes).unwrap();
        assert!(file.has("a") && !file.has("b"));
        assert_eq!(file.array("a", 2).unwrap().values, [1.0, 2.0, 3.0, 4.5]);
        assert!(file.array("text", 2).unwrap_err().contains("dimensions"));
        assert!(file.array("b", 1).unwrap_err().contains("lacking"));
        for length in 0..bytes.len() {
            assert!(TensorFile::parse(&bytes[..length]).is_err(), "{length}");
        }
        for byte in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[byte] = 0xff;
            let _ = TensorFile::parse(&damaged);
        }
    }
}
