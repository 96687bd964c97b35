//! Affine transforms with their inverses: points, directions and normals (by the inverse transpose).

use glam::{Affine3, DAffine3, DMat4, DVec4, Mat3, Vec3};

/// An invertible affine map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    forward: Affine3,
    inverse: Affine3,
}

impl Transform {
    /// Leaves everything in its place.
    pub const IDENTITY: Self = Self {
        forward: Affine3::IDENTITY,
        inverse: Affine3::IDENTITY,
    };

    /// From a 4×4 matrix, inverted in double precision; `None` where the matrix is not affine, not
    /// finite or singular (a column that the others span to within 10⁻¹² of its length).
    pub fn new(matrix: &DMat4) -> Option<Self> {
        if !matrix.is_finite() || matrix.row(3) != DVec4::W {
            return None;
        }
        let forward = DAffine3::from_mat4(*matrix);
        let m = forward.matrix3;
        let volume = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
        if volume.is_nan() || m.determinant().abs() <= 1e-12 * volume {
            return None;
        }
        let (forward, inverse) = (forward.as_affine3(), forward.inverse().as_affine3());
        (forward.is_finite() && inverse.is_finite()).then_some(Self { forward, inverse })
    }

    /// From both ways, which the caller knows to be each other's inverse.
    pub(super) fn of_parts(forward: &DAffine3, inverse: &DAffine3) -> Self {
        Self {
            forward: forward.as_affine3(),
            inverse: inverse.as_affine3(),
        }
    }

    /// As a matrix of double precision.
    pub(super) fn forward(&self) -> DAffine3 {
        self.forward.as_daffine3()
    }

    /// A point.
    #[inline]
    pub fn point(&self, p: Vec3) -> Vec3 {
        self.forward.transform_point3(p)
    }

    /// A direction; its length changes with the scale.
    #[inline]
    pub fn vector(&self, v: Vec3) -> Vec3 {
        self.forward.transform_vector3(v)
    }

    /// A normal, by the inverse transpose; not normalised.
    #[inline]
    pub fn normal(&self, n: Vec3) -> Vec3 {
        self.inverse.matrix3.transpose() * n
    }

    /// The linear part.
    pub fn linear(&self) -> Mat3 {
        self.forward.matrix3
    }

    /// Where the origin goes.
    pub fn translation(&self) -> Vec3 {
        self.forward.translation
    }

    /// The way back.
    #[inline]
    pub fn inverse(&self) -> Self {
        Self {
            forward: self.inverse,
            inverse: self.forward,
        }
    }

    /// The way back, without the way there.
    #[inline]
    pub fn back(&self) -> &Affine3 {
        &self.inverse
    }

    /// Whether it turns right hands into left ones.
    pub fn mirrors(&self) -> bool {
        self.forward.matrix3.determinant() < 0.0
    }

    /// A bound, for each axis, on the rounding error of [`Self::point`] at `p`, whose own coordinates
    /// are off by at most `error` (Higham's γ₃; Pharr, Jakob and Humphreys, *PBRT* 4th ed., 6.8.6).
    pub fn point_error(&self, p: Vec3, error: Vec3) -> Vec3 {
        const GAMMA_3: f32 = 3.0 * (f32::EPSILON * 0.5) / (1.0 - 3.0 * (f32::EPSILON * 0.5));
        let m = self.forward.matrix3;
        let spread = Mat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs());
        spread * (p.abs() * GAMMA_3 + error * (1.0 + GAMMA_3))
            + self.forward.translation.abs() * GAMMA_3
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn a_normal_stays_at_right_angles_to_its_surface() {
        let m = DMat4::from_scale(DVec3::new(1.0, 5.0, -0.2)) * DMat4::from_rotation_x(0.7);
        let t = Transform::new(&m).unwrap();
        let (a, b) = (Vec3::new(1.0, 2.0, 0.0), Vec3::new(0.0, 1.0, -3.0));
        let n = t.normal(a.cross(b));
        assert!(n.dot(t.vector(a)).abs() < 1e-4 && n.dot(t.vector(b)).abs() < 1e-4);
        assert!((t.inverse().point(t.point(a)) - a).length() < 1e-5);
        assert!(t.mirrors());
    }

    #[test]
    fn flat_and_infinite_matrices_are_refused_and_small_ones_are_not() {
        assert_eq!(
            Transform::new(&DMat4::from_scale(DVec3::new(1.0, 1.0, 0.0))),
            None
        );
        assert_eq!(Transform::new(&(DMat4::IDENTITY * f64::INFINITY)), None);
        assert!(Transform::new(&DMat4::from_scale(DVec3::splat(1e-9))).is_some());
        assert!(Transform::new(&DMat4::from_scale(DVec3::new(1.0, 1.0, 1e-9))).is_some());
    }
}
