//! The shape of a wide tree without its boxes: which nodes, blocks and items hang below which, in 16 bytes a
//! node and 4 an item. A sketch comes from a binary tree, and becomes nodes and blocks by what its items
//! say of their boxes, from the leaves up.

use super::node::{DONE, Node, WIDTH};
use crate::shape::Bounds;

/// A child that is a node; other children are 1 to 4 items.
pub(super) const INNER: u8 = u8::MAX;

/// A node's children: nodes and items, each in a row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Stroke {
    /// What each child is: [`INNER`] or a number of items; 0 where there is none, behind the others.
    pub(super) children: [u8; WIDTH],
    /// The first of its children that are nodes.
    pub(super) first_node: u32,
    /// The first of the items of its other children.
    pub(super) first_item: u32,
}

/// See the module.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Sketch {
    /// How many subtrees it consists of. They are the children of as few nodes as it takes, which come first
    /// and do not become nodes; where there are none, the first node is the root.
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

impl Head {
    const NONE: Self = Self::leaf(DONE, Bounds::EMPTY);

    pub(super) const fn leaf(name: u32, bounds: Bounds) -> Self {
        Self {
            name,
            bounds,
            levels: 0,
        }
    }

    /// A node by its children.
    fn over(children: &[Self; WIDTH], name: u32) -> Self {
        let boxes = children.iter().map(|child| child.bounds);
        Self {
            name,
            bounds: boxes.fold(Bounds::EMPTY, Bounds::union),
            levels: 1 + children.iter().map(|child| child.levels).max().unwrap_or(0),
        }
    }
}

impl Sketch {
    /// Nodes that only hold the heads.
    fn holders(&self) -> usize {
        (self.heads as usize).div_ceil(WIDTH)
    }

    /// How many nodes it becomes.
    pub(super) fn node_count(&self) -> usize {
        self.nodes.len() - self.holders()
    }

    /// Shows the items of every leaf.
    pub(super) fn each_leaf(&self, mut show: impl FnMut(&[u32])) {
        for stroke in &self.nodes {
            let mut rest = &self.items[stroke.first_item as usize..];
            for child in stroke.children.iter().filter(|c| !matches!(**c, 0 | INNER)) {
                let (items, others) = rest.split_at(usize::from(*child));
                show(items);
                rest = others;
            }
        }
    }

    /// Makes the nodes, which are named from `base` on, and gives the heads, or the root; `child` makes leaves, in
    /// the order of [`Self::each_leaf`]. There is room for as many nodes as it becomes.
    pub(super) fn fill(
        &self,
        nodes: &mut [Node],
        base: u32,
        mut child: impl FnMut(&[u32]) -> Head,
    ) -> Vec<Head> {
        let holders = self.holders();
        let mut children = vec![[Head::NONE; WIDTH]; self.nodes.len()];
        for (stroke, children) in self.nodes.iter().zip(&mut children) {
            let mut rest = &self.items[stroke.first_item as usize..];
            for (count, head) in stroke.children.iter().zip(children) {
                if !matches!(*count, 0 | INNER) {
                    let (items, others) = rest.split_at(usize::from(*count));
                    *head = child(items);
                    rest = others;
                }
            }
        }
        for (i, stroke) in self.nodes.iter().enumerate().rev() {
            let mut next = stroke.first_node as usize;
            for (lane, child) in stroke.children.into_iter().enumerate() {
                if child == INNER {
                    let name = base + (next - holders) as u32;
                    children[i][lane] = Head::over(&children[next], name);
                    next += 1;
                }
            }
            if i >= holders {
                let count = stroke.children.iter().filter(|c| **c > 0).count();
                let boxes = children[i].map(|child| child.bounds);
                let mut node = Node::new(&boxes[..count]);
                node.children = children[i].map(|child| child.name);
                nodes[i - holders] = node;
            }
        }
        if holders == 0 {
            return vec![Head::over(&children[0], base)];
        }
        let heads = children[..holders].iter().flatten();
        heads.filter(|head| head.name != DONE).copied().collect()
    }
}
