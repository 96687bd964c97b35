//! The shape of a wide tree without its boxes: which nodes, blocks and items hang below which, in 16 bytes a
//! node and 4 an item. A sketch comes from a binary tree or from a file, and becomes nodes and blocks by
//! what its items say of their boxes, from the leaves up.

use super::Leaves;
use super::node::{BLOCK, Block, DONE, Node, OTHER, WIDTH};
use crate::shape::Bounds;

/// A child that is a node; other children are 1 to 4 items, or none.
pub(super) const INNER: u8 = u8::MAX;

/// A node's children: nodes and items, each in a row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Stroke {
    /// What each child is: see [`INNER`].
    pub(super) children: [u8; WIDTH],
    /// The first of its children that are nodes.
    pub(super) first_node: u32,
    /// The first of the items of its other children.
    pub(super) first_item: u32,
}

/// See the module.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Sketch {
    /// How many subtrees it consists of. They are the children of as many nodes as it takes, which come first
    /// and are no part of the tree; where there are none, the first node is the root.
    pub(super) heads: u32,
    /// Nodes, parents before children.
    pub(super) nodes: Vec<Stroke>,
    pub(super) items: Vec<u32>,
}

/// A subtree: what its parent has to know.
#[derive(Clone, Copy, Debug)]
pub(super) struct Head {
    pub(super) name: u32,
    pub(super) bounds: Bounds,
    /// Nodes on the longest way down.
    pub(super) levels: usize,
}

/// Nodes and blocks; names count from their beginning.
#[derive(Debug, Default)]
pub(super) struct Part {
    pub(super) nodes: Vec<Node>,
    pub(super) blocks: Vec<Block>,
    /// The items that are no triangles.
    pub(super) others: Vec<u32>,
    /// The subtrees; the root, where there is but one.
    pub(super) heads: Vec<Head>,
}

/// What becomes of the items that are one child.
pub(super) trait Ground {
    fn child(&mut self, items: &[u32]) -> Head;
}

/// Blocks of triangles, and other items.
pub(super) struct Items<'l, L> {
    boxes: &'l [Bounds],
    leaves: &'l L,
    blocks: Vec<Block>,
    others: Vec<u32>,
}

impl<L: Leaves> Ground for Items<'_, L> {
    fn child(&mut self, items: &[u32]) -> Head {
        let boxes = items.iter().map(|item| self.boxes[*item as usize]);
        let bounds = boxes.fold(Bounds::EMPTY, Bounds::union);
        let name = match items {
            [item] if !self.leaves.is_triangle(*item) => {
                self.others.push(*item);
                OTHER | (self.others.len() as u32 - 1)
            }
            _ => {
                let mut triangles = [Default::default(); BLOCK];
                for (triangle, item) in triangles.iter_mut().zip(items) {
                    *triangle = self.leaves.triangle(*item);
                }
                self.blocks.push(Block::new(&mut triangles[..items.len()]));
                Block::name(self.blocks.len() - 1, items.len())
            }
        };
        Head {
            name,
            bounds,
            levels: 0,
        }
    }
}

/// Subtrees that are there already; items are their numbers.
pub(super) struct Heads<'h>(pub(super) &'h [Head]);

impl Ground for Heads<'_> {
    fn child(&mut self, items: &[u32]) -> Head {
        self.0[items[0] as usize]
    }
}

const NOTHING: Head = Head {
    name: DONE,
    bounds: Bounds::EMPTY,
    levels: 0,
};

impl Sketch {
    /// Nodes that only hold the subtrees together.
    fn holders(&self) -> usize {
        (self.heads as usize).div_ceil(WIDTH)
    }

    /// Nodes and blocks over a scene's items.
    pub(super) fn part(&self, boxes: &[Bounds], leaves: &impl Leaves) -> Part {
        let mut ground = Items {
            boxes,
            leaves,
            blocks: Vec::with_capacity(self.items.len() / 2),
            others: Vec::new(),
        };
        let (nodes, heads) = self.nodes(0, &mut ground);
        Part {
            nodes,
            blocks: ground.blocks,
            others: ground.others,
            heads,
        }
    }

    /// The nodes, named from `base` on, and the subtrees.
    pub(super) fn nodes(&self, base: u32, ground: &mut impl Ground) -> (Vec<Node>, Vec<Head>) {
        let holders = self.holders();
        let mut children: Vec<[Head; WIDTH]> = Vec::with_capacity(self.nodes.len());
        for stroke in &self.nodes {
            let mut next = stroke.first_item as usize;
            children.push(stroke.children.map(|child| match child {
                0 | INNER => NOTHING,
                count => {
                    let items = &self.items[next..next + usize::from(count)];
                    next += items.len();
                    ground.child(items)
                }
            }));
        }
        let mut nodes = vec![Node::EMPTY; self.nodes.len() - holders];
        let mut heads = Vec::with_capacity(self.heads as usize);
        for i in (0..self.nodes.len()).rev() {
            let mut next = self.nodes[i].first_node as usize;
            for (lane, child) in self.nodes[i].children.into_iter().enumerate() {
                if child == INNER {
                    children[i][lane] = head(&children[next], base + (next - holders) as u32);
                    next += 1;
                }
            }
            let count = self.nodes[i].children.iter().filter(|c| **c > 0).count();
            if i >= holders {
                let boxes = children[i].map(|child| child.bounds);
                let mut node = Node::new(&boxes[..count]);
                node.children = children[i].map(|child| child.name);
                nodes[i - holders] = node;
            }
        }
        if holders == 0 {
            heads.extend(children.first().map(|children| head(children, base)));
        }
        for (stroke, children) in self.nodes[..holders].iter().zip(children) {
            let there = stroke.children.into_iter().zip(children);
            heads.extend(there.filter(|(child, _)| *child > 0).map(|(_, head)| head));
        }
        (nodes, heads)
    }
}

/// A node as a child, by its children.
fn head(children: &[Head; WIDTH], name: u32) -> Head {
    let boxes = children.iter().map(|child| child.bounds);
    Head {
        name,
        bounds: boxes.fold(Bounds::EMPTY, Bounds::union),
        levels: 1 + children.iter().map(|child| child.levels).max().unwrap_or(0),
    }
}
