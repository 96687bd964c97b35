//! Maps from the unit square to the shapes that are sampled, each with its density. Formulas after
//! Pharr, Jakob and Humphreys, *Physically Based Rendering* (4th ed., 2023), appendix A.5.

use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_4, PI, TAU};

/// Uniform on the unit disc, strata kept together (Shirley and Chiu's concentric map, 1997).
#[inline]
pub fn concentric_disk(u: Vec2) -> Vec2 {
    let p = 2.0 * u - Vec2::ONE;
    if p == Vec2::ZERO {
        return Vec2::ZERO;
    }
    let (r, theta) = if p.x.abs() > p.y.abs() {
        (p.x, FRAC_PI_4 * p.y / p.x)
    } else {
        (p.y, FRAC_PI_4 * (2.0 - p.x / p.y))
    };
    r * Vec2::new(theta.cos(), theta.sin())
}

/// Directions over z > 0 with density [`cosine_hemisphere_pdf`].
#[inline]
pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let p = concentric_disk(u);
    p.extend((1.0 - p.length_squared()).max(0.0).sqrt())
}

/// cos θ / π, 0 below.
#[inline]
pub fn cosine_hemisphere_pdf(cos_theta: f32) -> f32 {
    cos_theta.max(0.0) * FRAC_1_PI
}

/// Uniform on the unit sphere, density 1/4π.
#[inline]
pub fn uniform_sphere(u: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * u.x;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (TAU * u.y).sin_cos();
    Vec3::new(r * cos, r * sin, z)
}

/// Barycentric coordinates of the second and third corner, uniform on a triangle (Heitz's fold, 2019).
#[inline]
pub fn uniform_triangle(u: Vec2) -> Vec2 {
    if u.x < u.y {
        let b = 0.5 * u.x;
        Vec2::new(b, u.y - b)
    } else {
        let b = 0.5 * u.y;
        Vec2::new(u.x - b, b)
    }
}

/// Density of the directions within θ_max of an axis, 1 / (2π (1 − cos θ_max)), by 1 − cos θ_max: the cosine
/// itself rounds to 1 for small cones.
#[inline]
pub fn uniform_cone_pdf(one_minus_cos: f32) -> f32 {
    1.0 / (2.0 * PI * one_minus_cos)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of `f` over a midpoint grid of the unit square.
    fn mean(f: impl Fn(Vec2) -> f64) -> f64 {
        let n = 256;
        let at = |i: i32| (i as f32 + 0.5) / n as f32;
        let sum: f64 = (0..n * n).map(|i| f(Vec2::new(at(i % n), at(i / n)))).sum();
        sum / f64::from(n * n)
    }

    #[test]
    fn warps_have_the_moments_of_their_densities() {
        // E[z] and E[z²]: 2/3, 1/2 for the cosine; 0, 1/3 for the sphere.
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-3, "{a} {b}");
        near(mean(|u| f64::from(cosine_hemisphere(u).z)), 2.0 / 3.0);
        near(mean(|u| f64::from(cosine_hemisphere(u).z.powi(2))), 0.5);
        near(mean(|u| f64::from(uniform_sphere(u).z)), 0.0);
        near(mean(|u| f64::from(uniform_sphere(u).z.powi(2))), 1.0 / 3.0);
        near(
            mean(|u| f64::from(concentric_disk(u).length_squared())),
            0.5,
        );
        near(mean(|u| f64::from(uniform_triangle(u).x)), 1.0 / 3.0);
        near(mean(|u| f64::from(uniform_triangle(u).y)), 1.0 / 3.0);
    }

    #[test]
    fn warped_directions_have_unit_length() {
        for u in [Vec2::ZERO, Vec2::splat(0.5), Vec2::new(0.999_999_94, 0.3)] {
            for d in [cosine_hemisphere(u), uniform_sphere(u)] {
                assert!((d.length() - 1.0).abs() < 1e-5, "{u} {d}");
            }
        }
    }
}
