//! A tree that is put together from parts as they come, in their order whichever is ready first: so no more of
//! them wait than there are threads, and the tree does not depend on how many that is.

use std::collections::BTreeMap;

use super::Tree;
use super::node::{BLOCK_INDEX, Block, LEAF, Node, OTHER, OTHER_INDEX};
use super::sketch::{Head, Heads, Part, Sketch};

/// See the module.
#[derive(Debug)]
pub(super) struct Assembly {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    others: Vec<u32>,
    /// The subtrees of all parts so far.
    heads: Vec<Head>,
    /// Parts that wait for others before them.
    waiting: BTreeMap<usize, Part>,
    next: usize,
    parts: usize,
}

impl Assembly {
    /// A tree of so many parts.
    pub(super) fn new(parts: usize) -> Self {
        Self {
            // The root comes first; where there is more than one part, it is made last.
            nodes: vec![Node::EMPTY; usize::from(parts > 1)],
            blocks: Vec::new(),
            parts,
            others: Vec::new(),
            heads: Vec::new(),
            waiting: BTreeMap::new(),
            next: 0,
        }
    }

    /// Takes a part, by its place among the parts.
    pub(super) fn take(&mut self, place: usize, part: Part) {
        self.waiting.insert(place, part);
        while let Some(part) = self.waiting.remove(&self.next) {
            self.append(part);
            self.next += 1;
        }
    }

    fn append(&mut self, part: Part) {
        if self.next == 0 {
            // As the first part, so the others, as a rule. Memory that is not written to is not taken.
            let room = |len: usize| (len * self.parts).saturating_mul(5) / 4;
            self.nodes.reserve(room(part.nodes.len()));
            self.blocks.reserve(room(part.blocks.len()));
        }
        let (nodes, blocks, others) = (
            self.nodes.len() as u32,
            self.blocks.len() as u32,
            self.others.len() as u32,
        );
        let renamed = |name: u32| match name {
            u32::MAX => name,
            name if name >= OTHER => name + others,
            name if name >= LEAF => name + blocks,
            _ => name + nodes,
        };
        self.nodes.extend(part.nodes.into_iter().map(|mut node| {
            node.children = node.children.map(renamed);
            node
        }));
        self.blocks.extend(part.blocks);
        self.others.extend(part.others);
        self.heads.extend(part.heads.into_iter().map(|head| Head {
            name: renamed(head.name),
            ..head
        }));
        assert!(
            self.nodes.len() < LEAF as usize,
            "a tree of fewer than 2³¹ nodes"
        );
        assert!(
            self.blocks.len() < BLOCK_INDEX as usize,
            "a tree of fewer than 2²⁸ blocks"
        );
        assert!(
            self.others.len() < OTHER_INDEX as usize,
            "fewer than 2³⁰ other items"
        );
    }

    /// The tree under `top`, whose items are the subtrees, or under its only part; and the items that are no
    /// triangles, in the order of their names.
    pub(super) fn finish(mut self, top: Option<&Sketch>) -> (Tree, Vec<u32>) {
        let mut root = self.heads.first().copied();
        if let Some(top) = top {
            // All but the root come last.
            let base = self.nodes.len() as u32 - 1;
            let (nodes, heads) = top.nodes(base, &mut Heads(&self.heads));
            let mut nodes = nodes.into_iter();
            self.nodes[0] = nodes.next().expect("a sketch has a root");
            self.nodes.extend(nodes);
            root = heads.first().copied();
        }
        let levels = root.expect("a tree has a part").levels;
        let tree = Tree {
            nodes: self.nodes,
            blocks: self.blocks,
            levels,
        };
        (tree, self.others)
    }
}
