//! Trees whose triangles move: a tree is made of them as they stand in the middle of their way, and then fitted to them
//! as they stand at its beginning and at its end. At a time between, planes and corners are between theirs. What is kept
//! is the beginning and the difference, side by side: a ray asks memory for one place instead of two.
//!
//! Between two numbers rounding may go either way, and what holds at both ends need not hold between them to the last
//! place. So planes have room for it: no box is ever left by what is in it.

use rayon::prelude::*;

use glam::Vec3;

use super::huge_pages::Huge;
use super::node::{
    BLOCK, BLOCK_INDEX, Corners, DONE, LEAF, MovingBlock, MovingNode, Node, Slabs, WIDTH,
};
use super::{Later, Tree};

/// The part of coordinates by which rounding may move a plane or a corner, with room.
const ROUNDING: f32 = 8.0 * f32::EPSILON;
/// Blocks that are filled by one task.
const GRAIN: usize = 1 << 10;

/// Smallest and largest coordinates, at both ends.
type Boxes = [[Vec3; 2]; 2];

const EMPTY: Boxes = [[Vec3::INFINITY, Vec3::NEG_INFINITY]; 2];

fn union(a: Boxes, b: Boxes) -> Boxes {
    [0, 1].map(|end| [a[end][0].min(b[end][0]), a[end][1].max(b[end][1])])
}

/// Boxes with room for rounding.
fn widened(boxes: Boxes) -> Boxes {
    let corners = boxes.as_flattened().iter();
    let room = ROUNDING * corners.fold(Vec3::ZERO, |far, corner| far.max(corner.abs()));
    boxes.map(|[low, high]| [low - room, high + room])
}

impl Tree {
    /// The tree, of triangles alone, fitted to the `ends` of the way of each, given by number.
    pub(in crate::accel) fn fitted(self, ends: &(impl Fn(u32) -> [[Vec3; 3]; 2] + Sync)) -> Self {
        let mut later = Later {
            nodes: Huge::zeroed(self.nodes.len()),
            blocks: Huge::zeroed(self.blocks.len()),
        };
        let mut of_blocks = vec![EMPTY; self.blocks.len()];
        let blocks = self.blocks.par_iter().zip(later.blocks.par_iter_mut());
        let blocks = blocks.zip(&mut of_blocks).with_min_len(GRAIN);
        blocks.for_each(|((standing, moving), boxes)| {
            let mut first = *standing;
            let mut way = Corners([[[0.0; BLOCK]; 3]; 3]);
            for (lane, id) in (0..BLOCK).zip(first.ids).filter(|(_, id)| *id != u32::MAX) {
                let [from, to] = ends(id);
                for (corner, (from, to)) in from.into_iter().zip(to).enumerate() {
                    *boxes = union(*boxes, [[from; 2], [to; 2]]);
                    let gone = to - from;
                    for axis in 0..3 {
                        first.corners[axis][corner][lane] = from[axis];
                        way.0[axis][corner][lane] = gone[axis];
                    }
                }
            }
            *moving = MovingBlock::new(first, way);
        });
        let mut of_nodes = vec![EMPTY; self.nodes.len()];
        // Children come behind their parents.
        for index in (0..self.nodes.len()).rev() {
            let Node {
                children, order, ..
            } = self.nodes[index];
            let mut first = Node {
                children,
                order,
                ..Node::EMPTY
            };
            let mut way = Slabs([[0.0; WIDTH]; 6]);
            for (lane, child) in children.into_iter().enumerate() {
                let boxes = match child {
                    DONE => continue,
                    LEAF.. => of_blocks[(child & BLOCK_INDEX) as usize],
                    _ => of_nodes[child as usize],
                };
                let boxes = widened(boxes);
                of_nodes[index] = union(of_nodes[index], boxes);
                let [from, to] = boxes;
                for axis in 0..3 {
                    for side in 0..2 {
                        let plane = 2 * axis + side;
                        first.slabs[plane][lane] = from[side][axis];
                        way.0[plane][lane] = to[side][axis] - from[side][axis];
                    }
                }
            }
            later.nodes[index] = MovingNode { first, way };
        }
        Self {
            levels: self.levels,
            later: Some(later),
            ..Self::default()
        }
    }
}
