//! Writing a part, record by record.

use std::io::{self, Write};

use serde::Serialize;

use super::super::hashing::Hashing;
use super::{Head, MARK, Tail};

/// Numbers converted at a time.
const CHUNK: usize = 1 << 13;

/// A part that is being written.
#[derive(Debug)]
pub(super) struct Writer<W: Write> {
    out: Hashing<W>,
    bytes: Vec<u8>,
}

impl<W: Write> Writer<W> {
    /// Writes what stands before the records.
    pub(super) fn begin(out: W, head: &Head) -> io::Result<Self> {
        let mut writer = Self {
            out: Hashing::new(out),
            bytes: Vec::new(),
        };
        writer.out.write_all(MARK)?;
        writer.json(head)?;
        Ok(writer)
    }

    fn json(&mut self, value: &impl Serialize) -> io::Result<()> {
        let json = serde_json::to_vec(value)?;
        self.out.write_all(&(json.len() as u32).to_le_bytes())?;
        self.out.write_all(&json)
    }

    /// Writes the numbers of a place, which stand in runs, unless there are none.
    pub(super) fn record<'a>(
        &mut self,
        place: [u32; 4],
        runs: impl Iterator<Item = &'a [f64]> + Clone,
    ) -> io::Result<()> {
        let count: usize = runs.clone().map(<[f64]>::len).sum();
        if count == 0 {
            return Ok(());
        }
        let count = u32::try_from(count)
            .map_err(|_| io::Error::other("the crop is too large for a part"))?;
        self.head(count, place)?;
        for run in runs {
            for chunk in run.chunks(CHUNK) {
                self.bytes
                    .extend(chunk.iter().flat_map(|x| x.to_le_bytes()));
                if self.bytes.len() >= 8 * CHUNK {
                    self.flush()?;
                }
            }
        }
        self.flush()
    }

    fn head(&mut self, count: u32, [a, b, c, d]: [u32; 4]) -> io::Result<()> {
        let numbers = [count, a, b, c, d];
        self.bytes
            .extend(numbers.iter().flat_map(|n| n.to_le_bytes()));
        self.flush()
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.write_all(&self.bytes)?;
        self.bytes.clear();
        Ok(())
    }

    /// Writes what stands behind the records.
    pub(super) fn finish(mut self, tail: &Tail) -> io::Result<()> {
        self.head(0, [0; 4])?;
        self.json(tail)?;
        self.out.seal().map(drop)
    }
}
