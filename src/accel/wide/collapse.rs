//! From a binary tree to a wide one, at least cost: for every binary node, what its subtree costs as one
//! child, and as up to seven (Ylitie, Karras and Laine, *Efficient incoherent ray traversal on GPUs
//! through compressed wide BVHs*, 2017, section 3). The cost of a child is its box's area, as the share
//! of rays that enter it, times what entering costs.

use obvhs::bvh2::node::Bvh2Node;
use rayon::prelude::*;

use super::build::Binary;
use super::node::{BLOCK, BLOCK_INDEX, Block, LEAF, Node, OTHER, OTHER_INDEX, WIDTH};
use super::{Leaves, Tree};
use crate::shape::Bounds;

/// What entering a block costs, where entering a node costs 1. Anything from 0.5 to 1 is as good.
const BLOCK_COST: f32 = 0.8;
/// Subtrees of fewer binary nodes are done by one thread.
const GRAIN: usize = 1 << 14;

/// What a binary subtree costs.
#[derive(Clone, Copy, Debug, Default)]
struct Plan {
    /// As at most 1, 2, … 7 children.
    cost: [f32; WIDTH - 1],
    items: u32,
    /// Whether it becomes a leaf.
    leaf: bool,
    /// Whether some item is no triangle.
    mixed: bool,
}

/// The way to share `slots` children between two nodes, and its cost: how many the first gets.
fn share(first: &Plan, second: &Plan, slots: usize) -> (usize, f32) {
    let mut best = (1, f32::INFINITY);
    for k in slots.saturating_sub(WIDTH - 1).max(1)..slots.min(WIDTH) {
        let cost = first.cost[k - 1] + second.cost[slots - k - 1];
        if cost < best.1 {
            best = (k, cost);
        }
    }
    best
}

/// Half the area of a node's box: infinite where a product of its sides overflows, be others zero.
fn area(node: &Bvh2Node) -> f32 {
    let area = node.aabb().half_area();
    if area.is_nan() { f32::INFINITY } else { area }
}

struct Collapse<'b, L> {
    nodes: &'b [Bvh2Node],
    plans: Vec<Plan>,
    leaves: &'b L,
}

/// A wide tree in the making; the root comes first.
#[derive(Default)]
struct Part {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    others: Vec<u32>,
    levels: usize,
    /// Subtrees left to others: the wide node that they become, the binary node, and the level.
    deferred: Vec<(usize, usize, usize)>,
}

/// The wide tree over a binary one, and its items that are no triangles in the order of their names.
pub(super) fn collapse(binary: &Binary, leaves: &impl Leaves) -> (Tree, Vec<u32>) {
    let nodes = &binary.nodes;
    let mut collapse = Collapse {
        nodes,
        plans: Vec::new(),
        leaves,
    };
    let mut plans = vec![Plan::default(); nodes.len()];
    let (root, below) = plans.split_at_mut(1);
    collapse.plan_below(0, nodes.len(), below);
    root[0] = collapse.plan(0, below, 1);
    collapse.plans = plans;
    let top = collapse.part(0, GRAIN);
    let parts: Vec<Part> = (top.deferred.par_iter())
        .map(|(_, node, _)| collapse.part(*node, 0))
        .collect();
    top.joined(parts)
}

impl<L: Leaves> Collapse<'_, L> {
    /// Plans everything below a node; `end` is where the binary nodes below it end, `plans` begins at its
    /// children.
    fn plan_below(&self, node: usize, end: usize, plans: &mut [Plan]) {
        let node = &self.nodes[node];
        if node.is_leaf() {
            return;
        }
        let first = node.first_index as usize;
        if end - first < GRAIN {
            for i in (first..end).rev() {
                plans[i - first] = self.plan(i, plans, first);
            }
            return;
        }
        // Below the second child comes first.
        let middle = match &self.nodes[first] {
            leaf if leaf.is_leaf() => end,
            inner => inner.first_index as usize,
        };
        let (pair, below) = plans.split_at_mut(2);
        let (second, other) = below.split_at_mut(middle - first - 2);
        rayon::join(
            || self.plan_below(first + 1, middle, second),
            || self.plan_below(first, end, other),
        );
        pair[1] = self.plan(first + 1, second, first + 2);
        pair[0] = self.plan(first, other, middle);
    }

    /// Plans a node whose children are planned; `plans` begins at the binary node `base`.
    fn plan(&self, node: usize, plans: &[Plan], base: usize) -> Plan {
        let node = &self.nodes[node];
        let area = area(node);
        if node.is_leaf() {
            return Plan {
                cost: [area * BLOCK_COST; WIDTH - 1],
                items: 1,
                leaf: true,
                mixed: !self.leaves.is_triangle(node.first_index),
            };
        }
        let child = node.first_index as usize - base;
        let [first, second] = [&plans[child], &plans[child + 1]];
        let items = first.items + second.items;
        let mixed = first.mixed || second.mixed;
        let as_leaf = if items as usize <= BLOCK && !mixed {
            area * BLOCK_COST
        } else {
            f32::INFINITY
        };
        let as_node = share(first, second, WIDTH).1 + area;
        let mut cost = [as_leaf.min(as_node); WIDTH - 1];
        for slots in 2..WIDTH {
            cost[slots - 1] = share(first, second, slots).1.min(cost[slots - 2]);
        }
        Plan {
            cost,
            items,
            // The infinity of areas that overflow is a reason too.
            leaf: as_leaf <= as_node && items as usize <= BLOCK && !mixed,
            mixed,
        }
    }

    /// The binary nodes that become the children of the wide node over `node`.
    fn children(&self, node: usize) -> Vec<usize> {
        let pair = |node: usize| self.nodes[node].first_index as usize;
        let mut children = Vec::with_capacity(WIDTH);
        if self.plans[node].leaf {
            return vec![node];
        }
        let mut open = vec![(node, WIDTH)];
        while let Some((node, mut slots)) = open.pop() {
            let plan = &self.plans[node];
            while (2..WIDTH).contains(&slots) && plan.cost[slots - 1] >= plan.cost[slots - 2] {
                slots -= 1;
            }
            if slots == 1 {
                children.push(node);
                continue;
            }
            let first = pair(node);
            let (k, _) = share(&self.plans[first], &self.plans[first + 1], slots);
            open.extend([(first + 1, slots - k), (first, k)]);
        }
        children
    }

    /// The wide tree over `root`; subtrees of fewer than `grain` items are left out.
    fn part(&self, root: usize, grain: usize) -> Part {
        let mut part = Part {
            nodes: vec![Node::EMPTY],
            ..Part::default()
        };
        let mut open = vec![(root, 0, 1)];
        while let Some((node, place, level)) = open.pop() {
            part.levels = part.levels.max(level);
            if (self.plans[node].items as usize) < grain {
                part.deferred.push((place, node, level));
                continue;
            }
            let children = self.children(node);
            let boxes = children.iter().map(|child| {
                let aabb = self.nodes[*child].aabb();
                Bounds {
                    min: aabb.min.into(),
                    max: aabb.max.into(),
                }
            });
            let mut wide = Node::new(&boxes.collect::<Vec<_>>());
            let begin = open.len();
            for (lane, child) in children.into_iter().enumerate() {
                wide.children[lane] = if self.plans[child].leaf {
                    self.leaf(child, &mut part)
                } else {
                    open.push((child, part.nodes.len(), level + 1));
                    part.nodes.push(Node::EMPTY);
                    part.nodes.len() as u32 - 1
                };
            }
            open[begin..].reverse();
            part.nodes[place] = wide;
        }
        part
    }

    /// Makes a leaf of a binary subtree, and names it.
    fn leaf(&self, node: usize, part: &mut Part) -> u32 {
        let (mut open, mut triangles) = (vec![node], Vec::with_capacity(BLOCK));
        while let Some(node) = open.pop() {
            let node = &self.nodes[node];
            if !node.is_leaf() {
                open.extend([node.first_index as usize, node.first_index as usize + 1]);
                continue;
            }
            if !self.leaves.is_triangle(node.first_index) {
                part.others.push(node.first_index);
                return OTHER | (part.others.len() as u32 - 1);
            }
            triangles.push(self.leaves.triangle(node.first_index));
        }
        part.blocks.push(Block::new(&mut triangles));
        Block::name(part.blocks.len() - 1, triangles.len())
    }
}

impl Part {
    /// The whole tree, with the parts that were left out.
    fn joined(mut self, parts: Vec<Part>) -> (Tree, Vec<u32>) {
        let deferred = std::mem::take(&mut self.deferred);
        let total = |count: fn(&Part) -> usize| parts.iter().map(count).sum::<usize>();
        self.nodes.reserve_exact(total(|part| part.nodes.len()));
        self.blocks.reserve_exact(total(|part| part.blocks.len()));
        self.others.reserve_exact(total(|part| part.others.len()));
        for (part, (place, _, level)) in parts.into_iter().zip(deferred) {
            let (nodes, blocks, others) = (
                // Its root stands elsewhere.
                self.nodes.len() as u32 - 1,
                self.blocks.len() as u32,
                self.others.len() as u32,
            );
            let renamed = |mut node: Node| {
                for name in &mut node.children {
                    *name += match *name {
                        u32::MAX => 0,
                        name if name >= OTHER => others,
                        name if name >= LEAF => blocks,
                        _ => nodes,
                    };
                }
                node
            };
            let mut made = part.nodes.into_iter().map(renamed);
            self.nodes[place] = made.next().expect("a part has a root");
            self.nodes.extend(made);
            self.blocks.extend(part.blocks);
            self.others.extend(part.others);
            self.levels = self.levels.max(level + part.levels - 1);
        }
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
        let tree = Tree {
            nodes: {
                let mut n = super::huge::Huge::filled(self.nodes.len(), Node::EMPTY);
                n.copy_from_slice(&self.nodes);
                n
            },
            blocks: {
                let mut n = super::huge::Huge::filled(self.blocks.len(), Block::EMPTY);
                n.copy_from_slice(&self.blocks);
                n
            },
            levels: self.levels,
        };
        (tree, self.others)
    }
}
