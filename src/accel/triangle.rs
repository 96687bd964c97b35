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
    origin: Vec3,
    direction: Vec3,
    axes: [usize; 3],
    shear: [f32; 2],
}

impl Shear {
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
        let (x, y) = if d[z] < 0.0 {
            ((z + 2) % 3, (z + 1) % 3)
        } else {
            ((z + 1) % 3, (z + 2) % 3)
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
        let [x, y, z] = self.axes;
        let [a, b, c] = corners.map(|p| {
            let p = (p - self.origin).to_array();
            (p[x] - self.shear[0] * p[z], p[y] - self.shear[1] * p[z])
        });
        let u = c.0 * b.1 - c.1 * b.0;
        let v = a.0 * c.1 - a.1 * c.0;
        let w = b.0 * a.1 - b.1 * a.0;
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let determinant = u + v + w;
        if determinant == 0.0 {
            return None;
        }
        let inverse = 1.0 / determinant;
        let t = self.distance(corners);
        (t > 0.0 && t <= limit).then_some((t, v * inverse, w * inverse))
    }

    /// Where the ray meets the triangle's plane.
    fn distance(&self, corners: [Vec3; 3]) -> f32 {
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
