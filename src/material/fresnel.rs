//! Fresnel's equations for unpolarised light (Born and Wolf, *Principles of Optics*; the conductor's in
//! the form of Moeller, *Optics*, 1988), mirror directions and Snell's law. η is the index of refraction
//! on the inside, below the surface, over that on the outside.

use glam::Vec3;

use crate::color::Spectral;

/// What happens to light at the boundary of two dielectrics.
#[derive(Clone, Copy, Debug)]
pub(super) struct Boundary {
    /// The share that is reflected; the rest passes.
    pub(super) reflectance: f32,
    /// Cosine between the normal and the transmitted direction, signed; 0 at total reflection.
    pub(super) cos_t: f32,
    /// Index of refraction on the far side over that on the side where the light comes from.
    pub(super) eta: f32,
}

/// The boundary with relative index `eta`, met at the signed cosine `cos_i` with its normal.
pub(super) fn dielectric(cos_i: f32, eta: f32) -> Boundary {
    let relative = if cos_i >= 0.0 { eta } else { 1.0 / eta };
    let sin2_t = (1.0 - cos_i * cos_i) / (relative * relative);
    let cos_t = (1.0 - sin2_t).max(0.0).sqrt();
    let cos = cos_i.abs();
    let reflectance = if eta == 1.0 {
        0.0
    } else if cos == 0.0 {
        1.0
    } else {
        let s = (cos - relative * cos_t) / (cos + relative * cos_t);
        let p = (cos_t - relative * cos) / (cos_t + relative * cos);
        0.5 * (s * s + p * p)
    };
    Boundary {
        reflectance,
        cos_t: if cos_i >= 0.0 { -cos_t } else { cos_t },
        eta: relative,
    }
}

/// The reflectance of a conductor with index η + ik for light from outside, at the cosine `cos_i`.
pub(super) fn conductor<S: Spectral>(cos_i: f32, eta: S, k: S) -> S {
    let cos2 = cos_i * cos_i;
    let sin2 = 1.0 - cos2;
    S::from_fn(|c| {
        let (n, k) = (eta[c], k[c]);
        let difference = n * n - k * k - sin2;
        let a2_b2 = (difference * difference + 4.0 * n * n * k * k).sqrt();
        let a = (0.5 * (a2_b2 + difference)).max(0.0).sqrt();
        let twice = 2.0 * cos_i * a;
        let s = (a2_b2 + cos2 - twice) / (a2_b2 + cos2 + twice);
        let (sum, cross) = (a2_b2 * cos2 + sin2 * sin2, twice * sin2);
        // 0/0 only where n = k = 0 at normal incidence: there both polarisations are alike.
        let ratio = if sum + cross > 0.0 {
            (sum - cross) / (sum + cross)
        } else {
            1.0
        };
        0.5 * s * (1.0 + ratio)
    })
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
pub(super) fn mirror(wi: Vec3) -> Vec3 {
    Vec3::new(-wi.x, -wi.y, wi.z)
}

/// The mirror image of `wi` about the normal `m`.
pub(super) fn reflect(wi: Vec3, m: Vec3) -> Vec3 {
    m * (2.0 * wi.dot(m)) - wi
}

/// The direction in which light from `wi` goes on behind the boundary with normal `m`.
pub(super) fn refract(wi: Vec3, m: Vec3, boundary: &Boundary) -> Vec3 {
    let scale = 1.0 / boundary.eta;
    m * (wi.dot(m) * scale + boundary.cos_t) - wi * scale
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Samples;

    #[test]
    fn refraction_obeys_snell_and_total_reflection_passes_nothing() {
        for cos in [1.0f32, 0.7, 0.2, -0.9, -0.3] {
            let wi = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
            let b = dielectric(cos, 1.5);
            if b.cos_t == 0.0 {
                assert!((b.reflectance - 1.0).abs() < 1e-6 && cos > -0.74 && cos < 0.0);
                continue;
            }
            let wt = refract(wi, Vec3::Z, &b);
            assert!((wt.length() - 1.0).abs() < 1e-5);
            assert!(wt.z * wi.z < 0.0);
            assert!((wi.x + wt.x * b.eta).abs() < 1e-5, "{wi} {wt}");
        }
    }

    #[test]
    fn a_boundary_reflects_alike_from_both_sides_of_one_ray() {
        let b = dielectric(0.6, 1.5);
        let back = dielectric(b.cos_t, 1.5);
        assert!((b.reflectance - back.reflectance).abs() < 1e-6);
        assert!((dielectric(1.0, 1.5).reflectance - 0.04).abs() < 1e-6);
    }

    /// Mitsuba 3.9.1, `fresnel_conductor` and a conductor without material.
    #[test]
    fn conductors_reflect_as_published() {
        let of = |cos, n, k| conductor(cos, Samples([n]), Samples([k]))[0];
        // ((n − 1)² + k²) / ((n + 1)² + k²) at normal incidence.
        assert!((of(1.0, 0.2, 3.5) - 12.89 / 13.69).abs() < 1e-5);
        // A conductor without absorption is a dielectric.
        assert!((of(0.3, 1.5, 0.0) - dielectric(0.3, 1.5).reflectance).abs() < 1e-5);
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
