//! The tree of a group: obvhs's binary tree (PLOC, Meister and Bittner 2018, with reinsertion, Meister
//! and Bittner 2018) over leaves of equal boxes, walked front to back.
//!
//! obvhs 0.4 builds a chain, in quadratic time, over boxes that coincide; so boxes that are equal to the
//! bit share a leaf.

use std::ops::Range;

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use super::boxes::RayBoxes;
use crate::shape::Bounds;

/// A box with what it holds: two nodes, or items.
#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Bounds,
    /// The first of two child nodes, or the first item.
    first: u32,
    /// Items in a leaf; 0 in an inner node.
    count: u32,
}

/// A binary tree over a group's items; the root comes first.
#[derive(Debug, Default)]
pub(super) struct Tree {
    nodes: Vec<Node>,
}

impl Tree {
    /// The tree, and the order into which it puts the items.
    pub(super) fn build(boxes: &[Bounds]) -> (Self, Vec<u32>) {
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let key = |i: &u32| {
            let Bounds { min, max } = boxes[*i as usize];
            [min.x, min.y, min.z, max.x, max.y, max.z].map(f32::to_bits)
        };
        // Sorting also makes the tree independent of nothing but the boxes' order for equal ones.
        order.sort_by_cached_key(|i| (key(i), *i));
        let runs: Vec<&[u32]> = order.chunk_by(|a, b| key(a) == key(b)).collect();
        let aabbs: Vec<Aabb> = runs
            .iter()
            .map(|run| {
                let bounds = boxes[run[0] as usize];
                Aabb {
                    min: Vec3A::from(bounds.min),
                    max: Vec3A::from(bounds.max),
                }
            })
            .collect();
        if aabbs.is_empty() {
            return (Self::default(), order);
        }
        let mut bvh = PlocBuilder::with_capacity(aabbs.len()).build(
            PlocSearchDistance::Medium,
            &aabbs,
            (0..aabbs.len() as u32).collect(),
            SortPrecision::U64,
            0,
        );
        ReinsertionOptimizer::default().run(&mut bvh, 0.02, None);
        bvh.reorder_in_stack_traversal_order();
        Self::over_runs(&bvh, &runs)
    }

    /// Takes obvhs's nodes, whose leaves are runs of equal boxes.
    fn over_runs(bvh: &Bvh2, runs: &[&[u32]]) -> (Self, Vec<u32>) {
        let mut order = Vec::with_capacity(runs.iter().map(|r| r.len()).sum());
        let nodes = bvh.nodes.iter().map(|node| {
            let bounds = Bounds {
                min: node.aabb.min.into(),
                max: node.aabb.max.into(),
            };
            if node.prim_count == 0 {
                return Node {
                    bounds,
                    first: node.first_index,
                    count: 0,
                };
            }
            let (first, start) = (order.len() as u32, node.first_index as usize);
            for leaf in &bvh.primitive_indices[start..start + node.prim_count as usize] {
                order.extend_from_slice(runs[*leaf as usize]);
            }
            Node {
                bounds,
                first,
                count: order.len() as u32 - first,
            }
        });
        (
            Self {
                nodes: nodes.collect(),
            },
            order,
        )
    }

    /// Walks the leaves that the ray enters at or before `limit`, nearest first. `leaf` is given the
    /// nodes entered since the last call and a range of items, and may lower the limit; it ends the
    /// walk with true, and `walk` returns that.
    #[inline]
    pub(super) fn walk(
        &self,
        boxes: &RayBoxes,
        stack: &mut Vec<(f32, u32)>,
        mut limit: f32,
        mut leaf: impl FnMut(u64, Range<usize>, &mut f32) -> bool,
    ) -> bool {
        let Some(root) = self.nodes.first() else {
            return false;
        };
        let Some(entry) = boxes.entry(&root.bounds, limit) else {
            return false;
        };
        stack.push((entry, 0));
        let mut steps = 0;
        while let Some((entry, index)) = stack.pop() {
            if entry > limit {
                continue;
            }
            let mut node = &self.nodes[index as usize];
            steps += 1;
            while node.count == 0 {
                let first = node.first as usize;
                let (a, b) = (&self.nodes[first], &self.nodes[first + 1]);
                node = match (boxes.entry(&a.bounds, limit), boxes.entry(&b.bounds, limit)) {
                    (Some(ta), Some(tb)) if tb < ta => {
                        stack.push((ta, node.first));
                        b
                    }
                    (Some(_), Some(tb)) => {
                        stack.push((tb, node.first + 1));
                        a
                    }
                    (Some(_), None) => a,
                    (None, Some(_)) => b,
                    (None, None) => break,
                };
                steps += 1;
            }
            if node.count > 0 {
                let first = node.first as usize;
                if leaf(
                    std::mem::take(&mut steps),
                    first..first + node.count as usize,
                    &mut limit,
                ) {
                    return true;
                }
            }
        }
        leaf(steps, 0..0, &mut limit)
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        self.nodes.len() * size_of::<Node>()
    }
}
