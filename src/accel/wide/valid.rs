//! Whether nodes and blocks that come from a file make a tree that can be walked: every child is there, no node hangs
//! below two others or below itself, no way down is too long, and only triangles of the items are met.

use rayon::prelude::*;

use super::Leaves;
use super::binary::DEEPEST;
use super::node::{BLOCK, BLOCK_INDEX, Block, DONE, LEAF, Node, OTHER, OTHER_INDEX, WIDTH};

/// Nodes or blocks that are looked at by one task.
const GRAIN: usize = 1 << 12;
/// Nodes on the longest way down: through the tree over all chunks, and that of one of them.
const LONGEST: u16 = 2 * (DEEPEST as u16 + 1);

/// The planes of a lane that holds nothing.
const NOWHERE: [f32; 6] = {
    let (low, high) = (f32::INFINITY, f32::NEG_INFINITY);
    [low, high, low, high, low, high]
};

/// The lanes, as bits, that half of an order names.
const LANES: [u8; 1 << 12] = {
    let mut lanes = [0; 1 << 12];
    let mut order = 0;
    while order < lanes.len() {
        let mut place = 0;
        while place < 12 {
            lanes[order] |= 1 << (order >> place & 7);
            place += 3;
        }
        order += 1;
    }
    lanes
};

/// How many nodes are on the longest way down, if these are a tree: its root first, every other node behind the one
/// above it.
pub(super) fn levels(nodes: &[Node], blocks: usize, others: usize) -> Option<usize> {
    let is_whole = |place: usize, node: &Node| {
        // All lanes at once, without a branch.
        let (mut finite, mut nowhere) = ([true; WIDTH], [true; WIDTH]);
        for (plane, none) in node.slabs.iter().zip(NOWHERE) {
            for lane in 0..WIDTH {
                finite[lane] &= plane[lane].is_finite();
                nowhere[lane] &= plane[lane] == none;
            }
        }
        let is_there = |name: u32| match name {
            0..LEAF => (name as usize) > place && (name as usize) < nodes.len(),
            LEAF..OTHER => ((name & BLOCK_INDEX) as usize) < blocks,
            OTHER.. => ((name & OTHER_INDEX) as usize) < others,
        };
        let child = |lane: usize| match node.children[lane] {
            DONE => nowhere[lane],
            name => finite[lane] && is_there(name),
        };
        // Each lane is looked at once.
        let all = |order: &u32| {
            let [first, last] = [order & 0xfff, order >> 12].map(|half| LANES.get(half as usize));
            first.zip(last).is_some_and(|(a, b)| a | b == u8::MAX)
        };
        (0..WIDTH).all(child) && node.order.iter().all(all)
    };
    let all = nodes.par_iter().enumerate().with_min_len(GRAIN);
    if !all.all(|(place, node)| is_whole(place, node)) {
        return None;
    }
    // Levels down to each node; 0 where nobody has named it.
    let mut levels = vec![0_u16; nodes.len()];
    *levels.first_mut()? = 1;
    let mut longest = 1;
    for (place, node) in nodes.iter().enumerate() {
        let level = levels[place];
        if level == 0 || level > LONGEST {
            return None;
        }
        longest = longest.max(level);
        for child in node.children.into_iter().filter(|child| *child < LEAF) {
            let below = &mut levels[child as usize];
            if *below != 0 {
                return None;
            }
            *below = level + 1;
        }
    }
    Some(usize::from(longest))
}

/// Whether blocks hold nothing but triangles of these items, and `others` are those that are none.
pub(super) fn are_of(blocks: &[Block], others: &[u32], leaves: &impl Leaves) -> bool {
    let numbers = leaves.numbers();
    let is_triangle = |number: u32| {
        let range = numbers.partition_point(|range| range.end <= number);
        (numbers.get(range)).is_some_and(|range| range.start <= number)
    };
    let lane_is_sound = |block: &Block, lane: usize| match block.ids[lane] {
        u32::MAX => (block.corners.as_flattened().iter()).all(|corner| corner[lane].is_nan()),
        number => is_triangle(number),
    };
    // As a rule all of a block are of the largest mesh.
    let largest = (numbers.iter().max_by_key(|range| range.len()).cloned()).unwrap_or_default();
    let is_sound = |block: &Block| {
        (block.ids.iter()).fold(true, |all, id| all & largest.contains(id))
            || (0..BLOCK).all(|lane| lane_is_sound(block, lane))
    };
    let blocks = blocks.par_iter().with_min_len(GRAIN);
    let is_other = |item: &u32| *item < leaves.count() && !leaves.is_triangle(*item);
    blocks.all(is_sound) && others.iter().all(is_other)
}
