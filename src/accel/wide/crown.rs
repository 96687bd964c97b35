//! The first levels of a chunk's binary tree, down to a few hundred subtrees; and the crowns of all chunks under
//! the cuts between them: a small binary tree, where reinsertion mends the seams.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;

use super::binary::{DEEPEST, depth_first, halve};
use super::collapse::{Collapse, Plan, area};
use super::sketch::Sketch;
use crate::accel::Build;
use crate::shape::Bounds;

/// Subtrees of a chunk.
const SUBTREES: usize = 256;

/// See the module.
#[derive(Debug)]
pub(super) struct Crown {
    /// The first is the root; leaves name subtrees.
    nodes: Vec<Bvh2Node>,
    /// What each subtree costs.
    plans: Vec<Plan>,
    /// The binary nodes over the subtrees.
    pub(super) roots: Vec<usize>,
}

impl Crown {
    /// Opens the largest nodes first.
    pub(super) fn new(nodes: &[Bvh2Node], plans: &[Plan]) -> Self {
        let mut crown = Self {
            nodes: vec![nodes[0]],
            plans: Vec::new(),
            roots: Vec::new(),
        };
        let (mut open, mut closed) = (BinaryHeap::new(), Vec::new());
        let mut meet = |open: &mut BinaryHeap<Large>, node: usize, place| match plans[node].leaf {
            true => closed.push((node, place)),
            false => open.push(Large {
                area: area(&nodes[node]),
                node,
                place,
            }),
        };
        meet(&mut open, 0, 0);
        for _ in 1..SUBTREES {
            let Some(Large { node, place, .. }) = open.pop() else {
                break;
            };
            let (children, first) = (nodes[node].first_index as usize, crown.nodes.len());
            crown.nodes[place].first_index = first as u32;
            crown.nodes.extend([nodes[children], nodes[children + 1]]);
            meet(&mut open, children, first);
            meet(&mut open, children + 1, first + 1);
        }
        closed.extend(open.into_iter().map(|large| (large.node, large.place)));
        // In the tree's order, for then neighbours are neighbours in space.
        closed.sort_unstable();
        for (node, place) in closed {
            let subtree = crown.roots.len() as u32;
            crown.nodes[place] = Bvh2Node::new(*nodes[node].aabb(), 1, subtree);
            crown.plans.push(plans[node].subtree());
            crown.roots.push(node);
        }
        crown
    }
}

/// A node that can be opened; the largest first.
#[derive(Debug, PartialEq)]
struct Large {
    area: f32,
    node: usize,
    place: usize,
}

impl Eq for Large {}

impl PartialOrd for Large {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Large {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_area = self.area.total_cmp(&other.area);
        by_area.then(other.node.cmp(&self.node))
    }
}

/// The wide tree over the heads of all chunks, whose numbers are its items.
#[derive(Debug)]
pub(super) struct Top {
    pub(super) sketch: Sketch,
    /// As how many children each subtree of each chunk is wanted: so many heads it has.
    pub(super) slots: Vec<Vec<usize>>,
}

/// Joins the crowns; the leaves of the binary tree `cuts` name them.
pub(super) fn top(cuts: Vec<Bvh2Node>, crowns: &[Crown], work: Build) -> Top {
    let plans: Vec<Plan> = (crowns.iter())
        .flat_map(|crown| crown.plans.iter().copied())
        .collect();
    let mut tree = Bvh2 {
        nodes: grafted(cuts, crowns),
        primitive_indices: (0..plans.len() as u32).collect(),
        ..Bvh2::default()
    };
    tree.reorder_in_stack_traversal_order();
    let share = match work {
        Build::Quick | Build::Fast => 0.2,
        Build::Medium | Build::Slow => 1.0,
    };
    ReinsertionOptimizer::default().run(&mut tree, share, None);
    if depth_first(&mut tree) > DEEPEST {
        let mut boxes = vec![Bounds::EMPTY; plans.len()];
        for leaf in tree.nodes.iter().filter(|node| node.is_leaf()) {
            let aabb = leaf.aabb();
            boxes[leaf.first_index as usize] = Bounds {
                min: aabb.min.into(),
                max: aabb.max.into(),
            };
        }
        let mut all: Vec<u32> = (0..plans.len() as u32).collect();
        tree.nodes = vec![Bvh2Node::default()];
        halve(&boxes, &mut all, 0, &mut tree.nodes);
        depth_first(&mut tree);
    }
    let subtree = |node: &Bvh2Node| plans[node.first_index as usize];
    let (collapse, _) = Collapse::new(&tree.nodes, Vec::new(), subtree);
    let mut sketch = collapse.sketch();
    // A subtree stands there as often as it is wanted, and becomes so many heads.
    let mut slots = vec![0; plans.len()];
    for item in &sketch.items {
        slots[*item as usize] += 1;
    }
    let mut heads = starts(&slots);
    for item in &mut sketch.items {
        let head = &mut heads[*item as usize];
        *item = *head as u32;
        *head += 1;
    }
    let mut rest = &slots[..];
    let slots = crowns.iter().map(|crown| {
        let (these, others) = rest.split_at(crown.plans.len());
        rest = others;
        these.to_vec()
    });
    Top {
        slots: slots.collect(),
        sketch,
    }
}

/// The cuts with the crowns in the place of their leaves, whose subtrees are numbered through.
fn grafted(mut cuts: Vec<Bvh2Node>, crowns: &[Crown]) -> Vec<Bvh2Node> {
    let counts: Vec<usize> = crowns.iter().map(|crown| crown.plans.len()).collect();
    let starts = starts(&counts);
    for place in 0..cuts.len() {
        if !cuts[place].is_leaf() {
            continue;
        }
        let chunk = cuts[place].first_index as usize;
        // Its root stands elsewhere.
        let base = cuts.len() - 1;
        let mut moved = crowns[chunk].nodes.iter().map(|node| {
            let start = if node.is_leaf() { starts[chunk] } else { base };
            let first = node.first_index + start as u32;
            Bvh2Node::new(*node.aabb(), node.prim_count, first)
        });
        cuts[place] = moved.next().expect("a crown has a root");
        cuts.extend(moved);
    }
    cuts
}

/// Where each begins that has so many, one after another.
fn starts(counts: &[usize]) -> Vec<usize> {
    let starts = counts.iter().scan(0, |next, count| {
        let start = *next;
        *next += count;
        Some(start)
    });
    starts.collect()
}
