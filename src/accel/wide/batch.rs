//! Walking the tree, many rays in flight.
//!
//! A walk is a chain of loads that wait for each other, and of branches that nobody can foretell. So a
//! batch keeps dozens of rays on their way and takes them in rounds: all that are at a node go a step,
//! then all that are at a block. Within a round nothing depends on what another ray found, and nothing
//! branches on it: each ray is written to the end of every list, and only the list that it belongs to
//! grows.

#![allow(unsafe_code)]

use std::hint::select_unpredictable;

use super::kernel::{Ends, FILED, Lanes};
use super::node::{
    BLOCK, BLOCK_INDEX, DONE, EXIT, Entry, LEAF, LEAVE, MovingBlock, MovingNode, OTHER,
    OTHER_INDEX, WIDTH, triangles_of,
};
use super::state::{Best, Flight, Start, State};
use super::{Met, Tree, Walker};
use crate::accel::Counts;
use crate::accel::triangle::Shear;

/// Rays on their way at once. Fewer wait for memory, more fall out of the nearest cache.
pub(super) const IN_FLIGHT: usize = 48;

/// Room for a list, to be written to in whole groups.
type List = [u32; IN_FLIGHT + FILED];

/// Rays by what they do next, as slots.
struct Lists {
    nodes: [List; 2],
    leaves: [List; 2],
    inside: List,
    rest: [List; 2],
    ended: List,
    /// What those of a list that was just taken in hand visit next.
    currents: List,
}

/// All stacks.
#[derive(Clone, Copy)]
struct Stacks {
    start: *mut Entry,
    /// How many levels of an inner tree a ray has room for beside all of the outer one's.
    inner_levels: usize,
}

impl Stacks {
    /// Enters a node: its children go onto the stack, and the nearest comes from it. Where there is none,
    /// the next comes from below.
    ///
    /// # Safety
    /// The ray is at a node of the tree, its stack is in its place, and the processor has `L`.
    #[inline(always)]
    unsafe fn step<L: Lanes, const ANY: bool, const LATER: bool>(self, ray: &mut State) {
        let top = ray.top as usize;
        // SAFETY: below the top are eight sentinels at least, above it room for eight children.
        unsafe {
            // Looked for before the children are written: reading what was just written in pieces is slow.
            let below = if ANY {
                top as u32 - 1
            } else {
                self.below::<L>(ray)
            };
            let index = ray.current as usize;
            let stack = self.start.add(top);
            let count = if LATER && ray.is_moving() {
                let MovingNode { first, way } = &*ray.moving_nodes.add(index);
                L::enter(first, Some(way), ray, stack)
            } else {
                L::enter(&*ray.nodes.add(index), None, ray, stack)
            };
            ray.top = select_unpredictable(count == 0, below, top as u32 + count - 1);
            ray.current = *self.start.add(ray.top as usize) as u32;
        }
    }

    /// The highest place on the stack that is not beyond the limit, among eight.
    ///
    /// # Safety
    /// As [`Stacks::step`].
    #[inline(always)]
    unsafe fn below<L: Lanes>(self, ray: &State) -> u32 {
        let lowest = ray.top - WIDTH as u32;
        // SAFETY: eight sentinels are at the bottom.
        lowest + unsafe { L::pop(self.start.add(lowest as usize), ray.bound) }
    }

    /// What comes next where the present leads nowhere.
    ///
    /// # Safety
    /// As [`Stacks::step`].
    #[inline(always)]
    unsafe fn next<L: Lanes, const ANY: bool>(self, ray: &State) -> (u32, u32) {
        // SAFETY: as for `step`.
        unsafe {
            let top = if ANY {
                ray.top - 1
            } else {
                self.below::<L>(ray)
            };
            (top, *self.start.add(top as usize) as u32)
        }
    }

    /// The block that the ray is at: a bit for each triangle that its line goes through.
    ///
    /// # Safety
    /// The ray is at a block of the tree, and the processor has `L`.
    #[inline(always)]
    unsafe fn inside<L: Lanes, const LATER: bool>(self, ray: &mut State) -> u32 {
        let index = (ray.current & BLOCK_INDEX) as usize;
        // SAFETY: the index is a block's, and the caller has what `L` needs.
        let lanes = unsafe {
            if LATER && ray.is_moving() {
                let MovingBlock { first, way, .. } = &*ray.moving_blocks.add(index);
                L::inside(first, Some(way), ray)
            } else {
                L::inside(&*ray.blocks.add(index), None, ray)
            }
        };
        ray.lanes = lanes as u8;
        lanes
    }

    /// Takes the best of the triangles that the line goes through; whether there is any.
    ///
    /// # Safety
    /// As [`Stacks::inside`].
    #[inline(always)]
    unsafe fn meet<L: Lanes, const LATER: bool>(self, ray: &mut State) -> bool {
        let index = ray.current & BLOCK_INDEX;
        // SAFETY: the index is a block's, and the caller has what `L` needs.
        let (t, lane, id) = unsafe {
            let (block, way) = if LATER && ray.is_moving() {
                let MovingBlock { first, way, .. } = &*ray.moving_blocks.add(index as usize);
                (first, Some(way))
            } else {
                (&*ray.blocks.add(index as usize), None)
            };
            let (t, lane) = L::meet(block, way, ray);
            (t, lane, block.ids[lane])
        };
        let limit = ray.limit();
        let better = (t < limit) | ((t == limit) & (id < ray.id));
        ray.reach(select_unpredictable(better, t, limit));
        ray.id = select_unpredictable(better, id, ray.id);
        ray.place = select_unpredictable(better, index << 2 | lane as u32, ray.place);
        better
    }

    /// Deals with a ray at an item that is no triangle, or at an instance's end.
    ///
    /// # Safety
    /// As [`Stacks::step`]; above the top is room for an entry and for what the walker's inner trees leave.
    #[inline(always)]
    unsafe fn other<'t, L: Lanes, W: Walker<'t>, const ANY: bool, const LATER: bool>(
        self,
        ray: &mut State,
        tree: &'t Tree,
        walker: &mut W,
    ) {
        if ray.current == LEAVE {
            // SAFETY: as for `step`.
            let (_, next) = unsafe { self.next::<L, ANY>(ray) };
            // Where nothing is left outside, nobody needs to go back there. A ray that ended because it is not finite
            // inside may have more to meet.
            if next == DONE && ray.limit() > f32::NEG_INFINITY {
                ray.current = DONE;
                return;
            }
            found::<W, ANY, LATER>(walker, ray);
            // SAFETY: the caller has what `L` needs.
            unsafe { enter::<L, LATER>(ray, tree, &walker.start(ray.ray as usize)) };
            // SAFETY: as for `step`.
            (ray.top, ray.current) = unsafe { self.next::<L, ANY>(ray) };
            return;
        }
        // SAFETY: what the ray is at was taken from its top.
        let entry = unsafe { *self.start.add(ray.top as usize) };
        let reached = f32::from_bits((entry >> 32) as u32);
        match walker.other(&ray.visit(reached), ray.current & OTHER_INDEX) {
            Met::Nothing => {}
            Met::Better(Best { t, id, place }) => {
                ray.reach(t);
                (ray.id, ray.place) = (id, place.0);
                if ANY {
                    ray.current = DONE;
                    return;
                }
            }
            Met::Instance(inner, start) => {
                assert!(inner.levels <= self.inner_levels, "room for the tree");
                found::<W, ANY, LATER>(walker, ray);
                // SAFETY: there is room, and the caller has what `L` needs.
                unsafe {
                    // Where nothing is left outside, nobody needs to go back there.
                    let top = self.start.add(ray.top as usize);
                    let below = *top.sub(1) as u32;
                    *top = EXIT;
                    ray.top += u32::from(below != DONE);
                    enter::<L, LATER>(ray, inner, &start);
                }
                return;
            }
        }
        // SAFETY: as for `step`.
        (ray.top, ray.current) = unsafe { self.next::<L, ANY>(ray) };
    }

    /// Asks for what the ray will need in the next round.
    #[inline(always)]
    fn fetch<const LATER: bool>(self, ray: &State) {
        #[cfg(target_arch = "x86_64")]
        {
            use super::node::Node;
            use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
            // In cache lines.
            const LINES: usize = size_of::<Node>().div_ceil(64);
            const MOVING_LINES: usize = size_of::<MovingNode>().div_ceil(64);
            const MOVING_BLOCK_LINES: usize = size_of::<MovingBlock>().div_ceil(64);
            let current = ray.current;
            let index = (current & BLOCK_INDEX) as usize;
            let is_moving = LATER && ray.is_moving();
            let (node, block) = if is_moving {
                let node = ray.moving_nodes.wrapping_add(current as usize);
                let block = ray.moving_blocks.wrapping_add(index);
                (node.cast::<i8>(), block.cast::<i8>())
            } else {
                let node = ray.nodes.wrapping_add(current as usize);
                let block = ray.blocks.wrapping_add(index);
                (node.cast(), block.cast())
            };
            let at = select_unpredictable(current >= LEAF, block, node);
            // What is no place in memory would be looked for in all tables of pages.
            let at =
                select_unpredictable(current >= OTHER, self.start.cast::<i8>().cast_const(), at);
            let lines = if is_moving { MOVING_LINES } else { LINES };
            for line in 0..lines {
                // A block that moves is shorter; its beginning is asked for twice.
                let line = match is_moving && line >= MOVING_BLOCK_LINES {
                    true => select_unpredictable(current >= LEAF, 0, line),
                    false => line,
                };
                // SAFETY: a hint never faults, wherever it points.
                unsafe { _mm_prefetch::<_MM_HINT_T0>(at.wrapping_add(64 * line)) };
            }
        }
    }
}

/// Hands a triangle of the tree that the ray is in to the walker, if it is the best.
#[inline(always)]
fn found<'t, W: Walker<'t>, const ANY: bool, const LATER: bool>(walker: &mut W, ray: &State) {
    let best = ray.best();
    if !best.is_inside() {
        return;
    }
    let mut uv = (0.0, 0.0);
    if !ANY {
        let (index, lane) = (ray.place as usize / BLOCK, ray.place as usize % BLOCK);
        // SAFETY: the place is a triangle's in the tree that the ray is in.
        let corners = unsafe {
            if LATER && ray.is_moving() {
                (*ray.moving_blocks.add(index)).triangle(lane, ray.part)
            } else {
                (*ray.blocks.add(index)).triangle(lane)
            }
        };
        uv = Shear::barycentric(ray.shear().edges(corners));
    }
    walker.found(ray.ray as usize, ray.instance, best, uv);
}

/// Puts the next ray that has somewhere to go at the root of the tree in which all begin; whether there is one.
///
/// # Safety
/// The processor has the instructions of `L`.
#[inline(always)]
unsafe fn begin<'t, L: Lanes, W: Walker<'t>, const LATER: bool>(
    walker: &mut W,
    (next, count): (&mut usize, usize),
    ray: &mut State,
    tree: &Tree,
    bottom: u32,
) -> bool {
    // Where nothing moves no word of it may be compiled: a start that may come from either would be put together in memory, and
    // every ray would wait for it.
    if LATER && walker.begins_inside() {
        while *next < count {
            let start = walker.start_inside(*next);
            *next += 1;
            if let Some(start) = start {
                ray.begin((*next - 1) as u32, bottom);
                // SAFETY: the caller's word.
                unsafe { enter::<L, LATER>(ray, tree, &start) };
                return true;
            }
        }
        return false;
    }
    if *next == count {
        return false;
    }
    ray.begin(*next as u32, bottom);
    // SAFETY: the caller's word.
    unsafe { enter::<L, LATER>(ray, tree, &walker.start(*next)) };
    *next += 1;
    true
}

/// Puts a ray at a tree's root, and aims it.
///
/// # Safety
/// The processor has the instructions of `L`.
#[inline(always)]
unsafe fn enter<L: Lanes, const LATER: bool>(ray: &mut State, tree: &Tree, start: &Start) {
    ray.enter(tree, start);
    if LATER {
        ray.follow(tree, start);
    }
    // SAFETY: the caller's word.
    unsafe { L::aim(&start.ray, ray) };
}

/// Walks `count` rays.
///
/// # Safety
/// The processor has the instructions of `L`, and `flight` was made for more levels than the tree has.
#[inline(always)]
pub(super) unsafe fn batch<
    't,
    L: Lanes,
    W: Walker<'t>,
    const ANY: bool,
    const FETCH: bool,
    const LATER: bool,
>(
    tree: &'t Tree,
    walker: &mut W,
    count: usize,
    flight: &mut Flight,
    counts: &mut Counts,
) {
    let stacks = Stacks {
        start: flight.stacks.as_mut_ptr(),
        inner_levels: flight.levels() - tree.levels - 1,
    };
    let slots = flight.states.len().min(count).min(IN_FLIGHT);
    const NONE: List = [0; IN_FLIGHT + FILED];
    let mut lists = Lists {
        nodes: [NONE; 2],
        leaves: [NONE; 2],
        inside: NONE,
        rest: [NONE; 2],
        ended: NONE,
        currents: NONE,
    };
    let bottoms: [u32; IN_FLIGHT] = std::array::from_fn(|slot| flight.bottom(slot));
    let states = flight.states.as_mut_ptr();
    let (mut next, mut node_count, mut leaf_count, mut rest_count) = (0, 0, 0, 0);
    for (slot, state) in flight.states.iter_mut().enumerate().take(slots) {
        let rays = (&mut next, count);
        // SAFETY: the caller has what `L` needs.
        if unsafe { begin::<L, W, LATER>(walker, rays, state, tree, bottoms[slot]) } {
            lists.nodes[0][slot] = slot as u32;
            node_count += 1;
        }
    }
    let (mut node_steps, mut triangle_tests) = (0, 0);
    // SAFETY: every slot is on one list at a time, so none outgrows its array; rays at a node, a block or
    // an item are at one of this tree; stacks have room for its levels.
    unsafe {
        let node_lists = lists.nodes.as_mut_ptr();
        let leaf_lists = lists.leaves.as_mut_ptr();
        let (mut nodes, mut later_nodes) = (node_lists.cast::<u32>(), node_lists.add(1).cast());
        let (mut leaves, mut later_leaves) = (leaf_lists.cast::<u32>(), leaf_lists.add(1).cast());
        let rest_lists = lists.rest.as_mut_ptr();
        let (mut rest, mut later_rest) = (rest_lists.cast::<u32>(), rest_lists.add(1).cast());
        let inside = lists.inside.as_mut_ptr();
        let ended_list = lists.ended.as_mut_ptr();
        let currents = lists.currents.as_mut_ptr();
        while node_count + leaf_count + rest_count > 0 {
            node_steps += node_count as u64;
            for i in 0..node_count {
                let ray = &mut *states.add(*nodes.add(i) as usize);
                stacks.step::<L, ANY, LATER>(ray);
                *currents.add(i) = ray.current;
                if FETCH {
                    stacks.fetch::<LATER>(ray);
                }
            }
            let mut ends = Ends {
                nodes: later_nodes,
                leaves: leaves.add(leaf_count),
                rest: rest.add(rest_count),
            };
            L::file(nodes, currents, node_count, &mut ends);
            leaf_count = ends.leaves.offset_from(leaves) as usize;
            let mut inside_count = 0;
            for i in 0..leaf_count {
                let slot = *leaves.add(i);
                let ray = &mut *states.add(slot as usize);
                triangle_tests += triangles_of(ray.current);
                *inside.add(inside_count) = slot;
                inside_count += usize::from(stacks.inside::<L, LATER>(ray) != 0);
            }
            for i in 0..inside_count {
                let slot = *inside.add(i);
                let ray = &mut *states.add(slot as usize);
                let better = stacks.meet::<L, LATER>(ray);
                if ANY {
                    // At the bottom nothing is left to be visited.
                    let bottom = bottoms.get_unchecked(slot as usize) + 1;
                    ray.top = select_unpredictable(better, bottom, ray.top);
                }
            }
            for i in 0..leaf_count {
                let ray = &mut *states.add(*leaves.add(i) as usize);
                (ray.top, ray.current) = stacks.next::<L, ANY>(ray);
                *currents.add(i) = ray.current;
                if FETCH {
                    stacks.fetch::<LATER>(ray);
                }
            }
            ends.leaves = later_leaves;
            L::file(leaves, currents, leaf_count, &mut ends);
            rest_count = ends.rest.offset_from(rest) as usize;
            // Those that have ended are taken apart: what comes next in a list of both nobody can foretell.
            let (mut ended, mut ended_count, mut others) = (rest, rest_count, 0);
            if flight.others {
                (ended, ended_count) = (ended_list, 0);
                for i in 0..rest_count {
                    let slot = *rest.add(i);
                    let has_ended = (*states.add(slot as usize)).current == DONE;
                    *ended.add(ended_count) = slot;
                    *rest.add(others) = slot;
                    ended_count += usize::from(has_ended);
                    others += usize::from(!has_ended);
                }
            }
            if FETCH {
                for i in 0..others {
                    let ray = &*states.add(*rest.add(i) as usize);
                    if ray.current < LEAVE {
                        walker.fetch(ray.instance, ray.current & OTHER_INDEX);
                    }
                }
            }
            let mut ready = 0;
            for i in 0..others {
                let slot = *rest.add(i);
                let ray = &mut *states.add(slot as usize);
                stacks.other::<L, W, ANY, LATER>(ray, tree, walker);
                let has_ended = ray.current == DONE;
                *ended.add(ended_count) = slot;
                *rest.add(ready) = slot;
                *currents.add(ready) = ray.current;
                ended_count += usize::from(has_ended);
                ready += usize::from(!has_ended);
            }
            for i in 0..ended_count {
                let slot = *ended.add(i);
                let ray = &mut *states.add(slot as usize);
                found::<W, ANY, LATER>(walker, ray);
                let rays = (&mut next, count);
                if begin::<L, W, LATER>(walker, rays, ray, tree, bottoms[slot as usize]) {
                    *rest.add(ready) = slot;
                    *currents.add(ready) = ray.current;
                    ready += 1;
                }
            }
            // Written behind the others, which have been read.
            let mut again = Ends {
                rest: later_rest,
                ..ends
            };
            L::file(rest, currents, ready, &mut again);
            node_count = again.nodes.offset_from(later_nodes) as usize;
            leaf_count = again.leaves.offset_from(later_leaves) as usize;
            rest_count = again.rest.offset_from(later_rest) as usize;
            (nodes, later_nodes) = (later_nodes, nodes);
            (leaves, later_leaves) = (later_leaves, leaves);
            (rest, later_rest) = (later_rest, rest);
        }
    }
    counts.node_steps += node_steps;
    counts.primitive_tests += u64::from(triangle_tests);
}
