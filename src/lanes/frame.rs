//! Orthonormal frames in lanes: see [`crate::math::Frame`].

use super::{Lanes, Mask as _, Vec3};
use crate::math;

/// Three unit vectors at right angles, right-handed; local z is the normal.
#[derive(Clone, Copy, Debug)]
pub struct Frame<F> {
    /// Local x.
    pub s: Vec3<F>,
    /// Local y.
    pub t: Vec3<F>,
    /// Local z, the normal.
    pub n: Vec3<F>,
}

impl<F: Lanes> Frame<F> {
    /// Some frame around the unit vector `n` (Duff et al., *Building an orthonormal basis, revisited*, 2017).
    #[inline(always)]
    pub fn around(n: Vec3<F>) -> Self {
        let one = F::one();
        let sign = one.copysign(n.z);
        let a = -one / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            s: Vec3::new(one + sign * n.x * n.x * a, sign * b, -sign * n.x),
            t: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            n,
        }
    }

    /// The frame around the unit vector `n` whose s points along `tangent` as far as it can; any frame where `tangent`
    /// is parallel to `n`, zero or not finite.
    #[inline(always)]
    pub fn along(n: Vec3<F>, tangent: Vec3<F>) -> Self {
        let across = tangent - n * n.dot(tangent);
        let length = across.length_squared();
        // What is left of a tangent along n is rounding error, in no particular direction.
        let told = length.gt(F::splat(1e-8) * tangent.length_squared()) & length.is_finite();
        let s = across * (F::one() / length.sqrt());
        let t = n.cross(s);
        if !(!told).any() {
            return Self { s, t, n };
        }
        let other = Self::around(n);
        Self {
            s: Vec3::select(told, s, other.s),
            t: Vec3::select(told, t, other.t),
            n,
        }
    }

    /// A world direction in this frame.
    #[inline(always)]
    pub fn to_local(&self, v: Vec3<F>) -> Vec3<F> {
        Vec3::new(v.dot(self.s), v.dot(self.t), v.dot(self.n))
    }

    /// A local direction in the world.
    #[inline(always)]
    pub fn to_world(&self, v: Vec3<F>) -> Vec3<F> {
        self.s * v.x + self.t * v.y + self.n * v.z
    }
}

impl From<Frame<f32>> for math::Frame {
    #[inline(always)]
    fn from(frame: Frame<f32>) -> Self {
        Self {
            s: frame.s.into(),
            t: frame.t.into(),
            n: frame.n.into(),
        }
    }
}

impl From<math::Frame> for Frame<f32> {
    #[inline(always)]
    fn from(frame: math::Frame) -> Self {
        Self {
            s: frame.s.into(),
            t: frame.t.into(),
            n: frame.n.into(),
        }
    }
}
