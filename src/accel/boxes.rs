//! Rays against boxes, conservatively. A slab's plane at b is met at (b − o)/d = b·d⁻¹ − o·d⁻¹, one fused
//! operation; what rounding the second term loses is taken from entries and given to exits, and what is
//! relative to the result widens the exit (after Ize, *Robust BVH ray traversal*, 2013): so no box is missed
//! whose contents are hit. Rounding is monotonic: a box inside another is never entered earlier.

use glam::Vec3;

use crate::interaction::Ray;
use crate::lanes::{self, Lanes, Mask as _};
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

/// The same of a ray a lane.
#[derive(Clone, Copy, Debug)]
pub(super) struct LaneBoxes<F: Lanes> {
    inverse: lanes::Vec3<F>,
    entering: lanes::Vec3<F>,
    leaving: lanes::Vec3<F>,
    /// Who goes backwards along each axis.
    backward: [F::Mask; 3],
}

impl<F: Lanes> LaneBoxes<F> {
    #[inline(always)]
    pub(super) fn new(origin: lanes::Vec3<F>, direction: lanes::Vec3<F>) -> Self {
        let (zero, one) = (F::zero(), F::one());
        let smallest = F::splat(SMALLEST);
        let (x, y, z) = (direction.x, direction.y, direction.z);
        let inverse = lanes::Vec3::new(
            one / F::select(x.abs().lt(smallest), smallest.copysign(x), x),
            one / F::select(y.abs().lt(smallest), smallest.copysign(y), y),
            one / F::select(z.abs().lt(smallest), smallest.copysign(z), z),
        );
        let middle = -origin.times(inverse);
        let lost = middle.abs() * F::splat(LOST);
        Self {
            inverse,
            entering: middle - lost,
            leaving: middle + lost,
            backward: [inverse.x.lt(zero), inverse.y.lt(zero), inverse.z.lt(zero)],
        }
    }

    /// The octant of the rays with these bits, a bit an axis, where all have the same.
    #[inline(always)]
    pub(super) fn common_octant(&self, rays: u32) -> Option<usize> {
        let mut octant = 0;
        for (axis, backward) in self.backward.iter().enumerate() {
            let backward = backward.to_bits() & rays;
            if backward == rays {
                octant |= 1 << axis;
            } else if backward != 0 {
                return None;
            }
        }
        Some(octant)
    }

    /// Where the rays enter a box, 0 from inside, and where they leave it: those that pass by leave before. A box is its
    /// least and greatest coordinates, axis by axis; `octant` is that of all rays, if they have the same.
    #[inline(always)]
    pub(super) fn enter(&self, slabs: [f32; 6], octant: Option<usize>) -> [F; 2] {
        let mut first = [F::zero(); 3];
        let mut last = [F::zero(); 3];
        if let Some(octant) = octant {
            for axis in 0..3 {
                let back = octant >> axis & 1;
                first[axis] = F::splat(slabs[2 * axis + back]);
                last[axis] = F::splat(slabs[2 * axis + 1 - back]);
            }
        } else {
            for axis in 0..3 {
                let (low, high) = (F::splat(slabs[2 * axis]), F::splat(slabs[2 * axis + 1]));
                first[axis] = F::select(self.backward[axis], high, low);
                last[axis] = F::select(self.backward[axis], low, high);
            }
        }
        let (e, l, i) = (self.entering, self.leaving, self.inverse);
        let near = first[0]
            .mul_add(i.x, e.x)
            .max(first[1].mul_add(i.y, e.y))
            .max(first[2].mul_add(i.z, e.z));
        let far = last[0]
            .mul_add(i.x, l.x)
            .min(last[1].mul_add(i.y, l.y))
            .min(last[2].mul_add(i.z, l.z));
        [near.max(F::zero()), far * F::splat(WIDEN)]
    }
}
