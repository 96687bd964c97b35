//! A ray on its way through a wide tree, prepared as the kernels want it, and the memory in which dozens
//! of rays have their stacks.

use std::hint::select_unpredictable;
use std::ptr::null;

use glam::Vec3;

use super::Tree;
use super::node::{BOTTOM, Block, DONE, Entry, MovingBlock, MovingNode, Node, WIDTH, entry};
use crate::accel::boxes::RayBoxes;
use crate::accel::triangle::Shear;
use crate::interaction::{Hit, Ray};

/// What a walk begins with.
#[derive(Clone, Copy, Debug)]
pub(in crate::accel) struct Start {
    /// In the tree's space.
    pub(in crate::accel) ray: Ray,
    /// The instance that the tree stands in, or [`Hit::NONE`].
    pub(in crate::accel) instance: u32,
    /// Where the ray enters it; 0 in the world.
    pub(in crate::accel) entry: f32,
    /// How far a tree that deforms has come on its way, in [0, 1].
    pub(in crate::accel) part: f32,
    /// What is known already.
    pub(in crate::accel) best: Best,
}

/// A ray that has come to an item that is no triangle.
#[derive(Clone, Copy, Debug)]
pub(in crate::accel) struct Visit {
    /// Its place in its batch.
    pub(in crate::accel) ray: usize,
    /// The instance that it is in, or [`Hit::NONE`].
    pub(in crate::accel) instance: u32,
    /// Where it entered that.
    pub(in crate::accel) entry: f32,
    /// Where it enters the item's box.
    pub(in crate::accel) reached: f32,
    pub(in crate::accel) best: Best,
    /// In the space of the tree that the ray is in.
    pub(in crate::accel) boxes: RayBoxes,
    /// Likewise.
    pub(in crate::accel) shear: Shear,
}

/// The best hit so far.
#[derive(Clone, Copy, Debug)]
pub(in crate::accel) struct Best {
    /// Its distance, or the ray's end.
    pub(in crate::accel) t: f32,
    /// Triangles with a smaller number win at an equal distance.
    pub(in crate::accel) id: u32,
    pub(in crate::accel) place: Place,
}

impl Best {
    /// Whether it is a primitive of the tree that was walked.
    #[inline(always)]
    pub(in crate::accel) fn is_inside(&self) -> bool {
        !matches!(self.place, Place::NOWHERE | Place::OUTSIDE)
    }
}

/// Where the best hit is written down: nowhere, with whoever started the walk, or in the tree, as a triangle's block and
/// lane or an item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::accel) struct Place(pub(super) u32);

impl Place {
    /// There is no hit yet.
    pub(in crate::accel) const NOWHERE: Self = Self(u32::MAX);
    /// An item that is no triangle, and has the number of the best.
    pub(in crate::accel) const ITEM: Self = Self(u32::MAX - 2);
    /// The walk was told of the hit, and does not keep it.
    pub(in crate::accel) const OUTSIDE: Self = Self(u32::MAX - 1);
}

/// A ray on its way. The first cache line is what a node needs, the second what a block needs.
///
/// `nodes` and `blocks`, and those that move, are those of the tree that the ray is in, and live as long as the walk.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct State {
    /// As in [`RayBoxes`].
    pub(super) inverse: [f32; 3],
    pub(super) entering: [f32; 3],
    pub(super) leaving: [f32; 3],
    /// Where in a node the planes are that the ray meets first, in bytes, axis by axis.
    pub(super) near: [u8; 3],
    /// The octant of the direction, a bit an axis.
    pub(super) octant: u8,
    /// The greatest entry that is within reach: the distance beyond which nothing counts, and ones.
    pub(super) bound: Entry,
    pub(super) nodes: *const Node,
    /// What to visit.
    pub(super) current: u32,
    /// The first free place on the stack.
    pub(super) top: u32,
    pub(super) blocks: *const Block,
    pub(super) place: u32,
    pub(super) id: u32,
    pub(super) origin: [f32; 3],
    pub(super) direction: [f32; 3],
    /// The origin along the shear's axes.
    pub(super) sheared_origin: [f32; 3],
    pub(super) shear: [f32; 2],
    /// Where in a block the axes of the shear are, in bytes.
    pub(super) axes: [u8; 3],
    /// Lanes of the block under way whose triangles the ray goes through.
    pub(super) lanes: u8,
    pub(super) entry: f32,
    pub(super) instance: u32,
    /// The ray's place in its batch.
    pub(super) ray: u32,
    /// As in [`Start`].
    pub(super) part: f32,
    /// In place of `nodes` where they move; null where they stand.
    pub(super) moving_nodes: *const MovingNode,
    /// In place of `blocks` where they move.
    pub(super) moving_blocks: *const MovingBlock,
}

/// A node's slabs of one axis, and a block's corners of one axis, in bytes.
const NODE_AXIS: u8 = 64;
pub(super) const BLOCK_AXIS: u8 = 48;

/// [`State::near`] by octant.
pub(super) const NEAR: [[u8; 3]; 8] = {
    let mut near = [[0; 3]; 8];
    let mut i = 0;
    while i < 24 {
        let (octant, axis) = (i / 3, i % 3);
        near[octant][axis] = NODE_AXIS * axis as u8 + NODE_AXIS / 2 * (octant >> axis & 1) as u8;
        i += 1;
    }
    near
};

impl State {
    pub(super) const IDLE: Self = Self {
        inverse: [1.0; 3],
        entering: [0.0; 3],
        leaving: [0.0; 3],
        near: [0, NODE_AXIS, 2 * NODE_AXIS],
        octant: 0,
        bound: BOTTOM,
        nodes: null(),
        current: DONE,
        top: 0,
        blocks: null(),
        place: 0,
        id: 0,
        origin: [0.0; 3],
        direction: [0.0; 3],
        sheared_origin: [0.0; 3],
        shear: [0.0; 2],
        axes: [0, BLOCK_AXIS, 2 * BLOCK_AXIS],
        lanes: 0,
        entry: 0.0,
        instance: Hit::NONE,
        ray: 0,
        part: 0.0,
        moving_nodes: null(),
        moving_blocks: null(),
    };

    /// Begins with a ray; `bottom` is its stack's. What remains is to enter a tree.
    #[inline(always)]
    pub(super) fn begin(&mut self, ray: u32, bottom: u32) {
        self.top = bottom + SENTINELS as u32;
        self.ray = ray;
    }

    /// Puts the ray at the root of a tree; its stack stays. What remains is to aim.
    #[inline(always)]
    pub(super) fn enter(&mut self, tree: &Tree, start: &Start) {
        // Field by field: a whole state would be made elsewhere and copied, which took most of the time.
        self.reach(start.best.t);
        self.nodes = tree.nodes.as_ptr();
        self.blocks = tree.blocks.as_ptr();
        self.current = 0;
        self.place = start.best.place.0;
        self.id = start.best.id;
        self.entry = start.entry;
        self.instance = start.instance;
    }

    /// The same with what moves, which batches without trees that move never look at.
    #[inline(always)]
    pub(super) fn follow(&mut self, tree: &Tree, start: &Start) {
        self.part = start.part;
        (self.moving_nodes, self.moving_blocks) = match &tree.later {
            Some(later) => (later.nodes.as_ptr(), later.blocks.as_ptr()),
            None => (null(), null()),
        };
    }

    /// Whether the tree that the ray is in moves.
    #[inline(always)]
    pub(super) fn is_moving(&self) -> bool {
        !self.moving_nodes.is_null()
    }

    /// Keeps a ray that is not finite from meeting anything: its comparisons would go any way.
    #[inline(always)]
    pub(super) fn end_unless(&mut self, finite: bool) {
        self.reach(select_unpredictable(
            finite,
            self.limit(),
            f32::NEG_INFINITY,
        ));
    }

    /// Prepares what follows from the ray's origin and direction.
    #[inline(always)]
    pub(super) fn aim(&mut self, ray: &Ray) {
        let (boxes, shear) = (RayBoxes::new(ray), Shear::new(ray));
        let origin = ray.origin.to_array();
        self.inverse = boxes.inverse.to_array();
        self.entering = boxes.entering.to_array();
        self.leaving = boxes.leaving.to_array();
        let backward = boxes.inverse.cmplt(Vec3::ZERO).bitmask();
        self.octant = backward as u8;
        self.near = NEAR[backward as usize];
        for axis in 0..3 {
            self.sheared_origin[axis] = origin[shear.axes[axis]];
            self.axes[axis] = shear.axes[axis] as u8 * BLOCK_AXIS;
        }
        self.origin = origin;
        self.direction = ray.direction.to_array();
        self.shear = shear.shear;
        self.end_unless(ray.origin.is_finite() && ray.direction.is_finite());
    }

    /// The distance beyond which nothing counts.
    #[inline(always)]
    pub(super) fn limit(&self) -> f32 {
        f32::from_bits((self.bound >> 32) as u32)
    }

    /// Sets that distance.
    #[inline(always)]
    pub(super) fn reach(&mut self, limit: f32) {
        self.bound = entry(limit, u32::MAX);
    }

    #[inline(always)]
    pub(super) fn best(&self) -> Best {
        Best {
            t: self.limit(),
            id: self.id,
            place: Place(self.place),
        }
    }

    /// What a walker is told.
    #[inline(always)]
    pub(super) fn visit(&self, reached: f32) -> Visit {
        Visit {
            ray: self.ray as usize,
            instance: self.instance,
            entry: self.entry,
            reached,
            best: self.best(),
            boxes: self.boxes(),
            shear: self.shear(),
        }
    }

    /// The ray as [`Shear`] has it.
    #[inline(always)]
    pub(super) fn shear(&self) -> Shear {
        Shear {
            origin: self.origin.into(),
            direction: self.direction.into(),
            axes: self.axes.map(|a| (a / BLOCK_AXIS) as usize),
            shear: self.shear,
        }
    }

    /// The ray as [`RayBoxes`] has it.
    #[inline(always)]
    pub(super) fn boxes(&self) -> RayBoxes {
        RayBoxes {
            inverse: self.inverse.into(),
            entering: self.entering.into(),
            leaving: self.leaving.into(),
        }
    }
}

/// Entries [`BOTTOM`] of a stack: a kernel looks at eight at once.
const SENTINELS: usize = WIDTH;

/// Room for rays on their way.
#[derive(Debug, Default)]
pub(in crate::accel) struct Flight {
    pub(super) states: Vec<State>,
    /// One after another.
    pub(super) stacks: Vec<Entry>,
    stride: usize,
    levels: usize,
    /// Whether rays may come to items that are no triangles.
    pub(super) others: bool,
}

impl Flight {
    /// Room for `rays` in trees of at most so many levels.
    pub(in crate::accel) fn new(rays: usize, levels: usize, others: bool) -> Self {
        // Each level leaves up to seven children on the stack; the eighth is on its way down. A kernel
        // writes eight at once. An odd multiple of a cache line keeps stacks off each other's lines.
        let stride = (SENTINELS + (WIDTH - 1) * levels + 2 * WIDTH).div_ceil(8);
        let stride = (stride | 1) * 8;
        Self {
            states: vec![State::IDLE; rays],
            stacks: vec![BOTTOM; rays * stride],
            stride,
            levels,
            others,
        }
    }

    /// The levels of the deepest tree that it is made for.
    pub(super) fn levels(&self) -> usize {
        self.levels
    }

    /// Where a slot's stack begins.
    pub(super) fn bottom(&self, slot: usize) -> u32 {
        (slot * self.stride) as u32
    }
}
