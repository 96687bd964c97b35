//! Rays against boxes, conservatively: the slab test whose exit is widened by its rounding error, so
//! that no box is missed whose contents are hit (Ize, *Robust BVH ray traversal*, 2013). Entries are
//! monotonic: a box inside another is never entered earlier.

use glam::Vec3;

use crate::interaction::Ray;
use crate::shape::Bounds;

/// A ray prepared for boxes.
#[derive(Clone, Copy, Debug)]
pub(super) struct RayBoxes {
    pub(super) origin: Vec3,
    pub(super) inverse: Vec3,
}

/// 1 + 2γ₃, rounded up.
pub(super) const WIDEN: f32 = 1.000_000_5;
/// The smallest component of a direction that is inverted as it is; its inverse times any coordinate
/// difference below 10¹⁸ stays finite.
const SMALLEST: f32 = 1e-20;

impl RayBoxes {
    #[inline]
    pub(super) fn new(ray: &Ray) -> Self {
        let bounded = |d: f32| {
            if d.abs() < SMALLEST {
                SMALLEST.copysign(d)
            } else {
                d
            }
        };
        let d = ray.direction;
        Self {
            origin: ray.origin,
            inverse: Vec3::new(bounded(d.x), bounded(d.y), bounded(d.z)).recip(),
        }
    }

    /// Where the ray enters the box, 0 from inside; `None` where it passes by, or enters after `limit`.
    #[inline]
    pub(super) fn entry(&self, bounds: &Bounds, limit: f32) -> Option<f32> {
        let a = (bounds.min - self.origin) * self.inverse;
        let b = (bounds.max - self.origin) * self.inverse;
        let near = a.min(b).max_element().max(0.0);
        let far = a.max(b).min_element() * WIDEN;
        (near <= far && near <= limit).then_some(near)
    }
}
