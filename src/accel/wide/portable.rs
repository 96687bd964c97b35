//! The kernel in plain arithmetic, for any processor: what the others are held against.

#![allow(unsafe_code)]

use super::kernel::Lanes;
use super::node::{BLOCK, Block, Corners, Entry, Node, Slabs, WIDTH, entry};
use super::state::State;
use crate::accel::boxes::WIDEN;
use crate::accel::triangle::{Shear, greatest, least};
use crate::shape::Bounds;

/// See the module.
#[derive(Clone, Copy, Debug)]
pub(super) struct Portable;

// SAFETY: it needs nothing of the processor, and writes eight entries at the pointers at most.
unsafe impl Lanes for Portable {
    #[inline(always)]
    unsafe fn enter(node: &Node, way: Option<&Slabs>, ray: &State, stack: *mut Entry) -> u32 {
        let node = way.map_or(*node, |way| node.along(way, ray.part));
        let mut near = [0.0_f32; WIDTH];
        let mut far = [f32::INFINITY; WIDTH];
        for axis in 0..3 {
            let first = usize::from(ray.near[axis] / 32);
            let (entering, leaving) = (&node.slabs[first], &node.slabs[first ^ 1]);
            for lane in 0..WIDTH {
                let enter = entering[lane].mul_add(ray.inverse[axis], ray.entering[axis]);
                let leave = leaving[lane].mul_add(ray.inverse[axis], ray.leaving[axis]);
                near[lane] = greatest(near[lane], enter);
                far[lane] = least(far[lane], leave);
            }
        }
        let order = node.order[usize::from(ray.octant)];
        let mut count = 0;
        for place in 0..WIDTH {
            let lane = (order >> (3 * place) & 7) as usize;
            if near[lane] <= least(far[lane] * WIDEN, ray.limit()) {
                // SAFETY: at most eight entries are written, for which the caller has room.
                unsafe { *stack.add(count) = entry(near[lane], node.children[lane]) };
                count += 1;
            }
        }
        count as u32
    }

    #[inline(always)]
    unsafe fn pop(stack: *const Entry, bound: Entry) -> u32 {
        // SAFETY: the caller says that eight can be read.
        let entries = unsafe { &*stack.cast::<[Entry; WIDTH]>() };
        let within = |entry: &Entry| entry.cast_signed() <= bound.cast_signed();
        entries.iter().rposition(within).unwrap_or(0) as u32
    }

    #[inline(always)]
    unsafe fn inside(block: &Block, way: Option<&Corners>, ray: &State) -> u32 {
        let block = way.map_or(*block, |way| block.along(way, ray.part));
        let shear = ray.shear();
        let inside = |lane: usize| Shear::inside(shear.edges(block.triangle(lane)));
        (0..BLOCK).fold(0, |lanes, lane| lanes | u32::from(inside(lane)) << lane)
    }

    #[inline(always)]
    unsafe fn meet(block: &Block, way: Option<&Corners>, ray: &State) -> (f32, usize) {
        let block = way.map_or(*block, |way| block.along(way, ray.part));
        let (shear, boxes) = (ray.shear(), ray.boxes());
        let mut best = (f32::NAN, 0);
        for lane in (0..BLOCK).filter(|lane| ray.lanes >> lane & 1 == 1) {
            let corners = block.triangle(lane);
            let t = shear.distance(corners);
            let bounds = corners.into_iter().fold(Bounds::EMPTY, Bounds::with);
            let Some(own) = boxes.entry(&bounds, f32::INFINITY) else {
                continue;
            };
            let t = if t > 0.0 {
                t.max(own).max(ray.entry)
            } else {
                continue;
            };
            if t < best.0 || best.0.is_nan() {
                best = (t, lane);
            }
        }
        best
    }
}
