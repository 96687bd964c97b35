//! Rays against boxes, conservatively. A slab's plane at b is met at (b − o)/d = b·d⁻¹ − o·d⁻¹, one fused
//! operation; what rounding the second term loses is taken from entries and given to exits, and what is
//! relative to the result widens the exit (after Ize, *Robust BVH ray traversal*, 2013): so no box is missed
//! whose contents are hit. Rounding is monotonic: a box inside another is never entered earlier.

use glam::Vec3;

use crate::interaction::Ray;
use crate::shape::Bounds;

/// A ray prepared for boxes.
#[derive(Clone, Copy, Debug)]
pub(super) struct RayBoxes {
    pub(super) inverse: Vec3,
    /// −o·d⁻¹ and less, where planes are entered.
    pub(super) entering: Vec3,
    /// −o·d⁻¹ and more, where they are left.
    pub(super) leaving: Vec3,
}

/// 1 + 2γ₃, rounded up.
pub(super) const WIDEN: f32 = 1.000_000_5;
/// The smallest component of a direction that is inverted as it is; its inverse times any coordinate
/// below 10¹⁸ stays finite.
pub(super) const SMALLEST: f32 = 1e-20;
/// Twice what is lost by rounding a product and then its sum with this part of it.
pub(super) const LOST: f32 = 2.0 * f32::EPSILON;

impl RayBoxes {
    #[inline(always)]
    pub(super) fn new(ray: &Ray) -> Self {
        let bounded = |d: f32| {
            if d.abs() < SMALLEST {
                SMALLEST.copysign(d)
            } else {
                d
            }
        };
        let d = ray.direction;
        let inverse = Vec3::new(bounded(d.x), bounded(d.y), bounded(d.z)).recip();
        let middle = -ray.origin * inverse;
        let lost = LOST * middle.abs();
        Self {
            inverse,
            entering: middle - lost,
            leaving: middle + lost,
        }
    }

    /// Where the ray enters the box, 0 from inside; `None` where it passes by, or enters after `limit`.
    #[inline(always)]
    pub(super) fn entry(&self, bounds: &Bounds, limit: f32) -> Option<f32> {
        let backward = self.inverse.cmplt(Vec3::ZERO);
        let first = Vec3::select(backward, bounds.max, bounds.min);
        let last = Vec3::select(backward, bounds.min, bounds.max);
        let near = first.mul_add(self.inverse, self.entering);
        let far = last.mul_add(self.inverse, self.leaving);
        let near = near.max_element().max(0.0);
        let far = far.min_element() * WIDEN;
        (near <= far && near <= limit).then_some(near)
    }
}
