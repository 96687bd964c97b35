//! Fresnel's equations for unpolarised light (Born and Wolf, *Principles of Optics*; the conductor's in
//! the form of Moeller, *Optics*, 1988), mirror directions and Snell's law. η is the index of refraction
//! on the inside, below the surface, over that on the outside.

use crate::color::Spectra;
use crate::lanes::{Lanes, Vec3};

/// What happens to light at the boundary of two dielectrics.
#[derive(Clone, Copy, Debug)]
pub(super) struct Boundary<F> {
    /// The share that is reflected; the rest passes.
    pub(super) reflectance: F,
    /// Cosine between the normal and the transmitted direction, signed; 0 at total reflection.
    pub(super) cos_t: F,
    /// Index of refraction on the far side over that on the side where the light comes from.
    pub(super) eta: F,
}

/// The boundary with relative index `eta`, met at the signed cosine `cos_i` with its normal.
#[inline(always)]
pub(super) fn dielectric<F: Lanes>(cos_i: F, eta: f32) -> Boundary<F> {
    dielectric_either_way(cos_i, F::splat(eta), F::splat(1.0 / eta))
}

/// The same where the index varies.
#[inline(always)]
pub(super) fn dielectric_lanes<F: Lanes>(cos_i: F, eta: F) -> Boundary<F> {
    dielectric_either_way(cos_i, eta, F::one() / eta)
}

/// The same with the index for light from outside and from inside.
#[inline(always)]
fn dielectric_either_way<F: Lanes>(cos_i: F, inward: F, outward: F) -> Boundary<F> {
    let (zero, one) = (F::zero(), F::one());
    let front = cos_i.ge(zero);
    let relative = F::select(front, inward, outward);
    let sin2_t = (one - cos_i * cos_i) / (relative * relative);
    let cos_t = (one - sin2_t).max(zero).sqrt();
    let cos = cos_i.abs();
    let s = (cos - relative * cos_t) / (cos + relative * cos_t);
    let p = (cos_t - relative * cos) / (cos_t + relative * cos);
    let reflectance = F::splat(0.5) * (s * s + p * p);
    let reflectance = F::select(cos.eq(zero), one, reflectance);
    Boundary {
        reflectance: F::select(inward.eq(one), zero, reflectance),
        cos_t: F::select(front, -cos_t, cos_t),
        eta: relative,
    }
}

/// The reflectance of a conductor with index η + ik for light from outside, at the cosine `cos_i`.
#[inline(always)]
pub(super) fn conductor<F: Lanes, S: Spectra<F>>(cos_i: F, eta: S, k: S) -> S {
    let (zero, one) = (F::zero(), F::one());
    let cos2 = cos_i * cos_i;
    let sin2 = one - cos2;
    let mut reflectance = S::zero();
    for c in 0..S::CHANNELS {
        let (n, k) = (eta[c], k[c]);
        let difference = n * n - k * k - sin2;
        let a2_b2 = (difference * difference + F::splat(4.0) * n * n * k * k).sqrt();
        let a = (F::splat(0.5) * (a2_b2 + difference)).max(zero).sqrt();
        let twice = (cos_i + cos_i) * a;
        let s = (a2_b2 + cos2 - twice) / (a2_b2 + cos2 + twice);
        let (sum, cross) = (a2_b2 * cos2 + sin2 * sin2, twice * sin2);
        // 0/0 only where n = k = 0 at normal incidence: there both polarisations are alike.
        let told = zero.lt(sum + cross);
        let ratio = F::select(told, (sum - cross) / (sum + cross), one);
        reflectance.set(c, F::splat(0.5) * s * (one + ratio));
    }
    reflectance
}

/// The share of diffuse light that a boundary reflects on its outside: fits by Egan and Hilgeman (1973)
/// for η < 1 and by d'Eon and Irving (2011) otherwise, better than 0.2 % for indices from 1 to 1.5.
pub(super) fn diffuse_reflectance(eta: f32) -> f32 {
    let inverse = 1.0 / eta;
    let polynomial = |x: f32, coefficients: &[f32]| {
        let horner = |sum, c: &f32| sum * x + c;
        coefficients.iter().rev().fold(0.0, horner)
    };
    if eta < 1.0 {
        0.0636 * inverse + polynomial(eta, &[0.6681, 0.7099, -1.4399])
    } else {
        let fit = [0.919317, -3.4793, 6.75335, -7.80989, 4.98554, -1.36881];
        polynomial(inverse, &fit)
    }
}

/// The mirror image of the local direction `wi` at the surface.
#[inline(always)]
pub(super) fn mirror<F: Lanes>(wi: Vec3<F>) -> Vec3<F> {
    Vec3::new(-wi.x, -wi.y, wi.z)
}

/// The mirror image of `wi` about the normal `m`.
#[inline(always)]
pub(super) fn reflect<F: Lanes>(wi: Vec3<F>, m: Vec3<F>) -> Vec3<F> {
    let cos = wi.dot(m);
    m * (cos + cos) - wi
}

/// The direction in which light from `wi` goes on behind the boundary with normal `m`.
#[inline(always)]
pub(super) fn refract<F: Lanes>(wi: Vec3<F>, m: Vec3<F>, boundary: &Boundary<F>) -> Vec3<F> {
    let scale = F::one() / boundary.eta;
    m * (wi.dot(m) * scale + boundary.cos_t) - wi * scale
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Columns;

    #[test]
    fn refraction_obeys_snell_and_total_reflection_passes_nothing() {
        for cos in [1.0f32, 0.7, 0.2, -0.9, -0.3] {
            let wi = glam::Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
            let b = dielectric::<f32>(cos, 1.5);
            if b.cos_t == 0.0 {
                assert!((b.reflectance - 1.0).abs() < 1e-6 && cos > -0.74 && cos < 0.0);
                continue;
            }
            let wt = glam::Vec3::from(refract(wi.into(), glam::Vec3::Z.into(), &b));
            assert!((wt.length() - 1.0).abs() < 1e-5);
            assert!(wt.z * wi.z < 0.0);
            assert!((wi.x + wt.x * b.eta).abs() < 1e-5, "{wi} {wt}");
        }
    }

    #[test]
    fn a_boundary_reflects_alike_from_both_sides_of_one_ray() {
        let b = dielectric::<f32>(0.6, 1.5);
        let back = dielectric(b.cos_t, 1.5);
        assert!((b.reflectance - back.reflectance).abs() < 1e-6);
        assert!((dielectric::<f32>(1.0, 1.5).reflectance - 0.04).abs() < 1e-6);
    }

    /// Mitsuba 3.9.1, `fresnel_conductor` and a conductor without material.
    #[test]
    fn conductors_reflect_as_published() {
        let of = |cos, n, k| conductor::<f32, _>(cos, Columns([n]), Columns([k]))[0];
        // ((n − 1)² + k²) / ((n + 1)² + k²) at normal incidence.
        assert!((of(1.0, 0.2, 3.5) - 12.89 / 13.69).abs() < 1e-5);
        // A conductor without absorption is a dielectric.
        assert!((of(0.3, 1.5, 0.0) - dielectric::<f32>(0.3, 1.5).reflectance).abs() < 1e-5);
        for cos in [1.0, 0.5, 0.01] {
            assert_eq!(of(cos, 0.0, 1.0), 1.0);
            assert_eq!(of(cos, 0.0, 0.0), 1.0);
        }
    }

    #[test]
    fn diffuse_reflectance_is_the_mean_of_fresnel_s_over_the_hemisphere() {
        for eta in [1.33f32, 1.5, 1.0 / 1.33, 1.0 / 1.5] {
            let n = 2000;
            let mean: f32 = (0..n)
                .map(|i| {
                    let cos2 = (i as f32 + 0.5) / n as f32;
                    dielectric(cos2.sqrt(), eta).reflectance / n as f32
                })
                .sum();
            let fit = diffuse_reflectance(eta);
            assert!((fit - mean).abs() < 4e-3, "{eta}: {fit} {mean}");
        }
    }
}
