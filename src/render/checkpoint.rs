//! Checkpoints: the film's sums after a number of units, kept beside the image, so that a render that was
//! killed goes on where it was and ends with the same bits.
//!
//! A file is the mark, the header's length (u32), the header (JSON), the sums (f64) and the BLAKE3 hash of
//! all that, little-endian. It is written beside its place and renamed, so that it is whole whenever the
//! process dies. The sums' length is known before a file is opened: no number in it is believed.

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::fingerprint::Fingerprint;
use super::hashing::Hashing;
use super::options::Checkpoint;
use crate::error::{Error, Problem, Result};
use crate::file;
use crate::film::{Accumulator, Summed, Tally};

impl Checkpoint {
    /// Removes the file, if there is one: the image is written, and there is nothing left to continue.
    pub fn remove(&self) {
        fs::remove_file(&self.path).ok();
        fs::remove_file(beside(&self.path)).ok();
    }
}

const MARK: &[u8; 16] = b"etendue sums 5\r\n";
/// Sums converted at a time.
const CHUNK: usize = 1 << 13;

#[derive(Debug, Serialize, Deserialize)]
struct Header {
    fingerprint: Fingerprint,
    /// The first unit that is not in the sums.
    next: usize,
    tally: Tally,
    /// Seconds spent on rendering so far.
    seconds: f64,
}

/// Writes checkpoints of one render.
#[derive(Debug)]
pub(super) struct Keeper {
    checkpoint: Checkpoint,
    fingerprint: Fingerprint,
    /// Seconds that went before this run.
    earlier: f64,
    began: Instant,
    written: Instant,
    /// Why the last writing failed.
    failure: Option<io::Error>,
}

impl Keeper {
    pub(super) fn new(checkpoint: Checkpoint, fingerprint: Fingerprint) -> Self {
        let now = Instant::now();
        Self {
            checkpoint,
            fingerprint,
            earlier: 0.0,
            began: now,
            written: now,
            failure: None,
        }
    }

    /// Fills `summed`, which is new, with what the file kept, if there is one and it is to be continued.
    pub(super) fn resume<A: Accumulator>(
        &mut self,
        summed: &mut Summed<A>,
        units: usize,
    ) -> Result<()> {
        let path = &self.checkpoint.path;
        if self.checkpoint.resume && path.exists() {
            let (data, tally) = summed.sums.kept();
            let header = load(path, &self.fingerprint, data)?;
            if header.next > units {
                return Err(damaged(path, "it knows of more tiles than there are"));
            }
            *tally = header.tally;
            summed.next = header.next;
            self.earlier = header.seconds;
        }
        self.began = Instant::now();
        self.written = self.began;
        Ok(())
    }

    /// Seconds of rendering, those of earlier runs included.
    pub(super) fn seconds(&self) -> f64 {
        self.earlier + self.began.elapsed().as_secs_f64()
    }

    /// Writes the file when it is time.
    pub(super) fn keep_when_due<A: Accumulator>(&mut self, summed: &Summed<A>) {
        if let Some(every) = self.checkpoint.every
            && self.written.elapsed() >= every
        {
            self.keep(summed);
        }
    }

    /// After the last unit of a render that was stopped. That of a whole one stays as it is until its image
    /// is written: see [`Checkpoint::remove`].
    pub(super) fn finish<A: Accumulator>(&mut self, summed: &Summed<A>, whole: bool) {
        if !whole {
            self.keep(summed);
        }
    }

    fn keep<A: Accumulator>(&mut self, summed: &Summed<A>) {
        let header = Header {
            fingerprint: self.fingerprint.clone(),
            next: summed.next,
            tally: *summed.sums.tally(),
            seconds: self.seconds(),
        };
        self.failure = save(&self.checkpoint.path, &header, summed.sums.data()).err();
        self.written = Instant::now();
    }

    /// The warning for a checkpoint that could not be written: no reason to give up the render.
    pub(super) fn warning(&self) -> Option<Problem> {
        let cause = self.failure.as_ref()?;
        let error = Error::system("write the checkpoint", &self.checkpoint.path, cause);
        error.problems().first().cloned()
    }
}

/// The file under which a checkpoint is written before it takes its name; the same each time, so that a
/// killed render leaves at most one.
fn beside(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".new");
    name.into()
}

fn save(path: &Path, header: &Header, data: &[f64]) -> io::Result<()> {
    let new = beside(path);
    let saved = save_as(&new, header, data).and_then(|()| fs::rename(&new, path));
    if saved.is_err() {
        // It would take the room that the image needs.
        let _ = fs::remove_file(&new);
        return saved;
    }
    // Some file systems cannot sync a folder; the checkpoint is whole either way.
    let folder = path.parent().filter(|f| !f.as_os_str().is_empty());
    if let Ok(folder) = File::open(folder.unwrap_or(Path::new("."))) {
        folder.sync_all().ok();
    }
    Ok(())
}

fn save_as(new: &Path, header: &Header, data: &[f64]) -> io::Result<()> {
    fs::create_dir_all(new.parent().unwrap_or(Path::new("")))?;
    let mut out = Hashing::new(File::create(new)?);
    let json = serde_json::to_vec(header)?;
    out.write_all(MARK)?;
    out.write_all(&(json.len() as u32).to_le_bytes())?;
    out.write_all(&json)?;
    let mut bytes = Vec::with_capacity(8 * CHUNK);
    for chunk in data.chunks(CHUNK) {
        bytes.clear();
        bytes.extend(chunk.iter().flat_map(|x| x.to_le_bytes()));
        out.write_all(&bytes)?;
    }
    out.seal()?.sync_all()
}

/// Reads the file into `data`, which has the length that the film asks for.
fn load(path: &Path, expected: &Fingerprint, data: &mut [f64]) -> Result<Header> {
    let failed = |e: io::Error| match e.kind() {
        io::ErrorKind::UnexpectedEof => damaged(path, "it ends too early"),
        _ => Error::system("read", path, &e),
    };
    let file = file::open(path).map_err(failed)?;
    let about = file.metadata().map_err(failed)?;
    let mut input = Hashing::new(io::BufReader::new(file));
    let mut mark = [0; MARK.len()];
    input.read_exact(&mut mark).map_err(failed)?;
    if &mark != MARK {
        return Err(damaged(path, "it does not begin like one"));
    }
    let mut length = [0; 4];
    input.read_exact(&mut length).map_err(failed)?;
    let length = u32::from_le_bytes(length);
    if u64::from(length) > about.len() {
        return Err(damaged(path, "its header is too long"));
    }
    let mut json = vec![0; length as usize];
    input.read_exact(&mut json).map_err(failed)?;
    let header: Header =
        serde_json::from_slice(&json).map_err(|_| damaged(path, "its header makes no sense"))?;
    if let Some(what) = expected.difference(&header.fingerprint) {
        return Err(Error::input(format!(
            "the checkpoint {} cannot be continued: {what} has changed since",
            path.display()
        ))
        .help("go back to what it was, or render without --resume to start anew"));
    }
    let before_sums = (MARK.len() + 4) as u64 + u64::from(length);
    if about.len() != before_sums + 8 * data.len() as u64 + blake3::OUT_LEN as u64 {
        return Err(damaged(path, "its length is not that of the film's sums"));
    }
    let mut bytes = vec![0; 8 * CHUNK.min(data.len())];
    for chunk in data.chunks_mut(CHUNK) {
        let bytes = &mut bytes[..8 * chunk.len()];
        input.read_exact(bytes).map_err(failed)?;
        for (x, bytes) in chunk.iter_mut().zip(bytes.as_chunks().0) {
            *x = f64::from_le_bytes(*bytes);
        }
    }
    if !input.is_sealed().map_err(failed)? {
        return Err(damaged(path, "its content is not what was written"));
    }
    Ok(header)
}

fn damaged(path: &Path, why: &str) -> Error {
    Error::input(format!(
        "{} is no checkpoint or a damaged one: {why}",
        path.display()
    ))
    .help("render without --resume to start anew")
}
