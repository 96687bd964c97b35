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

/// How many nodes are on the longest way down, if these are a tree: its root first, every other node behind the one
/// above it.
pub(super) fn levels(nodes: &[Node], blocks: usize, others: usize) -> Option<usize> {
    let is_whole = |place: usize, node: &Node| {
        let mut lanes = (0..WIDTH).map(|lane| (node.children[lane], node.slabs.map(|s| s[lane])));
        let child = |(name, slabs): (u32, [f32; 6])| match name {
            DONE => slabs == [[f32::INFINITY, f32::NEG_INFINITY]; 3].as_flattened(),
            _ => {
                let is_there = match name {
                    0..LEAF => (name as usize) > place && (name as usize) < nodes.len(),
                    LEAF..OTHER => ((name & BLOCK_INDEX) as usize) < blocks,
                    OTHER.. => ((name & OTHER_INDEX) as usize) < others,
                };
                is_there && slabs.iter().all(|plane| plane.is_finite())
            }
        };
        // Each lane is looked at once.
        let all = |order: &u32| {
            let lanes = (0..WIDTH).fold(0_u32, |seen, i| seen | 1 << (order >> (3 * i) & 7));
            lanes == (1 << WIDTH) - 1 && order >> (3 * WIDTH) == 0
        };
        lanes.all(child) && node.order.iter().all(all)
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
    // As a rule it is one of the largest mesh.
    let largest = (numbers.iter().max_by_key(|range| range.len()).cloned()).unwrap_or_default();
    let is_triangle = |number: u32| {
        largest.contains(&number) || {
            let range = numbers.partition_point(|range| range.end <= number);
            (numbers.get(range)).is_some_and(|range| range.start <= number)
        }
    };
    let lane_is_sound = |block: &Block, lane: usize| match block.ids[lane] {
        u32::MAX => (block.corners.as_flattened().iter()).all(|corner| corner[lane].is_nan()),
        number => is_triangle(number),
    };
    let blocks = blocks.par_iter().with_min_len(GRAIN);
    let is_other = |item: &u32| *item < leaves.count() && !leaves.is_triangle(*item);
    blocks.all(|block| (0..BLOCK).all(|lane| lane_is_sound(block, lane)))
        && others.iter().all(is_other)
}
