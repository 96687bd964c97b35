//! Trees on disk. A file holds the nodes and blocks of a tree as they are in memory, about 60 bytes a triangle, and is
//! named after a hash of what the tree was made from: so that reading it is all that there is to do.
//!
//! Its length and its hash are held against a file first, for files get damaged. The hash is of this version's and
//! belongs to the items; who can forge it can also forge an image. But what is in a file is then shown to be
//! [a tree](super::valid), and nodes are looked at only after they have been copied: whatever a file holds, and whoever
//! writes to it meanwhile, no walk leaves the tree and none is without end.

use std::fs::File;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::huge_pages::Huge;
use super::node::{BLOCK_INDEX, Block, LEAF, Node};
use super::{Leaves, Tree, valid};
use crate::accel::{Build, CacheUse};
use crate::error::Error;
use crate::file::{leave, read_at, seal};

/// What every file begins with. The number changes with what is in the file, and whenever trees are built otherwise.
const MAGIC: &[u8; 16] = b"etendue tree 2\n\0";
/// Bytes before the blocks, which begin where a page does.
const HEAD: usize = 1 << 16;
const HASH: usize = blake3::OUT_LEN;
/// Bytes that have a checksum.
const GRAIN: usize = 1 << 20;

/// A tree, and those of its items that are no triangles.
pub(super) type Whole = (Tree, Vec<u32>);

/// The tree from the folder, or else built and laid down there. What goes wrong with files is told, and does no harm.
pub(super) fn through(
    folder: &Path,
    leaves: &impl Leaves,
    work: Build,
    build: impl FnOnce() -> Whole,
) -> (Whole, CacheUse) {
    let entry = Entry::new(folder, leaves, work);
    let mut used = CacheUse::default();
    match entry.read(leaves) {
        Ok(whole) => {
            used.read = 1;
            return (whole, used);
        }
        Err(Missing::New) => {}
        Err(Missing::Bad(path, what)) => {
            let message = format!("the tree in {} is built anew: {what}", path.display());
            used.warn(Error::input(message));
        }
    }
    let whole = build();
    match entry.write(&whole) {
        Ok(()) => used.written = 1,
        Err((path, error)) => used.warn(Error::system("write", &path, &error)),
    }
    (whole, used)
}

/// A tree's place on disk.
#[derive(Debug)]
pub(super) struct Entry {
    key: blake3::Hash,
    folder: PathBuf,
    work: Build,
}

/// Why there is no tree in a file.
#[derive(Debug)]
pub(super) enum Missing {
    /// Nobody has written one.
    New,
    /// One was written and cannot be used: the path, and what is wrong.
    Bad(PathBuf, String),
}

/// How much there is of everything in a file.
#[derive(Clone, Copy, Debug)]
struct Counts {
    blocks: usize,
    nodes: usize,
    others: usize,
}

impl Counts {
    fn of((tree, others): &Whole) -> Self {
        Self {
            blocks: tree.blocks.len(),
            nodes: tree.nodes.len(),
            others: others.len(),
        }
    }

    /// The head of a file. All numbers are in this machine's order of bytes, and the first of them tells it.
    fn head(self) -> Vec<u8> {
        let mut head = MAGIC.to_vec();
        for count in [1, self.blocks, self.nodes, self.others] {
            head.extend((count as u64).to_ne_bytes());
        }
        head.resize(HEAD, 0);
        head
    }

    /// What a head says, if it is one.
    fn from_head(head: &[u8]) -> Option<Self> {
        let (numbers, _) = head.strip_prefix(MAGIC)?.as_chunks();
        let number = |i: usize| numbers.get(i).map(|bytes| u64::from_ne_bytes(*bytes));
        let below = |i: usize, most: u32| number(i).filter(|n| *n < u64::from(most));
        Some(Self {
            blocks: below(1, BLOCK_INDEX)? as usize,
            nodes: below(2, LEAF)? as usize,
            others: below(3, LEAF)? as usize,
        })
        .filter(|_| number(0) == Some(1))
    }

    /// Where nodes, the others and the hash begin.
    fn places(self) -> [u64; 3] {
        let blocks = (self.blocks * size_of::<Block>()) as u64;
        let nodes = (self.nodes * size_of::<Node>()) as u64;
        let first = HEAD as u64 + blocks;
        [first, first + nodes, first + nodes + 4 * self.others as u64]
    }
}

impl Entry {
    /// The place of the tree over some items.
    pub(super) fn new(folder: &Path, leaves: &impl Leaves, work: Build) -> Self {
        let mut hasher = blake3::Hasher::new();
        hasher.update(MAGIC);
        leaves.digest(&mut hasher);
        Self {
            key: hasher.finalize(),
            folder: folder.to_owned(),
            work,
        }
    }

    fn path(&self, work: Build) -> PathBuf {
        let name = match work {
            Build::Quick => "quick",
            Build::Fast => "fast",
            Build::Medium => "medium",
            Build::Slow => "slow",
        };
        self.folder
            .join(format!("{}.{name}.tree", self.key.to_hex()))
    }

    /// The tree with this work in it, or more.
    pub(super) fn read(&self, leaves: &impl Leaves) -> Result<Whole, Missing> {
        let works = [Build::Slow, Build::Medium, Build::Fast, Build::Quick];
        let mut missing = Missing::New;
        for work in works.into_iter().take_while(|work| *work >= self.work) {
            let path = self.path(work);
            let bad = match File::open(&path) {
                Err(error) if error.kind() == ErrorKind::NotFound => continue,
                Err(error) => error.to_string(),
                Ok(file) => match self.whole(&file, leaves) {
                    Ok(whole) => return Ok(whole),
                    Err(error) if error.kind() == ErrorKind::UnexpectedEof => {
                        "it is cut off".to_owned()
                    }
                    Err(error) => error.to_string(),
                },
            };
            missing = Missing::Bad(path, bad);
        }
        Err(missing)
    }

    fn whole(&self, file: &File, leaves: &impl Leaves) -> io::Result<Whole> {
        let mut head = vec![0; HEAD];
        read_at(file, 0, &mut head)?;
        let version = || io::Error::other("it is no tree of this version");
        let counts = Counts::from_head(&head).ok_or_else(version)?;
        let [nodes_at, others_at, hash_at] = counts.places();
        if file.metadata()?.len() != hash_at + HASH as u64 {
            return Err(io::Error::other("its length is wrong"));
        }
        let nodes: Huge<Node> = Huge::read(file, nodes_at, counts.nodes)?;
        // Few rays come to few blocks; many want them in huge pages.
        let blocks: Huge<Block> = match self.work {
            Build::Quick => Huge::mapped(file, HEAD as u64, counts.blocks)?,
            _ => Huge::read(file, HEAD as u64, counts.blocks)?,
        };
        let mut others = vec![0; 4 * counts.others];
        read_at(file, others_at, &mut others)?;
        let mut hash = [0; HASH];
        read_at(file, hash_at, &mut hash)?;
        let content = [&head[..], blocks.bytes(), nodes.bytes(), &others];
        if blake3::Hash::from_bytes(hash) != self.hash(&content) {
            return Err(io::Error::other("its contents are damaged"));
        }
        let (others, _) = others.as_chunks();
        let others: Vec<u32> = others.iter().map(|o| u32::from_ne_bytes(*o)).collect();
        let levels = valid::levels(&nodes, blocks.len(), others.len())
            .filter(|_| valid::are_of(&blocks, &others, leaves))
            .ok_or_else(|| io::Error::other("its contents are no tree of these items"))?;
        let tree = Tree {
            nodes,
            blocks,
            levels,
            later: None,
        };
        Ok((tree, others))
    }

    /// The hash of a file's contents, which belong to this key: of checksums, which are several times as fast and miss
    /// no damage that is not meant.
    fn hash(&self, content: &[&[u8]]) -> blake3::Hash {
        let sums = content
            .par_iter()
            .flat_map(|bytes| bytes.par_chunks(GRAIN).map(crc32fast::hash));
        seal(&self.key, &sums.collect::<Vec<u32>>())
    }

    /// Writes the tree, under another name first: whoever reads finds all of it or nothing.
    pub(super) fn write(&self, whole: &Whole) -> Result<(), (PathBuf, io::Error)> {
        let path = self.path(self.work);
        let head = Counts::of(whole).head();
        let (tree, others) = whole;
        let others: Vec<u8> = others.iter().flat_map(|o| o.to_ne_bytes()).collect();
        let content = [&head[..], tree.blocks.bytes(), tree.nodes.bytes(), &others];
        let written = leave(&path, |file| {
            content.iter().try_for_each(|bytes| file.write_all(bytes))?;
            file.write_all(self.hash(&content).as_bytes())
        });
        written.map_err(|error| (path, error))
    }
}
