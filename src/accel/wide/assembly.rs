//! From sketches to a tree: how many nodes and blocks each gives is known beforehand, so each has its place in
//! the tree and fills it by itself.

use rayon::prelude::*;

use super::huge_pages::Huge;
use super::node::{BLOCK, BLOCK_INDEX, Block, LEAF, Node, OTHER, OTHER_INDEX};
use super::sketch::{Head, Sketch};
use super::{Leaves, Tree};
use crate::shape::Bounds;

/// Sketches of a whole tree.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Sketches {
    /// Each over some of the items. There is at least one.
    pub(super) parts: Vec<Sketch>,
    /// The tree over the heads of several parts, whose numbers are its items.
    pub(super) top: Option<Sketch>,
}

/// How much there is of everything, or comes before.
#[derive(Clone, Copy, Debug, Default)]
struct Count {
    nodes: usize,
    blocks: usize,
    others: usize,
}

impl Count {
    fn of(sketch: &Sketch, leaves: &impl Leaves) -> Self {
        let mut count = Self {
            nodes: sketch.node_count(),
            ..Self::default()
        };
        sketch.each_leaf(|items| match items {
            [item] if !leaves.is_triangle(*item) => count.others += 1,
            _ => count.blocks += 1,
        });
        count
    }

    fn add(&mut self, other: &Self) {
        self.nodes += other.nodes;
        self.blocks += other.blocks;
        self.others += other.others;
    }
}

/// A part's place in the tree.
struct Place<'t> {
    before: Count,
    nodes: &'t mut [Node],
    blocks: &'t mut [Block],
}

impl Place<'_> {
    /// The heads, and the items that are no triangles.
    fn fill(self, sketch: &Sketch, leaves: &impl Leaves) -> (Vec<Head>, Vec<u32>) {
        let Self { before, nodes, .. } = self;
        let mut others = Vec::new();
        let mut blocks = (before.blocks..).zip(self.blocks);
        let child = |items: &[u32]| {
            if let [item] = items
                && !leaves.is_triangle(*item)
            {
                others.push(*item);
                let name = OTHER | (before.others + others.len() - 1) as u32;
                return Head::leaf(name, leaves.bounds(*item));
            }
            let mut bounds = Bounds::EMPTY;
            let mut triangles = [Default::default(); BLOCK];
            for (triangle, item) in triangles.iter_mut().zip(items) {
                *triangle = leaves.triangle(*item);
                let (_, [a, b, c]) = *triangle;
                bounds = bounds.with(a).with(b).with(c);
            }
            let (index, block) = blocks.next().expect("blocks were counted");
            *block = Block::new(&mut triangles[..items.len()]);
            Head::leaf(Block::name(index, items.len()), bounds)
        };
        let heads = sketch.fill(nodes, before.nodes as u32, child);
        (heads, others)
    }
}

impl Sketches {
    /// The tree, and the items that are no triangles, in the order of their names.
    pub(super) fn tree(&self, leaves: &impl Leaves) -> (Tree, Vec<u32>) {
        let counts = (self.parts.par_iter()).map(|sketch| Count::of(sketch, leaves));
        let counts: Vec<Count> = counts.collect();
        // The top comes first: every node stands before those below it.
        let top_nodes = self.top.as_ref().map_or(0, Sketch::node_count);
        let mut total = Count {
            nodes: top_nodes,
            ..Count::default()
        };
        let befores = counts.iter().map(|count| {
            let before = total;
            total.add(count);
            before
        });
        let befores: Vec<Count> = befores.collect();
        assert!(
            total.nodes < LEAF as usize,
            "a tree of fewer than 2³¹ nodes"
        );
        assert!(
            total.blocks < BLOCK_INDEX as usize,
            "a tree of fewer than 2²⁸ blocks"
        );
        assert!(
            total.others < OTHER_INDEX as usize,
            "fewer than 2³⁰ other items"
        );
        let mut nodes: Huge<Node> = Huge::zeroed(total.nodes);
        let mut blocks: Huge<Block> = Huge::zeroed(total.blocks);
        let (top_room, below) = nodes.split_at_mut(top_nodes);
        let mut rest = (below, &mut blocks[..]);
        let places = befores.into_iter().zip(counts).map(|(before, count)| {
            let (nodes, blocks) = std::mem::take(&mut rest);
            let (nodes, other_nodes) = nodes.split_at_mut(count.nodes);
            let (blocks, other_blocks) = blocks.split_at_mut(count.blocks);
            rest = (other_nodes, other_blocks);
            Place {
                before,
                nodes,
                blocks,
            }
        });
        let places: Vec<Place<'_>> = places.collect();
        let filled = (places.into_par_iter().zip(&self.parts))
            .map(|(place, sketch)| place.fill(sketch, leaves));
        let (heads, others): (Vec<Vec<Head>>, Vec<Vec<u32>>) = filled.unzip();
        let (heads, others) = (heads.concat(), others.concat());
        let mut levels = heads[0].levels;
        if let Some(top) = &self.top {
            let root = top.fill(top_room, 0, |items| heads[items[0] as usize]);
            levels = root[0].levels;
        }
        let tree = Tree {
            nodes,
            blocks,
            levels,
            later: None,
        };
        (tree, others)
    }
}
