//! Orthonormal frames: local z is the normal, so that cos θ of a local direction is its z.

use glam::Vec3;

/// Three unit vectors at right angles, right-handed: `s × t = n`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Local x.
    pub s: Vec3,
    /// Local y.
    pub t: Vec3,
    /// Local z, the normal.
    pub n: Vec3,
}

impl Frame {
    /// Some frame around the unit vector `n`, continuous but at z = 0 (Duff et al., *Building an
    /// orthonormal basis, revisited*, 2017).
    pub fn around(n: Vec3) -> Self {
        let sign = 1f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            s: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            t: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            n,
        }
    }

    /// The frame around the unit vector `n` whose s points along `tangent` as far as it can; any frame
    /// where `tangent` is parallel to `n`, zero or not finite.
    pub fn along(n: Vec3, tangent: Vec3) -> Self {
        let across = tangent - n * n.dot(tangent);
        // What is left of a tangent along n is rounding error, in no particular direction.
        if across.length_squared() > 1e-8 * tangent.length_squared() && across.is_finite() {
            let s = across.normalize();
            Self {
                s,
                t: n.cross(s),
                n,
            }
        } else {
            Self::around(n)
        }
    }

    /// A world direction in this frame.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.s), v.dot(self.t), v.dot(self.n))
    }

    /// A local direction in the world.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.s * v.x + self.t * v.y + self.n * v.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random;

    #[test]
    fn frames_are_orthonormal_right_handed_and_invert() {
        for i in 0..1000 {
            let number = |key| random::unit(random::bits(key, i)) - 0.5;
            let n = Vec3::new(number(1), number(2), number(3)).normalize();
            for frame in [
                Frame::around(n),
                Frame::along(n, Vec3::X),
                Frame::along(n, n),
            ] {
                assert!((frame.s.cross(frame.t) - frame.n).length() < 1e-5);
                let v = Vec3::new(0.3, -0.5, 0.8);
                assert!((frame.to_world(frame.to_local(v)) - v).length() < 1e-5);
            }
        }
    }
}
