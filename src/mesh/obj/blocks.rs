//! An OBJ file block by block, so that it is never in memory as a whole: a block is cut at a line's end, its
//! pieces are counted and then understood in parallel.

use std::io::Read;
use std::path::Path;

use rayon::prelude::*;

use super::piece::{Counts, Piece, counts};
use crate::error::{Error, Location, Result};
use crate::file::text;
use crate::mesh::read::Input;

/// How a file is cut.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cuts {
    /// Bytes that are read at a time.
    pub(super) block: usize,
    /// Bytes that one thread understands at a time, at least.
    pub(super) piece: usize,
}

/// A few megabytes for each thread to do.
pub(super) const CUTS: Cuts = Cuts {
    block: 1 << 23,
    piece: 1 << 17,
};

/// Stands for the line end after a backslash: a blank that no file has otherwise.
const JOINED: u8 = b'\x0c';

pub(super) struct Blocks<'a> {
    input: Input<'a>,
    cuts: Cuts,
    /// What was read and has no line end yet; `None` before anything was.
    rest: Option<Vec<u8>>,
    /// What stands before the next block.
    before: Counts,
    /// Lines before the next block.
    lines: usize,
    /// Bytes that are taken for lines longer than a block.
    covered: u64,
}

/// A block's pieces, in order.
pub(super) struct Block {
    pub(super) pieces: Vec<Piece>,
    /// What is wrong in the last of them, if anything is.
    pub(super) wrong: Option<Error>,
}

impl<'a> Blocks<'a> {
    pub(super) fn new(input: Input<'a>, cuts: Cuts) -> Self {
        Self {
            input,
            cuts,
            rest: None,
            before: Counts::default(),
            lines: 0,
            covered: 0,
        }
    }

    /// The file.
    pub(super) fn path(&self) -> &'a Path {
        self.input.path
    }

    /// The next block; `None` at the end of the file.
    pub(super) fn next(&mut self) -> Result<Option<Block>> {
        // A signal ends reading here.
        self.input.account.take(0)?;
        let Some(mut bytes) = self.bytes()? else {
            return Ok(None);
        };
        join_continued_lines(&mut bytes);
        let lines = self.cut(&bytes);
        let counted: Vec<Counts> = lines.par_iter().map(|lines| counts(lines)).collect();
        let befores = counted.iter().map(|counts| {
            let before = self.before;
            self.before = [0, 1, 2].map(|i| before[i] + counts[i]);
            before
        });
        let befores: Vec<Counts> = befores.collect();
        let origin = self.input.origin;
        let pieces = lines.par_iter().zip(befores);
        let mut pieces: Vec<Piece> = pieces
            .map(|(lines, before)| Piece::read(lines, before, origin))
            .collect();
        let ends = |bytes: &[u8]| bytes.iter().filter(|&&b| b == b'\n' || b == JOINED).count();
        let mut wrong = None;
        if let Some(at) = pieces.iter().position(|piece| piece.wrong.is_some()) {
            pieces.truncate(at + 1);
            wrong = pieces[at].wrong.take().map(|(start, message)| {
                let before: usize = lines[..at].iter().map(|lines| ends(lines)).sum();
                let line = self.lines + before + ends(&lines[at][..start]) + 1;
                let place = Location::of_line(self.path(), u32::try_from(line).unwrap_or(0));
                Error::input(message).at(&place)
            });
        }
        self.lines += lines.par_iter().map(|lines| ends(lines)).sum::<usize>();
        Ok(Some(Block { pieces, wrong }))
    }

    /// Whole lines, about a block of them.
    fn bytes(&mut self) -> Result<Option<Vec<u8>>> {
        let mut bytes = match self.rest.take() {
            Some(rest) => rest,
            None => self.beginning()?,
        };
        bytes.reserve_exact(self.cuts.block.min(self.input.length as usize));
        let mut searched: usize = 0;
        loop {
            self.append(self.cuts.block, &mut bytes)?;
            // With the byte before, which may be a CR.
            let new = &mut bytes[searched.saturating_sub(1)..];
            text::end_lines_in_feeds(new, self.input.length == 0);
            if self.input.length == 0 {
                self.rest = Some(Vec::new());
                return Ok((!bytes.is_empty()).then_some(bytes));
            }
            if let Some(end) = last_line_end(&bytes, searched) {
                self.rest = Some(bytes.split_off(end));
                return Ok(Some(bytes));
            }
            searched = bytes.len();
            // A line that is longer than a block, with what is made of it.
            let wanted = 8 * (bytes.len() + self.cuts.block) as u64;
            self.input.account.cover(&mut self.covered, wanted)?;
        }
    }

    /// What stands before the first block, but for a byte-order mark.
    fn beginning(&mut self) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        self.append(text::BYTE_ORDER_MARK.len(), &mut bytes)?;
        Ok(text::without_mark(&bytes).to_vec())
    }

    /// Appends `most` bytes of the file, or those that there are.
    fn append(&mut self, most: usize, bytes: &mut Vec<u8>) -> Result<()> {
        let more = (most as u64).min(self.input.length);
        let read = self.input.reader.take(more).read_to_end(bytes);
        let read = read.map_err(|e| Error::system("read", self.input.path, &e))? as u64;
        // A file that has shrunk meanwhile ends where it ends now.
        self.input.length = if read < more {
            0
        } else {
            self.input.length - read
        };
        Ok(())
    }

    /// `bytes` in pieces that end where lines end.
    fn cut<'b>(&self, mut bytes: &'b [u8]) -> Vec<&'b [u8]> {
        let mut pieces = Vec::new();
        while let Some(far) = bytes.get(self.cuts.piece..)
            && let Some(end) = far.iter().position(|&b| b == b'\n')
        {
            let (piece, rest) = bytes.split_at(self.cuts.piece + end + 1);
            pieces.push(piece);
            bytes = rest;
        }
        pieces.push(bytes);
        pieces
    }
}

/// Behind the last line end that is not continued, looked for from `searched` on.
fn last_line_end(bytes: &[u8], searched: usize) -> Option<usize> {
    let ends = (searched..bytes.len()).rev();
    let mut ends = ends.filter(|&end| bytes[end] == b'\n' && backslash(bytes, end).is_none());
    ends.next().map(|end| end + 1)
}

/// The backslash that continues the line which ends at `end`.
fn backslash(bytes: &[u8], end: usize) -> Option<usize> {
    let last = match bytes[..end] {
        [.., _, b'\r'] => end - 2,
        _ => end.checked_sub(1)?,
    };
    (bytes[last] == b'\\').then_some(last)
}

/// A backslash at the end of a line continues it.
fn join_continued_lines(bytes: &mut [u8]) {
    for end in 1..bytes.len() {
        if bytes[end] == b'\n'
            && let Some(last) = backslash(bytes, end)
        {
            bytes[last] = b' ';
            bytes[end] = JOINED;
        }
    }
}
