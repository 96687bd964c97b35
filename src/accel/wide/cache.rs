//! Trees on disk. A file holds the [sketches](super::sketch) of a tree, about 6 bytes an item, and is named
//! after a hash of what the tree was made from: the items' boxes and what went into it. Nodes and blocks are made
//! anew from the items, so that a tree from a file is the tree that was written, to the bit.
//!
//! Nothing in a file is believed. Its length and its hash are held against it first, for files get damaged;
//! and then whether it is a tree over these items, each of them in one leaf, for anybody may have written it.
//! So a false file can make rays slower, and never change a hit.

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::Leaves;
use super::assembly::Sketches;
use super::binary::DEEPEST;
use super::build::build;
use super::node::WIDTH;
use super::sketch::{INNER, Sketch, Stroke};
use crate::accel::{Build, CacheUse};
use crate::error::Error;
use crate::shape::Bounds;

/// What every file begins with. The number changes with what is in the file, and whenever trees are built otherwise.
const MAGIC: &[u8; 16] = b"etendue tree 1\n\0";
const HASH: usize = blake3::OUT_LEN;
/// Items that are hashed at once.
const GRAIN: usize = 1 << 15;

/// The tree from the folder, or else built and laid down there. What goes wrong with files is told, and does no harm.
pub(super) fn through(
    folder: &Path,
    boxes: &[Bounds],
    leaves: &impl Leaves,
    work: Build,
) -> (Sketches, CacheUse) {
    let entry = Entry::new(folder, boxes, leaves, work);
    let mut used = CacheUse::default();
    match entry.read(leaves) {
        Ok(sketches) => {
            used.read = 1;
            return (sketches, used);
        }
        Err(Missing::New) => {}
        Err(Missing::Bad(path, what)) => {
            let message = format!("the tree in {} is built anew: {what}", path.display());
            used.warn(Error::input(message));
        }
    }
    let sketches = build(boxes, leaves, work);
    match entry.write(&sketches) {
        Ok(()) => used.written = 1,
        Err((path, error)) => used.warn(Error::system("write", &path, &error)),
    }
    (sketches, used)
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

impl Entry {
    /// The place of the tree over items in these boxes.
    pub(super) fn new(folder: &Path, boxes: &[Bounds], leaves: &impl Leaves, work: Build) -> Self {
        let blocks = boxes.par_chunks(GRAIN).enumerate().map(|(block, boxes)| {
            let mut bytes = Vec::with_capacity(25 * boxes.len());
            for (item, Bounds { min, max }) in (block * GRAIN..).zip(boxes) {
                for c in min.to_array().into_iter().chain(max.to_array()) {
                    bytes.extend(c.to_le_bytes());
                }
                bytes.push(leaves.is_triangle(item as u32).into());
            }
            blake3::hash(&bytes)
        });
        let mut hasher = blake3::Hasher::new();
        hasher.update(MAGIC);
        let blocks: Vec<blake3::Hash> = blocks.collect();
        blocks.iter().for_each(|hash| {
            hasher.update(hash.as_bytes());
        });
        Self {
            key: hasher.finalize(),
            folder: folder.to_owned(),
            work,
        }
    }

    fn path(&self, work: Build) -> PathBuf {
        let name = match work {
            Build::Fast => "fast",
            Build::Medium => "medium",
            Build::Slow => "slow",
        };
        self.folder
            .join(format!("{}.{name}.tree", self.key.to_hex()))
    }

    /// The tree with this work in it, or more.
    pub(super) fn read(&self, leaves: &impl Leaves) -> Result<Sketches, Missing> {
        let works = [Build::Slow, Build::Medium, Build::Fast];
        let mut missing = Missing::New;
        for work in works.into_iter().take_while(|work| *work >= self.work) {
            let path = self.path(work);
            let bad = match read(&path) {
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                Err(error) => error.to_string(),
                Ok(bytes) => match self.sketches(&bytes, leaves) {
                    Ok(sketches) => return Ok(sketches),
                    Err(what) => what.to_owned(),
                },
            };
            missing = Missing::Bad(path, bad);
        }
        Err(missing)
    }

    fn sketches(&self, bytes: &[u8], leaves: &impl Leaves) -> Result<Sketches, &'static str> {
        let (content, hash) = bytes.split_last_chunk::<HASH>().ok_or("it is cut off")?;
        let content = content
            .strip_prefix(MAGIC)
            .ok_or("it is no tree of this version")?;
        if blake3::Hash::from_bytes(*hash) != self.hash(content) {
            return Err("its contents are damaged");
        }
        let sketches = Reader(content)
            .sketches()
            .ok_or("its contents are not a tree")?;
        let is_sound = is_sound(&sketches, leaves);
        is_sound
            .then_some(sketches)
            .ok_or("it is a tree of other items")
    }

    /// The hash of a file's contents, which belong to this key.
    fn hash(&self, content: &[u8]) -> blake3::Hash {
        let parts: Vec<blake3::Hash> = content.par_chunks(1 << 20).map(blake3::hash).collect();
        let mut hasher = blake3::Hasher::new_keyed(self.key.as_bytes());
        parts.iter().for_each(|part| {
            hasher.update(part.as_bytes());
        });
        hasher.finalize()
    }

    /// Writes the tree, under another name first: whoever reads finds all of it or nothing.
    pub(super) fn write(&self, sketches: &Sketches) -> Result<(), (PathBuf, io::Error)> {
        let path = self.path(self.work);
        let content = content(sketches);
        let write = || -> io::Result<()> {
            fs::create_dir_all(&self.folder)?;
            let mut file = tempfile::NamedTempFile::new_in(&self.folder)?;
            file.write_all(MAGIC)?;
            file.write_all(&content)?;
            file.write_all(self.hash(&content).as_bytes())?;
            file.persist(&path)?;
            Ok(())
        };
        write().map_err(|error| (path, error))
    }
}

/// What is in a file; room for it is taken as it comes.
fn read(path: &Path) -> io::Result<Vec<u8>> {
    let file = File::open(path)?;
    let length = file.metadata()?.len();
    let mut bytes = Vec::new();
    bytes
        .try_reserve_exact(usize::try_from(length).unwrap_or(usize::MAX))
        .map_err(|_| io::Error::from(io::ErrorKind::OutOfMemory))?;
    file.take(length).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Numbers of 32 bits, the low bytes first: how many parts, each part, and the top, if there are several.
fn content(sketches: &Sketches) -> Vec<u8> {
    let all = sketches.parts.iter().chain(&sketches.top);
    let pieces: Vec<&Sketch> = all.collect();
    let pieces = pieces.into_par_iter().map(|sketch| {
        let mut bytes = Vec::with_capacity(16 * sketch.nodes.len() + 4 * sketch.items.len() + 12);
        let counts = [
            sketch.heads,
            sketch.nodes.len() as u32,
            sketch.items.len() as u32,
        ];
        bytes.extend(counts.into_iter().flat_map(u32::to_le_bytes));
        for stroke in &sketch.nodes {
            bytes.extend(stroke.children);
            bytes.extend(stroke.first_node.to_le_bytes());
            bytes.extend(stroke.first_item.to_le_bytes());
        }
        bytes.extend(sketch.items.iter().flat_map(|item| item.to_le_bytes()));
        bytes
    });
    let pieces: Vec<Vec<u8>> = pieces.collect();
    let mut bytes = (sketches.parts.len() as u32).to_le_bytes().to_vec();
    bytes.reserve_exact(pieces.iter().map(Vec::len).sum());
    pieces.iter().for_each(|piece| bytes.extend(piece));
    bytes
}

/// What is left to be read.
struct Reader<'b>(&'b [u8]);

impl<'b> Reader<'b> {
    fn take(&mut self, bytes: usize) -> Option<&'b [u8]> {
        let (taken, rest) = self.0.split_at_checked(bytes)?;
        self.0 = rest;
        Some(taken)
    }

    fn number(&mut self) -> Option<u32> {
        let (number, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(u32::from_le_bytes(*number))
    }

    /// The sketches, if they are all that there is.
    fn sketches(mut self) -> Option<Sketches> {
        let parts = self.number()? as usize;
        let count = parts + usize::from(parts > 1);
        // Each takes some bytes.
        let mut pieces = Vec::with_capacity(count.min(self.0.len()));
        for _ in 0..count {
            let [heads, nodes, items] = [self.number()?, self.number()?, self.number()?];
            let nodes = self.take((nodes as usize).checked_mul(16)?)?;
            let items = self.take((items as usize).checked_mul(4)?)?;
            pieces.push((heads, nodes, items));
        }
        let sketch = |(heads, nodes, items): (u32, &[u8], &[u8])| {
            let stroke = |bytes: &[u8; 16]| {
                let [first_node, first_item] = [WIDTH, WIDTH + 4].map(|at| number(&bytes[at..]));
                let mut children = [0; WIDTH];
                children.copy_from_slice(&bytes[..WIDTH]);
                Stroke {
                    children,
                    first_node,
                    first_item,
                }
            };
            let (nodes, _) = nodes.as_chunks();
            Sketch {
                heads,
                nodes: nodes.iter().map(stroke).collect(),
                items: items.chunks_exact(4).map(number).collect(),
            }
        };
        let mut parts: Vec<Sketch> = pieces.into_par_iter().map(sketch).collect();
        let top = (count > 1).then(|| parts.pop()).flatten();
        self.0.is_empty().then_some(Sketches { parts, top })
    }
}

/// The number in the first four bytes.
fn number(bytes: &[u8]) -> u32 {
    bytes.first_chunk().copied().map_or(0, u32::from_le_bytes)
}

/// Whether these make a tree of all items.
fn is_sound(Sketches { parts, top }: &Sketches, leaves: &impl Leaves) -> bool {
    // One for what holds the heads.
    let deepest = DEEPEST as u16 + 1;
    let sound = |sketch: &Sketch| {
        let mut fits = (sketch.heads > 0) == top.is_some() && sketch.is_sound(deepest);
        if fits {
            // Only triangles share a leaf.
            sketch.each_leaf(|items| {
                let alone = |item: &u32| *item < leaves.count() && leaves.is_triangle(*item);
                fits &= matches!(items, [_]) || items.iter().all(alone);
            });
        }
        fits
    };
    let items = parts.iter().flat_map(|sketch| &sketch.items);
    if parts.is_empty() || !parts.par_iter().all(sound) || !once(items, leaves.count() as usize) {
        return false;
    }
    top.as_ref().is_none_or(|top| {
        let heads: usize = parts.iter().map(|part| part.heads as usize).sum();
        let mut children = top.nodes.iter().flat_map(|stroke| stroke.children);
        top.heads == 0
            && top.is_sound(deepest)
            && children.all(|child| matches!(child, 0 | 1 | INNER))
            && once(top.items.iter(), heads)
    })
}

/// Whether these are the numbers below `count`, each once.
fn once<'a>(items: impl Iterator<Item = &'a u32>, count: usize) -> bool {
    let mut seen = vec![false; count];
    let mut total = 0;
    for item in items {
        match seen.get_mut(*item as usize) {
            Some(seen) if !*seen => *seen = true,
            _ => return false,
        }
        total += 1;
    }
    total == count
}
