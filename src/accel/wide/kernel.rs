//! The steps of a walk that are done on lanes.

#![allow(unsafe_code)]

use super::node::{Block, Corners, Entry, LEAF, Node, OTHER, Slabs};
use super::state::State;
use crate::interaction::Ray;

/// The steps of a walk that are done on lanes. Of what moves it is told how far, and takes it as it stands at the ray's
/// part of the way.
///
/// # Safety
/// An implementation may need instructions that not every processor has: its functions must be called, or
/// rather expanded, only where those may be used.
pub(super) unsafe trait Lanes: Copy {
    /// Prepares what follows from the origin and direction of a ray that has been put into a tree; one that is not finite
    /// ends there.
    ///
    /// # Safety
    /// See the trait.
    #[inline(always)]
    unsafe fn aim(ray: &Ray, state: &mut State) {
        state.aim(ray);
    }

    /// Writes the children that the ray enters, farthest first, and returns how many.
    ///
    /// # Safety
    /// Eight entries can be written.
    unsafe fn enter(node: &Node, way: Option<&Slabs>, ray: &State, stack: *mut Entry) -> u32;

    /// The last of eight entries that is within reach; the first where none is.
    ///
    /// # Safety
    /// Eight entries can be read.
    unsafe fn pop(stack: *const Entry, bound: Entry) -> u32;

    /// A bit for each triangle of the block that the ray's line goes through.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn inside(block: &Block, way: Option<&Corners>, ray: &State) -> u32;

    /// The first hit among the triangles `ray.lanes`: its distance, not a number where there is none, and
    /// its lane.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn meet(block: &Block, way: Option<&Corners>, ray: &State) -> (f32, usize);

    /// Puts rays, given by their slots and what they visit next, at the ends of the lists where they belong.
    ///
    /// # Safety
    /// The arrays have room up to the next multiple of [`FILED`], and so have the lists behind their ends.
    #[inline(always)]
    unsafe fn file(slots: *const u32, currents: *const u32, count: usize, ends: &mut Ends) {
        for i in 0..count {
            // SAFETY: the caller says that there is room.
            unsafe {
                let (slot, current) = (*slots.add(i), *currents.add(i));
                let (leaf, rest) = (current >= LEAF, current >= OTHER);
                // Written to each list, of which only the one that it belongs to grows: nothing branches.
                *ends.nodes = slot;
                *ends.leaves = slot;
                *ends.rest = slot;
                ends.nodes = ends.nodes.add(usize::from(!leaf));
                ends.leaves = ends.leaves.add(usize::from(leaf ^ rest));
                ends.rest = ends.rest.add(usize::from(rest));
            }
        }
    }
}

/// As many rays are filed at once.
pub(super) const FILED: usize = 16;

/// The ends of the lists to which a round writes.
pub(super) struct Ends {
    pub(super) nodes: *mut u32,
    pub(super) leaves: *mut u32,
    pub(super) rest: *mut u32,
}
