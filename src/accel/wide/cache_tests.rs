//! Trees from disk are those that were written, and nothing else comes from there.

use std::cell::Cell;
use std::collections::HashSet;
use std::fs;

use super::cache::{Entry, Missing, Whole, through};
use super::node::{DONE, LEAF, OTHER};
use super::*;
use crate::math::random;

/// Boxes in a row; every seventh is that of no triangle.
struct Row(u32);

impl Leaves for Row {
    fn count(&self) -> u32 {
        self.0
    }

    fn bounds(&self, item: u32) -> Bounds {
        let corner = |seed: u64| {
            let near = |i: u32| random::unit(random::bits(seed, 3 * item + i));
            Vec3::new(item as f32 * 0.1 + near(0), near(1), near(2))
        };
        Bounds::EMPTY.with(corner(1)).with(corner(2))
    }

    fn is_triangle(&self, item: u32) -> bool {
        !item.is_multiple_of(7)
    }

    fn triangle(&self, item: u32) -> (u32, [Vec3; 3]) {
        let Bounds { min, max } = self.bounds(item);
        (item, [min, max, min])
    }

    fn numbers(&self) -> Vec<Range<u32>> {
        let sevenths = (0..self.0).step_by(7);
        sevenths.map(|i| i + 1..self.0.min(i + 7)).collect()
    }

    fn digest(&self, hasher: &mut blake3::Hasher) {
        hasher.update(&self.0.to_le_bytes());
    }
}

/// A tree in chunks of so many items at most.
fn built_in(most: usize, leaves: &Row, work: Build) -> Whole {
    let bounds = |item| leaves.bounds(item);
    let boxes: Vec<Bounds> = (0..leaves.count()).map(bounds).collect();
    build::build_in(most, &boxes, leaves, work).tree(leaves)
}

fn built(leaves: &Row, work: Build) -> Whole {
    built_in(chunks::most(leaves.count() as usize), leaves, work)
}

fn are_equal((a, others_of_a): &Whole, (b, others_of_b): &Whole) -> bool {
    a.nodes.bytes() == b.nodes.bytes()
        && a.blocks.bytes() == b.blocks.bytes()
        && a.levels == b.levels
        && others_of_a == others_of_b
}

fn find(folder: &Path, leaves: &Row, work: Build) -> Result<Whole, Missing> {
    Entry::new(folder, leaves, work).read(leaves)
}

#[test]
fn a_tree_from_disk_is_the_tree_that_was_written() {
    let folder = tempfile::tempdir().unwrap();
    // In one part and in several, in a folder that is not there yet.
    let folder = folder.path().join("trees");
    for count in [5, 3000, 40_000] {
        // Mapped and read.
        for work in [Build::Quick, Build::Medium] {
            let leaves = Row(count);
            let times = Cell::new(0);
            let build = || {
                times.set(times.get() + 1);
                built(&leaves, work)
            };
            let (first, used) = through(&folder, &leaves, work, build);
            assert_eq!((used.read, used.written), (0, 1), "{:?}", used.problems);
            let (second, used) = through(&folder, &leaves, work, build);
            assert_eq!((used.read, used.written), (1, 0), "{:?}", used.problems);
            assert_eq!(times.get(), 1);
            assert!(are_equal(&first, &second) && are_equal(&first, &built(&leaves, work)));
        }
    }
    assert_eq!(fs::read_dir(folder).unwrap().count(), 6);
}

#[test]
fn a_better_tree_is_taken_and_one_of_other_items_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let leaves = Row(2000);
    let build = || built(&leaves, Build::Medium);
    through(folder.path(), &leaves, Build::Medium, build);
    for (work, is_there) in [
        (Build::Quick, true),
        (Build::Fast, true),
        (Build::Medium, true),
        (Build::Slow, false),
    ] {
        assert_eq!(find(folder.path(), &leaves, work).is_ok(), is_there);
    }
    assert!(matches!(
        find(folder.path(), &Row(1999), Build::Fast),
        Err(Missing::New)
    ));
}

#[test]
fn whatever_is_damaged_is_noticed_and_built_anew() {
    for work in [Build::Quick, Build::Fast] {
        let folder = tempfile::tempdir().unwrap();
        let leaves = Row(12_000);
        let build = || built(&leaves, work);
        let (first, _) = through(folder.path(), &leaves, work, build);
        let path = fs::read_dir(folder.path())
            .unwrap()
            .next()
            .unwrap()
            .unwrap()
            .path();
        let whole = fs::read(&path).unwrap();
        // In the head, the blocks, the nodes, the others and the hash, and anywhere.
        let length = whole.len();
        let places = [
            0,
            17,
            25,
            33,
            41,
            5000,
            1 << 16,
            length / 2,
            length * 9 / 10,
        ];
        let places = places.into_iter().chain([length - 40, length - 1]);
        let anywhere = (0..100).map(|i| random::bits(2, i) as usize % length);
        for (i, at) in places.chain(anywhere).enumerate() {
            let mut bytes = whole.clone();
            match i % 8 {
                5 => bytes.truncate(at),
                6 => bytes.extend([0; 9]),
                7 => bytes[at.min(length / 2)..at.max(length / 2) + 1].fill(i as u8),
                bit => bytes[at] ^= 1 << bit,
            }
            if bytes == whole {
                continue;
            }
            fs::write(&path, bytes).unwrap();
            let found = find(folder.path(), &leaves, work);
            assert!(matches!(found, Err(Missing::Bad(..))), "damage {i}");
        }
        let (again, used) = through(folder.path(), &leaves, work, build);
        assert_eq!((used.read, used.written, used.problems.len()), (0, 1, 1));
        assert!(are_equal(&again, &first) && fs::read(&path).unwrap() == whole);
    }
}

/// Walks down all ways at once; how many items are met.
fn items_below(tree: &Tree, others: &[u32]) -> usize {
    let (mut open, mut items) = (vec![(0, 1)], HashSet::new());
    while let Some((node, level)) = open.pop() {
        assert!(level <= tree.levels());
        for name in tree.nodes[node as usize].children {
            match name {
                DONE => {}
                0..LEAF => open.push((name, level + 1)),
                LEAF..OTHER => {
                    let block = &tree.blocks[(name & node::BLOCK_INDEX) as usize];
                    items.extend(block.ids.into_iter().filter(|id| *id != u32::MAX));
                }
                OTHER.. => _ = items.insert(others[(name & node::OTHER_INDEX) as usize]),
            }
        }
    }
    items.len()
}

/// Contents that somebody has made up, with the right length and hash.
#[test]
fn whatever_is_made_up_is_no_tree_or_one_that_ends() {
    let folder = tempfile::tempdir().unwrap();
    let leaves = Row(9000);
    let entry = Entry::new(folder.path(), &leaves, Build::Quick);
    let mut accepted = 0;
    for i in 0..600 {
        let mut made_up = built_in(1000, &leaves, Build::Quick);
        let (tree, others) = &mut made_up;
        assert_eq!(items_below(tree, others), 9000);
        let pick = |seed: u64, n: usize| random::bits(seed, i) as usize % n;
        let (node, other) = (pick(2, tree.nodes.len()), pick(3, tree.nodes.len()));
        let (block, lane) = (pick(4, tree.blocks.len()), pick(5, node::WIDTH));
        let name = [
            0,
            node,
            other,
            block,
            tree.nodes.len(),
            tree.blocks.len(),
            9000,
            1 << 29,
        ];
        let name = [0, LEAF, OTHER, u32::MAX][pick(6, 4)] | name[pick(7, 8)] as u32;
        // Whether it is one that must be refused.
        let bad = match i % 12 {
            // Of an ancestor, of somebody else's child, of what is not there.
            0 => {
                tree.nodes[node].children[lane] = pick(8, node + 1) as u32;
                true
            }
            1 => {
                let inner = |child: &u32| *child < LEAF;
                let mut children = tree.nodes.iter().flat_map(|node| node.children);
                let taken = children.find(inner).unwrap();
                let before = std::mem::replace(&mut tree.nodes[node].children[lane], taken);
                before != taken
            }
            2 => {
                tree.nodes[node].children[lane] = tree.nodes.len() as u32;
                true
            }
            3 => {
                tree.nodes[node].children[lane] = LEAF | tree.blocks.len() as u32;
                true
            }
            4 => {
                tree.nodes[node].children[lane] = OTHER | others.len() as u32;
                true
            }
            5 => {
                tree.nodes[node].children[lane] = name;
                false
            }
            6 => {
                tree.nodes[node].order[lane] ^= 1 << pick(8, 32);
                true
            }
            7 => {
                tree.nodes[node].slabs[pick(8, 6)][lane] = f32::NAN;
                true
            }
            8 => {
                tree.blocks[block].ids[lane % 4] = [9000, 7, u32::MAX - 1][pick(8, 3)];
                true
            }
            9 => {
                // An empty lane that is met.
                tree.blocks[block].ids[0] = u32::MAX;
                true
            }
            10 => {
                let other = pick(8, others.len());
                others[other] = [9000, 1, u32::MAX][pick(9, 3)];
                true
            }
            _ => {
                tree.nodes.swap(node, other);
                false
            }
        };
        entry.write(&made_up).unwrap();
        match entry.read(&leaves) {
            Ok((read, others)) => {
                assert!(!bad, "change {i}");
                accepted += 1;
                assert!(items_below(&read, &others) <= 9000);
            }
            Err(Missing::Bad(_, what)) => assert!(what.contains("no tree of these items")),
            Err(Missing::New) => unreachable!("it was written"),
        }
    }
    assert!((1..100).contains(&accepted), "{accepted}");
}

#[test]
fn a_folder_that_cannot_be_written_costs_no_more_than_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "no folder").unwrap();
    let leaves = Row(100);
    let (whole, used) = through(&file, &leaves, Build::Fast, || built(&leaves, Build::Fast));
    assert!(are_equal(&whole, &built(&leaves, Build::Fast)));
    assert_eq!((used.read, used.written), (0, 0));
    assert!(!used.problems.is_empty());
}
