//! Trees whose triangles move: a tree is made of them as they stand in the middle of their way, and then fitted to them
//! as they stand at its beginning and at its end. At a time between, planes and corners are between theirs.
//!
//! Between two numbers rounding may go either way, and what holds at both ends need not hold between them to the last
//! place. So planes have room for it: no box is ever left by what is in it.

use rayon::prelude::*;

use glam::Vec3;

use super::huge_pages::Huge;
use super::node::{BLOCK_INDEX, Block, Corners, DONE, LEAF, Node, Slabs, WIDTH};
use super::{Later, Tree};

/// The part of coordinates by which rounding may move a plane or a corner, with room.
const ROUNDING: f32 = 8.0 * f32::EPSILON;
/// Where the planes are of a lane that holds nothing: far away, and finite for all that is computed with them.
const NOWHERE: [f32; 2] = [f32::MAX / 8.0, f32::MIN / 8.0];
/// Blocks that are filled by one task.
const GRAIN: usize = 1 << 10;

/// Smallest and largest coordinates, at both ends.
type Boxes = [[Vec3; 2]; 2];

const EMPTY: Boxes = [[Vec3::INFINITY, Vec3::NEG_INFINITY]; 2];

fn union(a: Boxes, b: Boxes) -> Boxes {
    [0, 1].map(|end| [a[end][0].min(b[end][0]), a[end][1].max(b[end][1])])
}

impl Tree {
    /// The tree, of triangles alone, fitted to the `ends` of the way of each, given by number.
    pub(in crate::accel) fn fitted(
        mut self,
        ends: &(impl Fn(u32) -> [[Vec3; 3]; 2] + Sync),
    ) -> Self {
        let mut later = Later {
            nodes: Huge::zeroed(self.nodes.len()),
            blocks: Huge::zeroed(self.blocks.len()),
        };
        let blocks = self.blocks.par_iter_mut().zip(later.blocks.par_iter_mut());
        blocks.with_min_len(GRAIN).for_each(|(block, later)| {
            later.0 = block.corners;
            let ids = block.ids;
            for (lane, id) in ids
                .into_iter()
                .enumerate()
                .filter(|(_, id)| *id != u32::MAX)
            {
                let [first, last] = ends(id);
                for axis in 0..3 {
                    for corner in 0..3 {
                        block.corners[axis][corner][lane] = first[corner][axis];
                        later.0[axis][corner][lane] = last[corner][axis];
                    }
                }
            }
        });
        // Children come behind their parents.
        for index in (0..self.nodes.len()).rev() {
            let children = self.nodes[index].children;
            let boxes = children.map(|child| match child {
                DONE => EMPTY,
                LEAF.. => {
                    let block = (child & BLOCK_INDEX) as usize;
                    around(&self.blocks[block], &later.blocks[block])
                }
                _ => {
                    let child = child as usize;
                    around_all(&self.nodes[child], &later.nodes[child])
                }
            });
            let (node, later) = (&mut self.nodes[index], &mut later.nodes[index]);
            for (lane, boxes) in boxes.iter().enumerate() {
                for axis in 0..3 {
                    let all = boxes.as_flattened();
                    let farthest = all.iter().map(|corner| corner[axis].abs());
                    let room = ROUNDING * farthest.fold(0.0, f32::max);
                    let planes = |end: usize| match children[lane] {
                        DONE => NOWHERE,
                        _ => [boxes[end][0][axis] - room, boxes[end][1][axis] + room],
                    };
                    [node.slabs[2 * axis][lane], node.slabs[2 * axis + 1][lane]] = planes(0);
                    [later.0[2 * axis][lane], later.0[2 * axis + 1][lane]] = planes(1);
                }
            }
        }
        self.later = Some(later);
        self
    }
}

/// Boxes around the triangles of a block.
fn around(block: &Block, later: &Corners) -> Boxes {
    let mut boxes = EMPTY;
    for (lane, _) in block
        .ids
        .iter()
        .enumerate()
        .filter(|(_, id)| **id != u32::MAX)
    {
        for (boxes, corners) in boxes.iter_mut().zip([&block.corners, &later.0]) {
            let corner = |c: usize| {
                Vec3::new(
                    corners[0][c][lane],
                    corners[1][c][lane],
                    corners[2][c][lane],
                )
            };
            for corner in [0, 1, 2].map(corner) {
                *boxes = [boxes[0].min(corner), boxes[1].max(corner)];
            }
        }
    }
    boxes
}

/// Boxes around the children of a node.
fn around_all(node: &Node, later: &Slabs) -> Boxes {
    let lanes = (0..WIDTH).filter(|lane| node.children[*lane] != DONE);
    let of = |lane: usize| {
        [&node.slabs, &later.0].map(|slabs| {
            [0, 1].map(|side| {
                Vec3::new(
                    slabs[side][lane],
                    slabs[2 + side][lane],
                    slabs[4 + side][lane],
                )
            })
        })
    };
    lanes.map(of).fold(EMPTY, union)
}
