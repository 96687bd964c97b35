//! What a z-buffer holds: for each sample one number, which is the greater the nearer a triangle is. Its upper half is the
//! depth, its lower half tells triangles of one depth apart: the first of them wins, in the order (instance, shape,
//! primitive), as with rays. So the greatest number is the answer, in whatever order triangles are drawn.
//!
//! Depth is a float, the reciprocal of the distance, whose steps are a part of the distance; or, as in hardware of old, an
//! integer of some bits over the range from near to far, whose steps are small near by and large far off: then surfaces
//! that are close to each other fight.

use super::projection::Projection;
use crate::lanes::{Doubles, Ints, Lanes};

/// How depth is kept.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DepthFormat {
    /// Single precision.
    #[default]
    Float,
    /// An integer of so many bits, 1 to 31.
    Bits(u32),
}

/// How the depths of a picture become numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct DepthCode {
    is_perspective: bool,
    near: f64,
    /// What nothing is added to for the farthest, and the steps from there to the nearest; for floats the steps are 0.
    farthest: f64,
    scale: f64,
}

impl DepthCode {
    pub(super) fn new(projection: &Projection, format: DepthFormat) -> Self {
        let [near, far] = projection.range();
        let is_perspective = projection.is_perspective();
        let (farthest, nearest) = match is_perspective {
            true => (1.0 / far, 1.0 / near),
            false => (far, near),
        };
        let scale = match format {
            DepthFormat::Float => 0.0,
            DepthFormat::Bits(bits) => {
                let steps = (1_u64 << bits.clamp(1, 31)) - 1;
                steps as f64 / (nearest - farthest)
            }
        };
        Self {
            is_perspective,
            // Parallel rays have no pinhole: the number must be finite where they begin.
            near: 1e-3 * (far - near),
            farthest,
            scale,
        }
    }

    /// What is linear over the picture: the reciprocal of `a` in perspective, else `a` itself.
    #[inline]
    pub(super) fn linear(&self, a: f64) -> f64 {
        if self.is_perspective { 1.0 / a } else { a }
    }

    /// The number's upper half, at least 1.
    #[inline]
    pub(super) fn code(&self, linear: f64) -> u32 {
        if self.scale != 0.0 {
            return ((linear - self.farthest) * self.scale) as u32 + 1;
        }
        let reciprocal = match self.is_perspective {
            true => linear,
            false => 1.0 / (self.near + linear),
        };
        // Positive floats are ordered as integers are.
        (reciprocal as f32).to_bits().max(1)
    }

    /// [`DepthCode::code`] of floats, by `a`.
    #[inline(always)]
    pub(super) fn codes<F: Lanes>(&self, a: F::Double) -> <F::Int as Ints>::Row {
        let wide = <F::Double as Doubles>::splat;
        let along = match self.is_perspective {
            true => a,
            false => wide(self.near) + a,
        };
        let mut codes = F::Int::ROW;
        (wide(1.0) / along).narrow().to_bits().store(&mut codes);
        codes
    }
}

/// The number of a triangle at a depth.
#[inline]
pub(super) fn key(code: u32, number: u32) -> u64 {
    u64::from(code) << 32 | u64::from(!number)
}

/// The triangle that a number is of; 0 is of none.
#[inline]
pub(super) fn number(key: u64) -> Option<u32> {
    (key != 0).then_some(!(key as u32))
}
