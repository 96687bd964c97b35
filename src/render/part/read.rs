//! Reading a part, record by record. No number in the file is believed before it has been compared with the file's length
//! and with the film's, and what was read counts once the hash at the end was found right.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;

use super::super::hashing::Hashing;
use super::{Head, MARK, Tail, damaged};
use crate::error::{Error, Result};
use crate::file;

/// Bytes asked of the system at a time.
const BUFFER: usize = 1 << 18;

/// A part that is being read.
#[derive(Debug)]
pub(in super::super) struct Reader {
    path: PathBuf,
    input: Hashing<BufReader<File>>,
    /// Bytes of the file.
    length: u64,
    pub(in super::super) head: Head,
    bytes: Vec<u8>,
}

/// Where numbers belong that follow.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Place {
    /// How many there are.
    pub(in super::super) count: usize,
    pub(in super::super) place: [u32; 4],
}

impl Reader {
    /// Reads what stands before the records.
    pub(in super::super) fn open(path: &Path) -> Result<Self> {
        let file = file::open(path).map_err(|e| refused(path, &e))?;
        let length = file.metadata().map_err(|e| refused(path, &e))?.len();
        let mut input = Hashing::new(BufReader::with_capacity(BUFFER, file));
        let mut mark = [0; MARK.len()];
        input.read_exact(&mut mark).map_err(|e| refused(path, &e))?;
        if &mark != MARK {
            let message = format!("{} is no part: it does not begin like one", path.display());
            let error = Error::input(message);
            return Err(error.help("parts are what `etendue render -o NAME.part` writes"));
        }
        let head: Head = json(path, &mut input, length)?;
        if !head.is_sound() {
            return Err(damaged(path, "its head makes no sense"));
        }
        Ok(Self {
            path: path.to_owned(),
            input,
            length,
            head,
            bytes: Vec::new(),
        })
    }

    /// Where the next numbers belong; `None` at their end.
    pub(in super::super) fn place(&mut self) -> Result<Option<Place>> {
        let mut numbers = [0; 5];
        for number in &mut numbers {
            let mut bytes = [0; 4];
            self.input
                .read_exact(&mut bytes)
                .map_err(|e| refused(&self.path, &e))?;
            *number = u32::from_le_bytes(bytes);
        }
        let [count, place @ ..] = numbers;
        if 8 * u64::from(count) > self.length {
            return Err(self.damaged("it is shorter than it says"));
        }
        let count = count as usize;
        Ok((count > 0).then_some(Place { count, place }))
    }

    /// The next numbers.
    pub(in super::super) fn numbers(&mut self, numbers: &mut [f64]) -> Result<()> {
        self.bytes.resize(8 * numbers.len(), 0);
        self.input
            .read_exact(&mut self.bytes)
            .map_err(|e| refused(&self.path, &e))?;
        for (number, bytes) in numbers.iter_mut().zip(self.bytes.as_chunks().0) {
            *number = f64::from_le_bytes(*bytes);
        }
        Ok(())
    }

    /// Reads what stands behind the records, and makes sure of all that was read.
    pub(in super::super) fn finish(mut self) -> Result<Tail> {
        let tail: Tail = json(&self.path, &mut self.input, self.length)?;
        let sealed = self
            .input
            .is_sealed()
            .map_err(|e| refused(&self.path, &e))?;
        let mut more = [0];
        let more = self
            .input
            .read(&mut more)
            .map_err(|e| refused(&self.path, &e))?;
        match (sealed, more) {
            (true, 0) => Ok(tail),
            (true, _) => Err(self.damaged("there is more behind its end")),
            (false, _) => Err(self.damaged("its content is not what was written")),
        }
    }

    /// Reads all of it, to make sure that it is as it was written; the answer is what it says of itself.
    pub(in super::super) fn examine(mut self) -> Result<Head> {
        /// Numbers read at a time.
        const CHUNK: usize = 1 << 15;
        let mut numbers = Vec::new();
        while let Some(place) = self.place()? {
            for first in (0..place.count).step_by(CHUNK) {
                numbers.resize(CHUNK.min(place.count - first), 0.0);
                self.numbers(&mut numbers)?;
            }
        }
        let head = self.head.clone();
        self.finish()?;
        Ok(head)
    }

    /// The error for a file that is not what was written.
    pub(in super::super) fn damaged(&self, why: &str) -> Error {
        damaged(&self.path, why)
    }
}

/// A length and so many bytes of JSON, of a file of `length` bytes.
fn json<T: DeserializeOwned>(path: &Path, input: &mut impl Read, length: u64) -> Result<T> {
    let mut size = [0; 4];
    input.read_exact(&mut size).map_err(|e| refused(path, &e))?;
    let size = u32::from_le_bytes(size);
    if u64::from(size) > length {
        return Err(damaged(path, "it is shorter than it says"));
    }
    let mut json = vec![0; size as usize];
    input.read_exact(&mut json).map_err(|e| refused(path, &e))?;
    serde_json::from_slice(&json)
        .map_err(|_| damaged(path, "what it says of itself makes no sense"))
}

fn refused(path: &Path, cause: &io::Error) -> Error {
    match cause.kind() {
        io::ErrorKind::UnexpectedEof => damaged(path, "it ends too early"),
        _ => Error::system("read", path, cause),
    }
}
