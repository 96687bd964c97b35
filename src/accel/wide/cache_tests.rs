//! Trees from disk are those that were written, and nothing else comes from there.

use std::collections::HashSet;
use std::fs;

use super::cache::{Entry, Missing, through};
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
}

fn boxes(leaves: &impl Leaves) -> Vec<Bounds> {
    (0..leaves.count())
        .map(|item| leaves.bounds(item))
        .collect()
}

fn find(folder: &Path, leaves: &Row, work: Build) -> Result<assembly::Sketches, Missing> {
    Entry::new(folder, &boxes(leaves), leaves, work).read(leaves)
}

#[test]
fn a_tree_from_disk_is_the_tree_that_was_written() {
    let folder = tempfile::tempdir().unwrap();
    // In one part and in several, in a folder that is not there yet.
    let folder = folder.path().join("trees");
    for count in [5, 3000, 40_000] {
        let leaves = Row(count);
        let boxes = boxes(&leaves);
        let (built, used) = through(&folder, &boxes, &leaves, Build::Medium);
        assert_eq!((used.read, used.written), (0, 1), "{:?}", used.problems);
        let (read, used) = through(&folder, &boxes, &leaves, Build::Medium);
        assert_eq!((used.read, used.written), (1, 0), "{:?}", used.problems);
        assert!(built == read && built == build::build(&boxes, &leaves, Build::Medium));
        assert_eq!(built.parts.len() > 1, count == 40_000);
    }
    assert_eq!(fs::read_dir(folder).unwrap().count(), 3);
}

#[test]
fn a_better_tree_is_taken_and_one_of_other_items_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let leaves = Row(2000);
    through(folder.path(), &boxes(&leaves), &leaves, Build::Medium);
    for (work, is_there) in [
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
    let folder = tempfile::tempdir().unwrap();
    let leaves = Row(12_000);
    let boxes = boxes(&leaves);
    let (built, _) = through(folder.path(), &boxes, &leaves, Build::Fast);
    let path = fs::read_dir(folder.path())
        .unwrap()
        .next()
        .unwrap()
        .unwrap()
        .path();
    let whole = fs::read(&path).unwrap();
    for i in 0..200 {
        let at = |seed: u64| random::bits(seed, i) as usize % whole.len();
        let mut bytes = whole.clone();
        match i % 4 {
            0 => bytes.truncate(at(1)),
            1 => bytes[at(2)] ^= 1 << (i / 4 % 8),
            2 => bytes.extend([0; 9]),
            _ => bytes[at(3).min(at(4))..at(3).max(at(4)) + 1].fill(i as u8),
        }
        if bytes == whole {
            continue;
        }
        fs::write(&path, bytes).unwrap();
        let found = Entry::new(folder.path(), &boxes, &leaves, Build::Fast).read(&leaves);
        assert!(matches!(found, Err(Missing::Bad(..))), "damage {i}");
    }
    let (again, used) = through(folder.path(), &boxes, &leaves, Build::Fast);
    assert_eq!((used.read, used.written, used.problems.len()), (0, 1, 1));
    assert!(again == built && fs::read(&path).unwrap() == whole);
}

/// Contents that somebody has made up, with the right length and hash.
#[test]
fn whatever_is_made_up_is_no_tree_or_one_of_all_items() {
    let folder = tempfile::tempdir().unwrap();
    let leaves = Row(9000);
    let boxes = boxes(&leaves);
    let entry = Entry::new(folder.path(), &boxes, &leaves, Build::Fast);
    let true_one = build::build_in(1000, &boxes, &leaves, Build::Fast);
    assert!(true_one.parts.len() > 1);
    let mut accepted = 0;
    for i in 0..400 {
        let mut made_up = build::build_in(1000, &boxes, &leaves, Build::Fast);
        let pick = |seed: u64, n: usize| random::bits(seed, i) as usize % n;
        let number = [0, 1, 2, 7, 1000, u32::MAX][pick(1, 6)];
        let part = pick(2, made_up.parts.len() + 1);
        let sketch = match made_up.parts.get_mut(part) {
            Some(sketch) => sketch,
            None => made_up.top.as_mut().unwrap(),
        };
        let (node, item) = (pick(3, sketch.nodes.len()), pick(4, sketch.items.len()));
        let other = pick(5, sketch.nodes.len());
        match i % 10 {
            0 => sketch.heads = number,
            1 => sketch.nodes[node].first_node = number,
            2 => sketch.nodes[node].first_item = number,
            3 => sketch.nodes[node].children[pick(6, 8)] = [0, 1, 2, 4, 5, 200, 255][pick(7, 7)],
            4 => sketch.items[item] = number,
            5 => sketch.nodes.swap(node, other),
            6 => sketch.nodes[node] = sketch.nodes[other],
            7 => sketch.nodes.truncate(node),
            8 => sketch.items.truncate(item),
            _ => made_up.parts.truncate(part),
        }
        entry.write(&made_up).unwrap();
        let Ok(read) = entry.read(&leaves) else {
            continue;
        };
        accepted += 1;
        assert!(read == made_up);
        let (tree, others) = read.tree(&leaves);
        let ids = tree.blocks.iter().flat_map(|block| block.ids);
        let items: HashSet<u32> = ids.filter(|id| *id != u32::MAX).chain(others).collect();
        assert_eq!(items.len(), 9000, "change {i}");
    }
    // Those that changed nothing.
    assert!((1..200).contains(&accepted), "{accepted}");
}

#[test]
fn a_folder_that_cannot_be_written_costs_no_more_than_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "no folder").unwrap();
    let leaves = Row(100);
    let boxes = boxes(&leaves);
    let (built, used) = through(&file, &boxes, &leaves, Build::Fast);
    assert!(built == build::build(&boxes, &leaves, Build::Fast));
    assert_eq!((used.read, used.written), (0, 0));
    assert!(!used.problems.is_empty());
}
