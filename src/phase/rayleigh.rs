//! `rayleigh`: that of particles much smaller than a wavelength, 3/16π·(1 + cos² θ), drawn by inverting its cubic
//! (Frisvad, *Importance sampling the Rayleigh phase function*, 2011).

use std::f32::consts::FRAC_1_PI;

use super::{BlockPhase, PhaseSamples, Scatter, around};
use crate::color::Mono;
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::lanes::{Lanes, Vec2, Vec3, pow};
use crate::texture::Palette;

/// Rayleigh's.
#[derive(Clone, Copy, Debug)]
pub struct Rayleigh;

impl Rayleigh {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "particles much smaller than a wavelength",
        properties: &[],
    };

    pub(super) fn build(_properties: &Properties<'_>, _numbers: &Palette<Mono>) -> Result<Self> {
        Ok(Self)
    }
}

/// By the cosine of the angle.
#[inline(always)]
fn value<F: Lanes>(cosine: F) -> F {
    F::splat(3.0 / 16.0 * FRAC_1_PI) * (F::one() + cosine * cosine)
}

impl Scatter for Rayleigh {}

impl BlockPhase for Rayleigh {
    #[inline(always)]
    fn eval_lanes<F: Lanes>(&self, _at: Vec3<F>, wi: Vec3<F>, wo: Vec3<F>) -> F {
        value(wo.dot(wi))
    }

    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        _at: Vec3<F>,
        wi: Vec3<F>,
        _u1: F,
        u2: Vec2<F>,
    ) -> PhaseSamples<F> {
        // μ³ + 3μ = 2z, whose one real root is A − 1/A.
        let z = F::splat(4.0) * u2.x - F::splat(2.0);
        // The larger of the two roots' cubes, which does not cancel.
        let cube = z.abs() + (z * z + F::one()).sqrt();
        let a = pow(cube, F::splat(1.0 / 3.0));
        let cosine = (a - F::one() / a).copysign(z).clamp(-1.0, 1.0);
        PhaseSamples {
            wo: around(wi, cosine, u2.y),
            pdf: value(cosine),
        }
    }
}
