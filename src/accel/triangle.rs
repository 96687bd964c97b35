//! Rays against triangles, watertight: the shear of Woop, Benthin and Wald (*Watertight ray/triangle
//! intersection*, 2013). Edge functions are differences of two products that are rounded one by one,
//! never fused: rounding is monotonic, so their sign is right wherever it is not zero, and zero counts
//! as inside. The distance is computed in double precision: seen from a point that leaves a large triangle
//! at a flat angle, the sum of the corners' distances cancels, and the triangle would shadow itself.

use glam::Vec3;

use crate::interaction::Ray;

/// A ray prepared for triangles: the axis along which it mostly goes becomes z, and a shear makes it
/// that axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shear {
    pub(super) origin: Vec3,
    pub(super) direction: Vec3,
    pub(super) axes: [usize; 3],
    pub(super) shear: [f32; 2],
}

/// The axis of the greatest of three, by whether the first is greater than the second, the first than the third,
/// and the second than the third.
pub(super) const GREATEST: [usize; 8] = [2, 2, 2, 0, 1, 2, 1, 0];

/// For each axis as z the other two: in their order, and changed round for a ray that goes backwards along z, so
/// that winding is kept.
pub(super) const AXES: [[[usize; 3]; 2]; 3] = [
    [[1, 2, 0], [2, 1, 0]],
    [[2, 0, 1], [0, 2, 1]],
    [[0, 1, 2], [1, 0, 2]],
];

/// The smaller, the second where they cannot be compared: as processors have it.
#[inline(always)]
pub(super) fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The greater, the second where they cannot be compared.
#[inline(always)]
pub(super) fn greatest(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

impl Shear {
    #[inline]
    pub(super) fn new(ray: &Ray) -> Self {
        let d = ray.direction.to_array();
        let [a, b, c] = d.map(f32::abs);
        // Looked up, not branched on: nobody can foretell it.
        let z = GREATEST[usize::from(a > b) | usize::from(a > c) << 1 | usize::from(b > c) << 2];
        let axes = AXES[z][usize::from(d[z] < 0.0)];
        let [x, y, z] = axes;
        Self {
            origin: ray.origin,
            direction: ray.direction,
            axes,
            shear: [d[x] / d[z], d[y] / d[z]],
        }
    }

    /// (t, u, v) with 0 < t ≤ `limit`; u and v are the second and third barycentric coordinates.
    #[inline]
    pub(super) fn intersect(&self, corners: [Vec3; 3], limit: f32) -> Option<(f32, f32, f32)> {
        let edges = self.edges(corners);
        if !Self::inside(edges) {
            return None;
        }
        let t = self.distance(corners);
        let (u, v) = Self::barycentric(edges);
        (t > 0.0 && t <= limit).then_some((t, u, v))
    }

    /// The edge functions: twice the areas that the ray and each edge span, in the sheared plane.
    #[inline(always)]
    pub(super) fn edges(&self, corners: [Vec3; 3]) -> [f32; 3] {
        let [x, y, z] = self.axes;
        let planar = |corner: Vec3| {
            let p = (corner - self.origin).to_array();
            (p[x] - self.shear[0] * p[z], p[y] - self.shear[1] * p[z])
        };
        let [a, b, c] = corners;
        let (a, b, c) = (planar(a), planar(b), planar(c));
        [
            c.0 * b.1 - c.1 * b.0,
            a.0 * c.1 - a.1 * c.0,
            b.0 * a.1 - b.1 * a.0,
        ]
    }

    /// Whether edge functions are all of one sign, where zero has both, and not all zero.
    #[inline(always)]
    pub(super) fn inside(edges: [f32; 3]) -> bool {
        edges.iter().all(|e| *e >= 0.0) != edges.iter().all(|e| *e <= 0.0)
    }

    /// The second and third barycentric coordinates, which are the same whatever sign the edge functions have.
    #[inline(always)]
    pub(super) fn barycentric([u, v, w]: [f32; 3]) -> (f32, f32) {
        let inverse = 1.0 / (u + v + w);
        // What is added takes the sign of a zero.
        (v * inverse + 0.0, w * inverse + 0.0)
    }

    /// Where the ray meets the triangle's plane.
    #[inline(always)]
    pub(super) fn distance(&self, corners: [Vec3; 3]) -> f32 {
        let [a, b, c] = corners.map(Vec3::as_dvec3);
        let normal = (b - a).cross(c - a);
        (normal.dot(a - self.origin.as_dvec3()) / normal.dot(self.direction.as_dvec3())) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_that_leaves_a_huge_triangle_does_not_meet_it_again() {
        let corners = [
            Vec3::new(-1000.0, -1000.0, 0.0),
            Vec3::new(1000.0, -1000.0, 0.0),
            Vec3::new(1000.0, 1000.0, 0.0),
        ];
        for i in 0..1000 {
            let (x, y) = (0.01 * i as f32, 0.007 * i as f32 - 8.0);
            let mut ray = Ray {
                origin: Vec3::new(x, y, 1e-4),
                direction: Vec3::new(-x, -y, 1.0).normalize(),
                t_max: f32::INFINITY,
                time: 0.0,
            };
            let meets = |ray: &Ray| Shear::new(ray).intersect(corners, f32::INFINITY);
            assert_eq!(meets(&ray), None);
            ray.direction = -ray.direction;
            let (t, ..) = meets(&ray).unwrap();
            assert!((ray.at(t).z).abs() < 1e-9, "{t}");
        }
    }

    #[test]
    fn a_ray_that_starts_on_a_floor_at_height_zero_does_not_meet_it() {
        let (a, b) = (Vec3::new(-10.0, -10.0, 0.0), Vec3::new(10.0, 10.0, 0.0));
        let floor = [
            [a, Vec3::new(10.0, -10.0, 0.0), b],
            [a, b, Vec3::new(-10.0, 10.0, 0.0)],
        ];
        for i in 0..2000 {
            let angle = i as f32;
            let ray = Ray {
                origin: Vec3::new(3.7 * angle.sin(), 2.9 * (1.7 * angle).cos(), 0.0),
                direction: Vec3::new(angle.cos(), angle.sin(), 0.3 * (i % 7) as f32).normalize(),
                t_max: f32::INFINITY,
                time: 0.0,
            };
            for corners in floor {
                assert_eq!(Shear::new(&ray).intersect(corners, f32::INFINITY), None);
            }
        }
    }
}
