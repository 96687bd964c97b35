//! A reader or writer that hashes what goes through, so that a file can end with the hash of what stands before it.

use std::io::{self, Read, Write};

use blake3::Hasher;

/// Hashes what goes through.
#[derive(Debug)]
pub(super) struct Hashing<T> {
    inner: T,
    hasher: Hasher,
}

impl<T> Hashing<T> {
    pub(super) fn new(inner: T) -> Self {
        Self {
            inner,
            hasher: Hasher::new(),
        }
    }
}

impl<T: Write> Hashing<T> {
    /// Writes the hash and gives back what it was written to.
    pub(super) fn seal(mut self) -> io::Result<T> {
        self.inner.write_all(self.hasher.finalize().as_bytes())?;
        Ok(self.inner)
    }
}

impl<T: Read> Hashing<T> {
    /// Reads a hash; the answer is whether it is that of what was read before.
    pub(super) fn is_sealed(&mut self) -> io::Result<bool> {
        let mut hash = [0; blake3::OUT_LEN];
        self.inner.read_exact(&mut hash)?;
        Ok(self.hasher.finalize() == hash)
    }
}

impl<T: Read> Read for Hashing<T> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.inner.read(buffer)?;
        self.hasher.update(&buffer[..count]);
        Ok(count)
    }
}

impl<T: Write> Write for Hashing<T> {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let count = self.inner.write(buffer)?;
        self.hasher.update(&buffer[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}
