//! The wide tree: nodes of up to eight children over blocks of four triangles, collapsed from obvhs's
//! binary tree (Ylitie, Karras and Laine, *Efficient incoherent ray traversal on GPUs through compressed
//! wide BVHs*, 2017) and walked by kernels for AVX2 and AVX-512 with dozens of rays in flight.
//!
//! Items that are no triangles (spheres, instances) stand in the same tree as leaves of their own, and
//! are met by whoever asked for the walk.

#[cfg(target_arch = "x86_64")]
mod avx;
mod batch;
mod build;
mod collapse;
mod compiled;
mod kernel;
mod node;
mod portable;
mod state;

use glam::Vec3;
use rayon::prelude::*;

use super::triangle::Shear;
use super::{Build, Counts};
use crate::shape::Bounds;
use node::{BLOCK, Block, Node};
use state::State;

pub use kernel::Kernel;
pub(super) use state::{Best, Flight, Place, Start};

/// Who walks: where rays come from, who meets items that are no triangles, and where hits go.
pub(super) trait Walker {
    /// The ray with this index.
    fn start(&self, ray: usize) -> Start;
    /// Meets one of the items that are no triangles; what is better than the best so far.
    fn other(&mut self, ray: usize, item: u32, best: Best) -> Option<Best>;
    /// The ray has been walked; with u and v where the best hit is a triangle of this tree.
    fn end(&mut self, ray: usize, best: Best, uv: (f32, f32));
}

/// The items that a tree is built over.
pub(super) trait Leaves: Sync {
    /// How many there are.
    fn count(&self) -> u32;
    /// An item's box, finite and not empty.
    fn bounds(&self, item: u32) -> Bounds;
    /// Whether an item is a triangle.
    fn is_triangle(&self, item: u32) -> bool;
    /// A triangle's number in the scene, and its corners.
    fn triangle(&self, item: u32) -> (u32, [Vec3; 3]);
}

/// See the module.
#[derive(Debug)]
pub(super) struct Tree {
    /// The root comes first.
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    /// Nodes on the longest way down.
    levels: usize,
}

impl Default for Tree {
    fn default() -> Self {
        Self {
            nodes: vec![Node::EMPTY],
            blocks: Vec::new(),
            levels: 1,
        }
    }
}

impl Tree {
    /// A tree over these items; and those of them that are no triangles, in the order in which the walker is
    /// asked for them.
    pub(super) fn build(leaves: &impl Leaves, work: Build) -> (Self, Vec<u32>) {
        let boxes: Vec<Bounds> = (0..leaves.count())
            .into_par_iter()
            .map(|item| leaves.bounds(item))
            .collect();
        let binary = build::binary(&boxes, work);
        drop(boxes);
        match binary {
            Some(binary) => collapse::collapse(&binary, leaves),
            None => Default::default(),
        }
    }

    /// Nodes on the longest way down.
    pub(super) fn levels(&self) -> usize {
        self.levels
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.nodes) + size_of_val(&*self.blocks)
    }

    /// Room for walks of many rays through this tree.
    pub(super) fn flight(&self, rays: usize) -> Flight {
        Flight::new(rays.min(batch::IN_FLIGHT), self.levels)
    }

    /// Walks `count` rays, all at once.
    pub(super) fn batch<W: Walker, const ANY: bool>(
        &self,
        kernel: Kernel,
        walker: &mut W,
        count: usize,
        counts: &mut Counts,
    ) {
        let flight = &mut self.flight(count);
        // Fetching ahead costs a tenth where the tree is in the cache anyway.
        if self.bytes() > CACHED {
            compiled::batch::<W, ANY, true>(kernel, self, walker, count, flight, counts);
        } else {
            compiled::batch::<W, ANY, false>(kernel, self, walker, count, flight, counts);
        }
    }

    /// Walks one ray, the walker's first. The flight was made for at least as many levels.
    pub(super) fn single<W: Walker, const ANY: bool>(
        &self,
        kernel: Kernel,
        walker: &mut W,
        flight: &mut Flight,
        counts: &mut Counts,
    ) {
        compiled::single::<W, ANY>(kernel, self, walker, flight, counts);
    }

    /// Hands a ray that has been walked back to the walker.
    #[inline(always)]
    fn end<W: Walker, const ANY: bool>(&self, walker: &mut W, ray: &State) {
        let best = ray.best();
        let mut uv = (0.0, 0.0);
        if !ANY && best.is_inside() {
            let block = &self.blocks[ray.place as usize / BLOCK];
            let corners = block.triangle(ray.place as usize % BLOCK);
            uv = Shear::barycentric(ray.shear().edges(corners));
        }
        walker.end(ray.ray as usize, best, uv);
    }
}

/// Trees up to this size are in the caches nearest to a core, as far as counts.
const CACHED: usize = 16 << 20;

#[cfg(test)]
mod tests;
