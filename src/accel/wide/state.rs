//! A ray on its way through a wide tree, prepared as the kernels want it, and the memory in which dozens
//! of rays have their stacks.

use super::node::{DONE, WIDTH};
use crate::accel::boxes::RayBoxes;
use crate::accel::triangle::Shear;
use crate::interaction::Ray;

/// What a walk begins with.
#[derive(Clone, Copy, Debug)]
pub(in crate::accel) struct Start {
    /// In the tree's space.
    pub(in crate::accel) ray: Ray,
    /// Where the ray enters the instance that the tree stands in; 0 in the world.
    pub(in crate::accel) entry: f32,
    /// What is known already.
    pub(in crate::accel) best: Best,
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
    /// Whether it is a triangle of the tree that was walked.
    #[inline(always)]
    pub(in crate::accel) fn is_inside(&self) -> bool {
        !matches!(self.place, Place::NOWHERE | Place::OUTSIDE)
    }
}

/// Where the best hit is written down: nowhere, with whoever started the walk, or a triangle's block and
/// lane in the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::accel) struct Place(pub(super) u32);

impl Place {
    /// There is no hit yet.
    pub(in crate::accel) const NOWHERE: Self = Self(u32::MAX);
    /// The walk was told of the hit, and does not keep it.
    pub(in crate::accel) const OUTSIDE: Self = Self(u32::MAX - 1);
}

/// A ray on its way.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct State {
    pub(super) origin: [f32; 3],
    /// The distance beyond which nothing counts.
    pub(super) limit: f32,
    pub(super) inverse: [f32; 3],
    pub(super) entry: f32,
    /// Where in a node the planes are that the ray meets first, in bytes, axis by axis.
    pub(super) near: [u32; 3],
    /// Three times the octant of the direction.
    pub(super) octant: u32,
    /// What to visit.
    pub(super) current: u32,
    /// The first free place on the stack.
    pub(super) top: u32,
    pub(super) place: u32,
    pub(super) id: u32,
    /// The origin along the shear's axes.
    pub(super) sheared_origin: [f32; 3],
    pub(super) shear: [f32; 2],
    /// Where in a block the axes of the shear are, in bytes.
    pub(super) axes: [u32; 3],
    pub(super) direction: [f32; 3],
    /// The ray's place in its batch.
    pub(super) ray: u32,
    /// Lanes of the block under way whose triangles the ray goes through.
    pub(super) lanes: u32,
}

/// A node's slabs of one axis, and a block's corners of one axis, in bytes.
const NODE_AXIS: u32 = 64;
const BLOCK_AXIS: u32 = 48;

impl State {
    pub(super) const IDLE: Self = Self {
        origin: [0.0; 3],
        limit: f32::NEG_INFINITY,
        inverse: [1.0; 3],
        entry: 0.0,
        near: [0, NODE_AXIS, 2 * NODE_AXIS],
        octant: 0,
        current: DONE,
        top: 0,
        place: 0,
        id: 0,
        sheared_origin: [0.0; 3],
        shear: [0.0; 2],
        axes: [0, BLOCK_AXIS, 2 * BLOCK_AXIS],
        direction: [0.0; 3],
        ray: 0,
        lanes: 0,
    };

    /// Puts a ray at the root; `bottom` is its stack's.
    #[inline(always)]
    pub(super) fn begin(&mut self, ray: u32, start: &Start, bottom: u32) {
        let (boxes, shear) = (RayBoxes::new(&start.ray), Shear::new(&start.ray));
        let origin = start.ray.origin.to_array();
        // A ray that is not finite meets nothing, and its comparisons would go any way.
        let sound = start.ray.origin.is_finite() && start.ray.direction.is_finite();
        // Field by field: a whole state would be made elsewhere and copied, which took most of the time.
        self.origin = origin;
        self.limit = if sound {
            start.best.t
        } else {
            f32::NEG_INFINITY
        };
        self.inverse = boxes.inverse.to_array();
        self.entry = start.entry;
        self.octant = 0;
        for axis in 0..3 {
            let backward = u32::from(self.inverse[axis] < 0.0);
            self.near[axis] = (2 * axis as u32 + backward) * (NODE_AXIS / 2);
            self.octant += (3 * backward) << axis;
            self.sheared_origin[axis] = origin[shear.axes[axis]];
            self.axes[axis] = shear.axes[axis] as u32 * BLOCK_AXIS;
        }
        self.shear = shear.shear;
        self.direction = start.ray.direction.to_array();
        self.current = 0;
        self.top = bottom + SENTINELS as u32;
        self.place = start.best.place.0;
        self.id = start.best.id;
        self.ray = ray;
    }

    #[inline(always)]
    pub(super) fn best(&self) -> Best {
        Best {
            t: self.limit,
            id: self.id,
            place: Place(self.place),
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
            origin: self.origin.into(),
            inverse: self.inverse.into(),
        }
    }
}

/// Entries at a stack's bottom that say [`DONE`], at distance −∞: a kernel looks at eight at once.
const SENTINELS: usize = WIDTH;

/// Room for rays on their way.
#[derive(Debug, Default)]
pub(in crate::accel) struct Flight {
    pub(super) states: Vec<State>,
    /// Stacks one after another: at what distance what is to be visited is entered,
    pub(super) distances: Vec<f32>,
    /// and what it is.
    pub(super) references: Vec<u32>,
    stride: usize,
    levels: usize,
}

impl Flight {
    /// Room for `rays` in trees of at most so many levels.
    pub(in crate::accel) fn new(rays: usize, levels: usize) -> Self {
        // Each level leaves up to seven children on the stack; the eighth is on its way down. A kernel
        // writes eight at once. An odd multiple of a cache line keeps stacks off each other's lines.
        let stride = (SENTINELS + (WIDTH - 1) * levels + 2 * WIDTH).div_ceil(16);
        let stride = (stride | 1) * 16;
        Self {
            states: vec![State::IDLE; rays],
            distances: vec![f32::NEG_INFINITY; rays * stride],
            references: vec![DONE; rays * stride],
            stride,
            levels,
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
