//! Rays against triangles, watertight: the shear of Woop, Benthin and Wald (*Watertight ray/triangle
//! intersection*, 2013). Edge functions are differences of two products that are rounded one by one,
//! never fused: rounding is monotonic, so their sign is right wherever it is not zero, and zero counts
//! as inside.
//!
//! A distance that could be negative but for rounding is no hit (Pharr, Jakob and Humphreys, *PBRT* 4th
//! ed., 6.8.7): a ray that starts on a triangle, or on a neighbour in the same plane, does not meet it.

use glam::Vec3;

use crate::interaction::Ray;
use crate::math::offset::gamma;

/// A ray prepared for triangles: the axis along which it mostly goes becomes z, and a shear makes it
/// that axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shear {
    origin: Vec3,
    axes: [usize; 3],
    shear: [f32; 3],
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
            axes: [x, y, z],
            shear: [d[x] / d[z], d[y] / d[z], 1.0 / d[z]],
        }
    }

    /// (t, u, v) with 0 < t ≤ `limit`; u and v are the second and third barycentric coordinates.
    #[inline]
    pub(super) fn intersect(&self, corners: [Vec3; 3], limit: f32) -> Option<(f32, f32, f32)> {
        let [x, y, z] = self.axes;
        let [a, b, c] = corners.map(|p| {
            let p = (p - self.origin).to_array();
            (
                p[x] - self.shear[0] * p[z],
                p[y] - self.shear[1] * p[z],
                p[z],
            )
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
        let t = (u * a.2 + v * b.2 + w * c.2) * self.shear[2] * inverse;
        if !(t > 0.0 && t <= limit) {
            return None;
        }
        let largest = |a: f32, b: f32, c: f32| a.abs().max(b.abs()).max(c.abs());
        let (x, y) = (largest(a.0, b.0, c.0), largest(a.1, b.1, c.1));
        let (z, edge) = (largest(a.2, b.2, c.2), largest(u, v, w));
        let error = t_error([x, y, z * self.shear[2].abs()], edge) * inverse.abs();
        (t > error).then_some((t, v * inverse, w * inverse))
    }
}

/// A bound on the rounding error of t times the determinant, for coordinates and edge functions up to these
/// magnitudes.
fn t_error([x, y, z]: [f32; 3], edge: f32) -> f32 {
    let (dx, dy, dz) = (gamma(5) * (x + z), gamma(5) * (y + z), gamma(3) * z);
    let edge_error = 2.0 * (gamma(2) * x * y + dy * x + dx * y);
    3.0 * (gamma(3) * edge * z + edge_error * z + dz * edge)
}

#[cfg(test)]
mod tests {
    use super::*;

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
