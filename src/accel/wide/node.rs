//! What the wide tree is made of: nodes with up to eight children, and blocks of up to four triangles.
//! Both are plain arrays, one lane a child or a triangle, as the kernels load them.
//!
//! A child is named by 32 bits: a node's index; or bit 31, the number of triangles less one (2 bits from
//! bit 28) and a block's index; or bits 31 and 30 and the index of an item that is no triangle.

use glam::Vec3;

use crate::shape::Bounds;

/// Children of a node.
pub(super) const WIDTH: usize = 8;
/// Triangles of a block.
pub(super) const BLOCK: usize = 4;

/// What stands on a ray's stack: what is to be visited, below the distance at which it is entered. As whole
/// numbers with a sign, entries are in the order of their distances, but for negative ones, which are before all others.
pub(super) type Entry = u64;

/// An entry.
#[inline(always)]
pub(super) fn entry(distance: f32, reference: u32) -> Entry {
    u64::from(distance.to_bits()) << 32 | u64::from(reference)
}

/// At the bottom of a stack: always within reach.
pub(super) const BOTTOM: Entry = (f32::NEG_INFINITY.to_bits() as u64) << 32 | DONE as u64;
/// Below what an instance leaves on the stack.
pub(super) const EXIT: Entry = (f32::NEG_INFINITY.to_bits() as u64) << 32 | LEAVE as u64;

/// Names a block rather than a node.
pub(super) const LEAF: u32 = 1 << 31;
/// With [`LEAF`]: names an item that is no triangle.
pub(super) const OTHER: u32 = LEAF | 1 << 30;
/// Nothing is left to be visited in the instance that the ray is in.
pub(super) const LEAVE: u32 = DONE - 1;
/// Nothing is left to be visited.
pub(super) const DONE: u32 = u32::MAX;
const COUNT_SHIFT: u32 = 28;
/// The index of a block in its name.
pub(super) const BLOCK_INDEX: u32 = (1 << COUNT_SHIFT) - 1;
/// The index of an item that is no triangle in its name.
pub(super) const OTHER_INDEX: u32 = !OTHER;

/// How many triangles a named block holds.
#[inline(always)]
pub(super) fn triangles_of(name: u32) -> u32 {
    (name >> COUNT_SHIFT & 3) + 1
}

/// A node: its children's boxes and names.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// Smallest x, largest x, smallest y, and so on. A lane without a child has its smallest above its
    /// largest, at the infinities.
    pub(super) slabs: [[f32; WIDTH]; 6],
    pub(super) children: [u32; WIDTH],
    /// In which order to look at the lanes, farthest first, for each octant of directions: three bits a lane.
    pub(super) order: [u32; WIDTH],
}

impl Node {
    pub(super) const EMPTY: Self = {
        let (low, high) = ([f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]);
        Self {
            slabs: [low, high, low, high, low, high],
            children: [DONE; WIDTH],
            order: [0; WIDTH],
        }
    };

    /// The node with its planes a part of their way along, in [0, 1].
    #[inline(always)]
    pub(super) fn along(&self, way: &Slabs, part: f32) -> Self {
        let mut node = *self;
        for (plane, way) in node.slabs.iter_mut().zip(&way.0) {
            for (plane, way) in plane.iter_mut().zip(way) {
                *plane = way.mul_add(part, *plane);
            }
        }
        node
    }

    /// A node over children that are given by their boxes; they are named later.
    pub(super) fn new(boxes: &[Bounds]) -> Self {
        let mut node = Self::EMPTY;
        for (lane, Bounds { min, max }) in boxes.iter().enumerate() {
            for axis in 0..3 {
                node.slabs[2 * axis][lane] = min[axis];
                node.slabs[2 * axis + 1][lane] = max[axis];
            }
        }
        for octant in 0..8 {
            let sign = |bit: usize| if octant >> bit & 1 == 1 { -1.0 } else { 1.0 };
            let toward = Vec3::new(sign(0), sign(1), sign(2));
            // The scale by 1/4 keeps sums finite.
            let depth = |lane: usize| match boxes.get(lane) {
                Some(Bounds { min, max }) => toward.dot(0.25 * *min + 0.25 * *max),
                None => f32::INFINITY,
            };
            let depths: [f32; WIDTH] = std::array::from_fn(depth);
            for lane in 0..WIDTH {
                // Counted rather than sorted: eight at once, and without a branch.
                let place: usize = (0..WIDTH)
                    .map(|other| {
                        let is_farther = depths[other] > depths[lane];
                        let is_before = (depths[other] == depths[lane]) & (other < lane);
                        usize::from(is_farther | is_before)
                    })
                    .sum();
                node.order[octant] |= (lane as u32) << (3 * place);
            }
        }
        node
    }
}

/// How far the planes of a node go: as [`Node::slabs`]; 0 in a lane without a child.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Slabs(pub(super) [[f32; WIDTH]; 6]);

/// How far the corners of a block go: as [`Block::corners`]; 0 where there is no triangle.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub(super) struct Corners(pub(super) [[[f32; BLOCK]; 3]; 3]);

/// A node as it stands at first, and how far its planes go: one behind the other, as a ray needs both.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(super) struct MovingNode {
    pub(super) first: Node,
    pub(super) way: Slabs,
}

/// A block as it stands at first, and how far its corners go. It fills whole cache lines.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct MovingBlock {
    pub(super) first: Block,
    pub(super) way: Corners,
    unused: [u32; 4],
}

impl MovingBlock {
    pub(super) fn new(first: Block, way: Corners) -> Self {
        Self {
            first,
            way,
            unused: [0; 4],
        }
    }

    /// A triangle's corners a part of their way along, in [0, 1].
    #[inline(always)]
    pub(super) fn triangle(&self, lane: usize, part: f32) -> [Vec3; 3] {
        let (first, way) = (self.first.triangle(lane), of_lane(&self.way.0, lane));
        [0, 1, 2].map(|c| first[c] + way[c] * part)
    }
}

/// Up to four triangles. Lanes are in the order of the ids.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct Block {
    /// By axis, corner and lane; not a number where there is no triangle.
    pub(super) corners: [[[f32; BLOCK]; 3]; 3],
    /// Each triangle's number in its scene.
    pub(super) ids: [u32; BLOCK],
}

impl Block {
    pub(super) const EMPTY: Self = Self {
        corners: [[[f32::NAN; BLOCK]; 3]; 3],
        ids: [u32::MAX; BLOCK],
    };

    /// A block of triangles, each with its number; one to four.
    pub(super) fn new(triangles: &mut [(u32, [Vec3; 3])]) -> Self {
        triangles.sort_unstable_by_key(|(id, _)| *id);
        let mut block = Self::EMPTY;
        for (lane, (id, corners)) in triangles.iter().enumerate() {
            block.ids[lane] = *id;
            for axis in 0..3 {
                for (corner, position) in corners.iter().enumerate() {
                    block.corners[axis][corner][lane] = position[axis];
                }
            }
        }
        block
    }

    /// The name of a block.
    pub(super) fn name(index: usize, triangles: usize) -> u32 {
        assert!(
            index < BLOCK_INDEX as usize,
            "a tree of fewer than 2²⁸ blocks"
        );
        LEAF | (triangles as u32 - 1) << COUNT_SHIFT | index as u32
    }

    /// The block with its corners a part of their way along, in [0, 1].
    #[inline(always)]
    pub(super) fn along(&self, way: &Corners, part: f32) -> Self {
        let mut block = *self;
        for (axis, way) in block.corners.iter_mut().zip(&way.0) {
            for (corner, way) in axis.iter_mut().zip(way) {
                for (corner, way) in corner.iter_mut().zip(way) {
                    *corner += *way * part;
                }
            }
        }
        block
    }

    /// A triangle's corners.
    #[inline(always)]
    pub(super) fn triangle(&self, lane: usize) -> [Vec3; 3] {
        of_lane(&self.corners, lane)
    }
}

/// The three of a lane.
#[inline(always)]
fn of_lane([x, y, z]: &[[[f32; BLOCK]; 3]; 3], lane: usize) -> [Vec3; 3] {
    let corner = |c: usize| Vec3::new(x[c][lane], y[c][lane], z[c][lane]);
    [corner(0), corner(1), corner(2)]
}
