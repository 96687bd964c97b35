//! The kernel in plain arithmetic, for any processor: what the others are held against.

#![allow(unsafe_code)]

use super::kernel::Lanes;
use super::node::{BLOCK, Block, Node, WIDTH};
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
    unsafe fn enter<const ANY: bool>(
        node: &Node,
        ray: &State,
        distances: *mut f32,
        references: *mut u32,
    ) -> u32 {
        let mut near = [0.0_f32; WIDTH];
        let mut far = [f32::INFINITY; WIDTH];
        for axis in 0..3 {
            let first = (ray.near[axis] / 32) as usize;
            let (entering, leaving) = (&node.slabs[first], &node.slabs[first ^ 1]);
            for lane in 0..WIDTH {
                let enter = (entering[lane] - ray.origin[axis]) * ray.inverse[axis];
                let leave = (leaving[lane] - ray.origin[axis]) * ray.inverse[axis];
                near[lane] = greatest(near[lane], enter);
                far[lane] = least(far[lane], leave);
            }
        }
        let mut count = 0;
        for place in node.order {
            let lane = (place >> ray.octant & 7) as usize;
            if near[lane] <= least(far[lane] * WIDEN, ray.limit) {
                // SAFETY: at most eight entries are written, for which the caller has room.
                unsafe {
                    *references.add(count) = node.children[lane];
                    if !ANY {
                        *distances.add(count) = near[lane];
                    }
                }
                count += 1;
            }
        }
        count as u32
    }

    #[inline(always)]
    unsafe fn pop(distances: *const f32, limit: f32) -> u32 {
        // SAFETY: the caller says that eight can be read.
        let distances = unsafe { &*distances.cast::<[f32; WIDTH]>() };
        distances.iter().rposition(|d| *d <= limit).unwrap_or(0) as u32
    }

    #[inline(always)]
    unsafe fn inside(block: &Block, ray: &State) -> u32 {
        let shear = ray.shear();
        let inside = |lane: usize| Shear::inside(shear.edges(block.triangle(lane)));
        (0..BLOCK).fold(0, |lanes, lane| lanes | u32::from(inside(lane)) << lane)
    }

    #[inline(always)]
    unsafe fn meet(block: &Block, ray: &State) -> (f32, usize) {
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
