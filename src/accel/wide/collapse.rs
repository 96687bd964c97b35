//! From a binary tree to a wide one, at least cost: for every binary node, what its subtree costs as one
//! child, and as up to seven (Ylitie, Karras and Laine, *Efficient incoherent ray traversal on GPUs
//! through compressed wide BVHs*, 2017, section 3). The cost of a child is its box's area, as the share
//! of rays that enter it, times what entering costs.

use obvhs::bvh2::node::Bvh2Node;

use super::node::{BLOCK, WIDTH};
use super::sketch::{INNER, Sketch, Stroke};

/// What entering a block costs, where entering a node costs 1. Anything from 0.5 to 1 is as good.
const BLOCK_COST: f32 = 0.8;

/// What a binary subtree costs.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Plan {
    /// As at most 1, 2, … 7 children.
    cost: [f32; WIDTH - 1],
    items: u32,
    /// Whether it becomes one leaf.
    pub(super) leaf: bool,
    /// Whether it must not share a block with others.
    pub(super) alone: bool,
}

/// Half the area of a node's box: infinite where a product of its sides overflows, be others zero.
pub(super) fn area(node: &Bvh2Node) -> f32 {
    let area = node.aabb().half_area();
    if area.is_nan() { f32::INFINITY } else { area }
}

/// The way to share `slots` children between two nodes, and its cost: how many the first gets.
#[inline(always)]
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

impl Plan {
    /// The plan for a leaf's items.
    pub(super) fn leaf(node: &Bvh2Node, alone: bool) -> Self {
        Self {
            cost: [area(node) * BLOCK_COST; WIDTH - 1],
            items: node.prim_count,
            leaf: true,
            alone,
        }
    }

    /// The plan for a node over two others, and how it shares its children out.
    fn over(area: f32, first: &Plan, second: &Plan) -> (Self, [usize; WIDTH + 1]) {
        let items = first.items.saturating_add(second.items);
        let alone = first.alone || second.alone;
        let is_small = items as usize <= BLOCK && !alone;
        let as_leaf = if is_small {
            area * BLOCK_COST
        } else {
            f32::INFINITY
        };
        let mut shares = [0; WIDTH + 1];
        let (k, below) = share(first, second, WIDTH);
        shares[WIDTH] = k;
        let as_node = below + area;
        let mut cost = [as_leaf.min(as_node); WIDTH - 1];
        for slots in 2..WIDTH {
            let (k, split) = share(first, second, slots);
            cost[slots - 1] = split.min(cost[slots - 2]);
            shares[slots] = if split < cost[slots - 2] { k } else { 0 };
        }
        let plan = Self {
            cost,
            items,
            // The infinity of areas that overflow is a reason too.
            leaf: as_leaf <= as_node && is_small,
            alone,
        };
        (plan, shares)
    }

    /// The plan of a subtree that is an item of another tree.
    pub(super) fn subtree(&self) -> Self {
        Self {
            alone: true,
            leaf: true,
            ..*self
        }
    }

    /// As how many children it is worth having, where there may be so many.
    fn worth(&self, slots: usize) -> usize {
        let cheaper = |slots: &usize| self.cost[*slots - 1] < self.cost[*slots - 2];
        (2..=slots.min(WIDTH - 1)).rev().find(cheaper).unwrap_or(1)
    }
}

/// A binary node, and what becomes of it, in 8 bytes.
#[derive(Clone, Copy, Debug)]
struct Choice {
    /// Its children, or its item.
    first: u32,
    /// Three bits each for 2, 3, … 8 children: how many its first child gets; 0 if it is no better with them
    /// than with one less. Then whether it has items and no children, whether it becomes a leaf, and in two bits how
    /// many items it has beside the first.
    bits: u32,
}

impl Choice {
    const ITEM: u32 = 1 << 24;
    const LEAF: u32 = 1 << 25;
    const COUNT_SHIFT: u32 = 26;

    fn new(node: &Bvh2Node, plan: &Plan, shares: [usize; WIDTH + 1]) -> Self {
        let mut bits = 0;
        for (slots, share) in shares.into_iter().enumerate().skip(2) {
            bits |= ((share & 7) as u32) << (3 * (slots - 2));
        }
        if node.is_leaf() {
            bits |= Self::ITEM | (node.prim_count - 1) << Self::COUNT_SHIFT;
        }
        if plan.leaf {
            bits |= Self::LEAF;
        }
        Self {
            first: node.first_index,
            bits,
        }
    }

    fn is_item(self) -> bool {
        self.bits & Self::ITEM != 0
    }

    fn is_leaf(self) -> bool {
        self.bits & Self::LEAF != 0
    }

    /// How many items it has, if it is one.
    fn count(self) -> usize {
        (self.bits >> Self::COUNT_SHIFT) as usize + 1
    }

    /// How many of so many children the first child gets.
    #[inline]
    fn share(self, slots: usize) -> usize {
        (self.bits >> (3 * (slots - 2)) & 7) as usize
    }
}

/// A binary tree and what is to become of it.
#[derive(Debug)]
pub(super) struct Collapse {
    choices: Vec<Choice>,
    /// Where leaves of several items have theirs.
    runs: Vec<u32>,
}

impl Collapse {
    /// Plans for a tree with parents before children; leaves are asked for theirs. A leaf of one item names it, a leaf
    /// of two to four the place of the first among `runs`.
    pub(super) fn new(
        nodes: &[Bvh2Node],
        runs: Vec<u32>,
        leaf: impl Fn(&Bvh2Node) -> Plan,
    ) -> (Self, Vec<Plan>) {
        let mut plans = vec![Plan::default(); nodes.len()];
        let nothing = Choice { first: 0, bits: 0 };
        let mut choices = vec![nothing; nodes.len()];
        for (i, node) in nodes.iter().enumerate().rev() {
            let (plan, shares) = if node.is_leaf() {
                let plan = leaf(node);
                // Where it is worth having as several children, it has itself shared out.
                let worth = |slots| usize::from(slots > 1 && plan.worth(slots) == slots);
                (plan, std::array::from_fn(worth))
            } else {
                let child = node.first_index as usize;
                Plan::over(area(node), &plans[child], &plans[child + 1])
            };
            plans[i] = plan;
            choices[i] = Choice::new(node, &plan, shares);
        }
        (Self { choices, runs }, plans)
    }

    /// The binary nodes that stand for `node` as at most so many children, each one of them; items as many as
    /// they were shared out to.
    fn children(&self, node: usize, slots: usize, children: &mut Vec<(usize, usize)>) {
        // No two wait whose slots are more than eight.
        let (mut open, mut height) = ([(0, 0); WIDTH], 1);
        open[0] = (node, slots);
        while height > 0 {
            height -= 1;
            let (node, mut slots) = open[height];
            let choice = self.choices[node];
            while slots > 1 && choice.share(slots) == 0 {
                slots -= 1;
            }
            if slots == 1 || choice.is_item() {
                children.push((node, slots));
                continue;
            }
            let (k, first) = (choice.share(slots), choice.first as usize);
            open[height] = (first + 1, slots - k);
            open[height + 1] = (first, k);
            height += 2;
        }
    }

    /// The wide tree. An item that was shared out stands there as often.
    pub(super) fn sketch(&self) -> Sketch {
        let mut drawing = Drawing::new(self, 0);
        drawing.open.push((0, 0));
        drawing.sketch.nodes.push(Stroke::default());
        drawing.finish()
    }

    /// Subtrees: the binary nodes over them, and as how many children each is wanted. The sketch has as many
    /// heads in all, in the same order.
    pub(super) fn subtrees(&self, roots: &[(usize, usize)]) -> Sketch {
        let mut heads = Vec::new();
        for (root, slots) in roots {
            self.children(*root, *slots, &mut heads);
        }
        let mut drawing = Drawing::new(self, heads.len());
        for (place, heads) in heads.chunks(WIDTH).enumerate() {
            drawing.stroke(heads, place);
        }
        drawing.finish()
    }
}

/// A sketch in the making.
struct Drawing<'c> {
    collapse: &'c Collapse,
    sketch: Sketch,
    /// Binary nodes that are still to be drawn, and where.
    open: Vec<(usize, usize)>,
}

impl<'c> Drawing<'c> {
    fn new(collapse: &'c Collapse, heads: usize) -> Self {
        let sketch = Sketch {
            heads: heads as u32,
            nodes: vec![Stroke::default(); heads.div_ceil(WIDTH)],
            items: Vec::new(),
        };
        Self {
            collapse,
            sketch,
            open: Vec::new(),
        }
    }

    /// Draws what waits, and all below.
    fn finish(mut self) -> Sketch {
        let mut children = Vec::with_capacity(WIDTH);
        while let Some((node, place)) = self.open.pop() {
            children.clear();
            if self.collapse.choices[node].is_leaf() {
                children.push((node, 1));
            } else {
                self.collapse.children(node, WIDTH, &mut children);
            }
            self.stroke(&children, place);
        }
        self.sketch
    }

    /// Draws a node over these children, and has those that are nodes opened, the first one next.
    fn stroke(&mut self, children: &[(usize, usize)], place: usize) {
        let sketch = &mut self.sketch;
        let mut stroke = Stroke {
            first_node: sketch.nodes.len() as u32,
            first_item: sketch.items.len() as u32,
            ..Stroke::default()
        };
        let begin = self.open.len();
        let mut lane = 0;
        for (child, times) in children {
            let choice = self.collapse.choices[*child];
            for _ in 0..*times {
                stroke.children[lane] = if choice.is_leaf() {
                    let first = sketch.items.len();
                    self.collapse.items(*child, &mut sketch.items);
                    (sketch.items.len() - first) as u8
                } else {
                    self.open.push((*child, sketch.nodes.len()));
                    sketch.nodes.push(Stroke::default());
                    INNER
                };
                lane += 1;
            }
        }
        self.open[begin..].reverse();
        sketch.nodes[place] = stroke;
    }
}

impl Collapse {
    /// The items of a leaf.
    fn items(&self, leaf: usize, items: &mut Vec<u32>) {
        let (mut open, mut height) = ([leaf; BLOCK], 1);
        while height > 0 {
            height -= 1;
            let choice = self.choices[open[height]];
            if choice.is_item() {
                match choice.count() {
                    1 => items.push(choice.first),
                    count => items.extend(&self.runs[choice.first as usize..][..count]),
                }
                continue;
            }
            let child = choice.first as usize;
            (open[height], open[height + 1]) = (child, child + 1);
            height += 2;
        }
    }
}
