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
        let magnitude = d.map(f32::abs);
        let z = if magnitude[0] > magnitude[1] && magnitude[0] > magnitude[2] {
            0
        } else if magnitude[1] > magnitude[2] {
            1
        } else {
            2
        };
        // Winding is kept where the ray goes backwards along z.
        let (after, before) = ([1, 2, 0][z], [2, 0, 1][z]);
        let (x, y) = if d[z] < 0.0 {
            (before, after)
        } else {
            (after, before)
        };
        Self {
            origin: ray.origin,
            direction: ray.direction,
            axes: [x, y, z],
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
    pub(super) fn inside([u, v, w]: [f32; 3]) -> bool {
        let (low, high) = (least(u, least(v, w)), greatest(u, greatest(v, w)));
        (low >= 0.0) != (high <= 0.0)
    }

    /// The second and third barycentric coordinates.
    #[inline(always)]
    pub(super) fn barycentric([u, v, w]: [f32; 3]) -> (f32, f32) {
        let inverse = 1.0 / (u + v + w);
        (v * inverse, w * inverse)
    }

    /// Where the ray meets the triangle's plane.
    #[inline(always)]
    pub(super) fn distance(&self, corners: [Vec3; 3]) -> f32 {
        let origin = self.origin.as_dvec3();
        let [a, b, c] = corners.map(|p| p.as_dvec3() - origin);
        let normal = (b - a).cross(c - a);
        (normal.dot(a) / normal.dot(self.direction.as_dvec3())) as f32
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
