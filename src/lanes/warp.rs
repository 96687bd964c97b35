//! Maps from the unit square to the shapes that are sampled, each with its density. Formulas after
//! Pharr, Jakob and Humphreys, *Physically Based Rendering* (4th ed., 2023), appendix A.5.

use std::f32::consts::{FRAC_1_PI, FRAC_PI_4, TAU};

use super::elementary::sin_cos_small;
use super::{Lanes, Vec2, Vec3, sin_cos_turns};

/// Uniform on the unit disc, strata kept together (Shirley and Chiu's concentric map, 1997).
#[inline(always)]
pub fn concentric_disk<F: Lanes>(u: Vec2<F>) -> Vec2<F> {
    let (x, y) = (u.x + u.x - F::one(), u.y + u.y - F::one());
    let wide = y.abs().lt(x.abs());
    let r = F::select(wide, x, y);
    let ratio = F::select(wide, y / x, x / y);
    // The centre has no direction.
    let ratio = F::select(r.eq(F::zero()), F::zero(), ratio);
    let (sin, cos) = sin_cos_small(ratio * F::splat(FRAC_PI_4));
    Vec2::new(r * F::select(wide, cos, sin), r * F::select(wide, sin, cos))
}

/// Directions over z > 0 with density [`cosine_hemisphere_pdf`].
#[inline(always)]
pub fn cosine_hemisphere<F: Lanes>(u: Vec2<F>) -> Vec3<F> {
    let p = concentric_disk(u);
    let z2 = F::one() - p.length_squared();
    p.extend(z2.max(F::zero()).sqrt())
}

/// cos θ / π, 0 below.
#[inline(always)]
pub fn cosine_hemisphere_pdf<F: Lanes>(cos_theta: F) -> F {
    cos_theta.max(F::zero()) * F::splat(FRAC_1_PI)
}

/// Uniform on the unit sphere, density 1/4π.
#[inline(always)]
pub fn uniform_sphere<F: Lanes>(u: Vec2<F>) -> Vec3<F> {
    let z = F::one() - u.x - u.x;
    let r = (F::one() - z * z).max(F::zero()).sqrt();
    let (sin, cos) = sin_cos_turns(u.y);
    Vec3::new(r * cos, r * sin, z)
}

/// Barycentric coordinates of the second and third corner, uniform on a triangle (Heitz's fold, 2019).
#[inline(always)]
pub fn uniform_triangle<F: Lanes>(u: Vec2<F>) -> Vec2<F> {
    let half = F::splat(0.5) * u.x.min(u.y);
    let first = u.x.lt(u.y);
    Vec2::new(
        F::select(first, half, u.x - half),
        F::select(first, u.y - half, half),
    )
}

/// Density of the directions within θ_max of an axis, 1 / (2π (1 − cos θ_max)), by 1 − cos θ_max: the cosine
/// itself rounds to 1 for small cones.
#[inline(always)]
pub fn uniform_cone_pdf<F: Lanes>(one_minus_cos: F) -> F {
    F::one() / (F::splat(TAU) * one_minus_cos)
}

#[cfg(test)]
mod tests {
    use super::*;

    type Vec2 = super::Vec2<f32>;

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
        for u in [
            Vec2::splat(0.0),
            Vec2::splat(0.5),
            Vec2::new(0.999_999_94, 0.3),
        ] {
            for d in [cosine_hemisphere(u), uniform_sphere(u)] {
                assert!((d.length() - 1.0).abs() < 1e-5, "{u:?} {d:?}");
            }
        }
    }
}
