//! The wide tree: nodes of up to eight children over blocks of four triangles, collapsed from obvhs's
//! binary tree (Ylitie, Karras and Laine, *Efficient incoherent ray traversal on GPUs through compressed
//! wide BVHs*, 2017) and walked by kernels for AVX2 and AVX-512 with dozens of rays in flight.
//!
//! Items that are no triangles (spheres, instances) stand in the same tree as leaves of their own, and
//! are met by whoever asked for the walk.

mod assembly;
#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod batch;
mod binary;
mod build;
mod cache;
mod chunks;
mod collapse;
mod compiled;
mod crown;
mod directions;
mod huge_pages;
mod kernel;
mod later;
mod morton;
mod node;
mod packet;
mod portable;
mod sketch;
mod state;
mod valid;

use std::ops::Range;
use std::path::Path;

use glam::Vec3;
use rayon::prelude::*;

use super::{Build, CacheUse, Counts, Order};
use crate::interaction::Ray;
use crate::lanes::Kernel;
use crate::shape::{Bounds, Sphere};
use huge_pages::Huge;
use node::{Block, MovingBlock, MovingNode, Node};
use state::Flight;

pub(super) use state::{Best, Place, Start, Visit};

/// Who walks: where rays come from, who meets items that are no triangles, and where hits go.
pub(super) trait Walker<'t> {
    /// The ray with this index, and the best that is known of it.
    fn start(&self, ray: usize) -> Start;
    /// Whether the walk begins in the tree of an instance, for which [`Needs::later`] must be set.
    fn begins_inside(&self) -> bool;
    /// There, the same in the instance's space; `None` where the ray passes the instance by.
    fn start_inside(&mut self, ray: usize) -> Option<Start>;
    /// Asks for the memory ahead of an item that is no triangle, which will be met; of the tree of that instance, or of
    /// the one in which the walk began.
    fn fetch(&self, instance: u32, item: u32);
    /// Meets one of the items that are no triangles, of the tree that the ray is in.
    fn other(&mut self, visit: &Visit, item: u32) -> Met<'t>;
    /// The sphere that one of these items is, of the tree in which the walk began, and its number in the scene.
    fn sphere(&self, item: u32) -> Option<(&'t Sphere, u32)>;
    /// A primitive, of the world's tree or in an instance, is the best so far; with its u and v.
    fn found(&mut self, ray: usize, instance: u32, best: Best, uv: (f32, f32));
}

/// What a ray meets in an item that is no triangle.
#[derive(Debug)]
pub(super) enum Met<'t> {
    /// Nothing.
    Nothing,
    /// What is better than the best so far.
    Better(Best),
    /// Another tree, which is walked before the rest of this one; only from the tree in which the walk began.
    Instance(&'t Tree, Start),
}

/// The items that a tree is built over.
pub(super) trait Leaves: Sync {
    /// How many there are.
    fn count(&self) -> u32;
    /// An item's box, finite and not empty; a triangle's is around its corners.
    fn bounds(&self, item: u32) -> Bounds;
    /// Whether an item is a triangle.
    fn is_triangle(&self, item: u32) -> bool;
    /// A triangle's number in the scene, and its corners.
    fn triangle(&self, item: u32) -> (u32, [Vec3; 3]);
    /// The numbers in the scene that triangles have, ascending.
    fn numbers(&self) -> Vec<Range<u32>>;
    /// Feeds a hash with everything that a tree over the items is made from.
    fn digest(&self, hasher: &mut blake3::Hasher);
}

/// See the module.
#[derive(Debug)]
pub(super) struct Tree {
    /// The root comes first.
    nodes: Huge<Node>,
    blocks: Huge<Block>,
    /// Nodes on the longest way down.
    levels: usize,
    /// In place of nodes and blocks where everything moves.
    later: Option<Later>,
}

/// A tree that every ray meets at its own time.
#[derive(Debug)]
struct Later {
    nodes: Huge<MovingNode>,
    blocks: Huge<MovingBlock>,
}

/// What a batch may skip, since no tree asks for it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Needs {
    /// Levels of the deepest inner tree.
    pub(super) inner_levels: usize,
    /// Whether memory is asked for ahead.
    pub(super) fetch: bool,
    /// Whether any tree moves, or the walk begins in an instance's.
    pub(super) later: bool,
    /// Whether any tree has items that are no triangles.
    pub(super) others: bool,
}

impl Default for Tree {
    fn default() -> Self {
        Self {
            nodes: Huge::of(Node::EMPTY),
            blocks: Huge::zeroed(0),
            levels: 1,
            later: None,
        }
    }
}

impl Tree {
    /// A tree over these items; and those of them that are no triangles, in the order in which the walker is
    /// asked for them. In the folder `cache` it may lie ready, and is laid down otherwise.
    pub(super) fn build(
        leaves: &impl Leaves,
        work: Build,
        cache: Option<&Path>,
    ) -> (Self, Vec<u32>, CacheUse) {
        if leaves.count() == 0 {
            return Default::default();
        }
        let build = || {
            let bounds = |item| leaves.bounds(item);
            let boxes: Vec<Bounds> = (0..leaves.count()).into_par_iter().map(bounds).collect();
            let sketches = build::build(&boxes, leaves, work);
            drop(boxes); // before the nodes take memory
            sketches.tree(leaves)
        };
        let cache = cache.filter(|_| leaves.count() >= WORTH_KEEPING);
        let ((tree, others), used) = match cache {
            Some(folder) => cache::through(folder, leaves, work, build),
            None => (build(), CacheUse::default()),
        };
        (tree, others, used)
    }

    /// A box around all items, where they stand.
    pub(super) fn bounds(&self) -> Bounds {
        let [low, high] = [0, 1].map(|side| [0, 2, 4].map(|axis| self.nodes[0].slabs[axis + side]));
        Bounds {
            min: low
                .map(|low| low.into_iter().fold(f32::INFINITY, f32::min))
                .into(),
            max: high
                .map(|high| high.into_iter().fold(f32::NEG_INFINITY, f32::max))
                .into(),
        }
    }

    /// Whether all items are others than triangles.
    pub(super) fn holds_no_triangle(&self) -> bool {
        self.blocks.is_empty() && self.later.is_none()
    }

    /// How many nodes it has.
    pub(super) fn node_count(&self) -> usize {
        self.nodes.len()
    }

    /// Nodes on the longest way down.
    pub(super) fn levels(&self) -> usize {
        self.levels
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        let later = self.later.as_ref();
        let later = later.map(|l| size_of_val(&*l.nodes) + size_of_val(&*l.blocks));
        size_of_val(&*self.nodes) + size_of_val(&*self.blocks) + later.unwrap_or(0)
    }

    /// Walks `count` rays, all at once, through this tree and inner ones.
    pub(super) fn batch<'t, W: Walker<'t>, const ANY: bool>(
        &'t self,
        kernel: Kernel,
        needs: Needs,
        walker: &mut W,
        count: usize,
        counts: &mut Counts,
    ) {
        let levels = self.levels + 1 + needs.inner_levels;
        let flight = &mut Flight::new(count.min(batch::IN_FLIGHT), levels, needs.others);
        if needs.later {
            compiled::batch::<W, ANY, true, true>(kernel, self, walker, count, flight, counts);
        } else if needs.fetch {
            compiled::batch::<W, ANY, true, false>(kernel, self, walker, count, flight, counts);
        } else {
            compiled::batch::<W, ANY, false, false>(kernel, self, walker, count, flight, counts);
        }
    }
}

impl Tree {
    /// Walks `rays`, which the walker has too, in packets through this tree, in which no instances stand.
    pub(super) fn packets<'t, W: Walker<'t>, const ANY: bool>(
        &'t self,
        kernel: Kernel,
        walker: &mut W,
        (rays, order): (&[Ray], Order),
        counts: &mut Counts,
    ) {
        let tree = self;
        let sequence = match order {
            Order::Coherent => (0..rays.len() as u32).collect(),
            Order::Any => directions::sorted(rays),
        };
        kernel.run(packet::Packets::<W, ANY> {
            tree,
            walker,
            rays,
            sequence: &sequence,
            by_octant: order == Order::Any,
            counts,
        });
    }
}

/// Trees over fewer items are built as soon as they are found.
const WORTH_KEEPING: u32 = 10_000;

#[cfg(test)]
mod build_tests;
#[cfg(test)]
mod cache_tests;
#[cfg(test)]
mod tests;
