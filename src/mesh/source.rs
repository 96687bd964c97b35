//! A file read front to back through a buffer, as lines, words or bytes, so that a mesh is decoded straight
//! into its arrays and the file is never in memory as a whole. It knows how many bytes are left,
//! which is what lengths in the file are held against, and the line it is on.

use std::io::{ErrorKind, Read};
use std::path::Path;

use super::read::Input;
use crate::budget::Account;
use crate::error::{Error, Location, Result};
use crate::file::text;

/// Bytes asked for at a time: they stay in the second-level cache.
const BUFFER: usize = 1 << 17;

/// No line of a header and no number is longer.
const LONGEST_LINE: usize = 1 << 16;
const LONGEST_WORD: usize = 1 << 10;

pub(super) struct Source<'a> {
    path: &'a Path,
    reader: &'a mut (dyn Read + Send),
    /// Who is asked for memory.
    pub(super) account: &'a Account,
    /// Bytes that `reader` has yet to give.
    ahead: u64,
    buffer: Vec<u8>,
    /// Bytes of `buffer` that are used up.
    used: usize,
    /// Bytes of `buffer` that were read, from its beginning.
    filled: usize,
    /// Line of the last word or line, from 1; 0 in binary data.
    line: u32,
    /// Whether lines end in a CR alone, as the first one does: an LF after it is no more part of the end.
    returns: bool,
}

impl<'a> Source<'a> {
    pub(super) fn new(input: Input<'a>) -> Self {
        Self {
            path: input.path,
            reader: input.reader,
            account: input.account,
            ahead: input.length,
            buffer: Vec::new(),
            used: 0,
            filled: 0,
            line: 1,
            returns: false,
        }
    }

    /// Bytes from here to the end of the file.
    pub(super) fn remaining(&self) -> u64 {
        self.ahead + (self.filled - self.used) as u64
    }

    /// The bytes that follow, at least `wanted` of them unless the file ends.
    pub(super) fn peek(&mut self, wanted: usize) -> Result<&[u8]> {
        if self.filled - self.used < wanted && self.ahead > 0 {
            self.fill(wanted.max(BUFFER))?;
        }
        Ok(&self.buffer[self.used..self.filled])
    }

    /// Reads on until `wanted` bytes are there, or the file ends.
    fn fill(&mut self, wanted: usize) -> Result<()> {
        // A signal ends reading here.
        self.account.take(0)?;
        self.buffer.copy_within(self.used..self.filled, 0);
        self.filled -= self.used;
        self.used = 0;
        let more = (wanted.saturating_sub(self.filled) as u64).min(self.ahead);
        // No more than `wanted`, which is in memory's reach.
        let end = self.filled + more as usize;
        if self.buffer.len() < end {
            self.buffer.resize(end, 0);
        }
        while self.filled < end {
            match self.reader.read(&mut self.buffer[self.filled..end]) {
                // A file that has shrunk meanwhile ends where it ends now.
                Ok(0) => {
                    self.ahead = 0;
                    break;
                }
                Ok(count) => {
                    self.filled += count;
                    self.ahead -= count as u64;
                }
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Err(Error::system("read", self.path, &e)),
            }
        }
        Ok(())
    }

    /// Goes past `count` bytes that [`Source::peek`] has shown.
    pub(super) fn consume(&mut self, count: usize) {
        self.used += count;
        debug_assert!(self.used <= self.filled);
    }

    /// Goes past `count` bytes.
    pub(super) fn skip(&mut self, mut count: u64) -> Result<()> {
        while count > 0 {
            let shown = self.peek(1)?.len();
            if shown == 0 {
                return Err(self.error("the file ends too early"));
            }
            let step = usize::try_from(count).unwrap_or(usize::MAX).min(shown);
            self.consume(step);
            count -= step as u64;
        }
        Ok(())
    }

    /// Goes past a byte-order mark.
    pub(super) fn skip_mark(&mut self) -> Result<()> {
        let mark = text::BYTE_ORDER_MARK;
        if self.peek(mark.len())?.starts_with(mark) {
            self.consume(mark.len());
        }
        Ok(())
    }

    /// The next line, without its end: LF, CRLF or CR.
    pub(super) fn line(&mut self) -> Result<String> {
        let (is_first, mut returns) = (self.line == 1, self.returns);
        let shown = self.peek(LONGEST_LINE + 1)?;
        let mut bytes = shown.iter().take(LONGEST_LINE);
        let Some(end) = bytes.position(|b| matches!(b, b'\n' | b'\r')) else {
            return Err(self.error("the file ends, or a line does not, before the header ends"));
        };
        let line = String::from_utf8_lossy(&shown[..end]).into_owned();
        let both = shown[end..].starts_with(b"\r\n");
        if is_first {
            returns = shown[end] == b'\r' && !both;
        }
        // Binary data after a header of such lines may begin with the byte of an LF.
        self.consume(if both && !returns { end + 2 } else { end + 1 });
        self.returns = returns;
        self.line = self.line.saturating_add(1);
        Ok(line)
    }

    /// The number that the next word says.
    pub(super) fn number(&mut self) -> Result<f64> {
        loop {
            let end = if self.returns { b'\r' } else { b'\n' };
            let shown = self.peek(1)?;
            let blank = shown.iter().take_while(|b| b.is_ascii_whitespace());
            let (blanks, lines) = blank.fold((0, 0), |(n, l), &b| (n + 1, l + u32::from(b == end)));
            let more = blanks == shown.len() && blanks > 0;
            self.consume(blanks);
            self.line = self.line.saturating_add(lines);
            if !more {
                break;
            }
        }
        let shown = self.peek(LONGEST_WORD)?;
        let word = shown
            .iter()
            .take(LONGEST_WORD)
            .take_while(|b| !b.is_ascii_whitespace());
        let length = word.count();
        let word = std::str::from_utf8(&shown[..length]).ok();
        match word.and_then(|w| w.parse().ok()) {
            Some(number) => {
                self.consume(length);
                Ok(number)
            }
            None if length == 0 => Err(self.error("the file ends where a number is wanted")),
            None => {
                let found = String::from_utf8_lossy(&shown[..length.min(32)]).into_owned();
                Err(self.error(format!("a number is wanted, not {found:?}")))
            }
        }
    }

    /// From here on there are no lines.
    pub(super) fn binary(&mut self) {
        self.line = 0;
    }

    /// An error at the current line, or in the file.
    pub(super) fn error(&self, message: impl Into<String>) -> Error {
        Error::input(message).at(&Location::of_line(self.path, self.line))
    }

    /// An error at the line that was read last.
    pub(super) fn error_at_last_line(&self, message: impl Into<String>) -> Error {
        Error::input(message).at(&Location::of_line(self.path, self.line.saturating_sub(1)))
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::budget::Budget;

    #[test]
    fn words_and_bytes_are_the_same_however_the_buffer_cuts_them() {
        let count = 50_000;
        let text: String = (0..count).map(|i| format!("{i}.5 \r\n")).collect();
        let mut reader = text.as_bytes();
        let path = Path::new("numbers");
        let length = text.len() as u64;
        let account = Budget::default().open();
        let mut source = Source::new(Input {
            path,
            length,
            origin: DVec3::ZERO,
            account: &account,
            reader: &mut reader,
        });
        for i in 0..count {
            assert_eq!(source.number().unwrap(), f64::from(i) + 0.5);
        }
        let end = source.number().unwrap_err().to_string();
        assert!(end.starts_with("numbers:50001: the file ends"), "{end}");
        assert_eq!(source.remaining(), 0);
    }

    #[test]
    fn a_word_that_is_no_number_is_shown_with_its_line() {
        let mut reader = &b"1 2\n3 four"[..];
        let account = Budget::default().open();
        let input = Input {
            path: Path::new("numbers"),
            length: 10,
            origin: DVec3::ZERO,
            account: &account,
            reader: &mut reader,
        };
        let mut source = Source::new(input);
        for _ in 0..3 {
            source.number().unwrap();
        }
        let error = source.number().unwrap_err().to_string();
        assert_eq!(error, "numbers:2: a number is wanted, not \"four\"");
    }
}
