//! `hg`: Henyey and Greenstein's phase function (*Diffuse radiation in the galaxy*, 1941) with the mean cosine `g` (0.8)
//! in (−1, 1): 0 is isotropic, light goes on forward where it is positive and back where it is negative.

use std::f32::consts::FRAC_1_PI;

use super::{BlockPhase, PhaseSamples, Scatter, around};
use crate::color::Mono;
use crate::description::Properties;
use crate::description::declared::{Plugin, float};
use crate::error::Result;
use crate::lanes::{Lanes, Vec2, Vec3};
use crate::texture::Palette;

/// Henyey and Greenstein's.
#[derive(Clone, Copy, Debug)]
pub struct Hg {
    g: f32,
}

/// Below, the formula for drawing a cosine divides by too little, and the phase function is isotropic to single precision.
const ISOTROPIC: f32 = 1e-3;

impl Hg {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "Henyey and Greenstein's: forward or back",
        properties: &[&[float(
            "g",
            0.8,
            "the mean cosine: above 0 light goes on forward, below 0 back",
        )
        .between(-0.999_999, 0.999_999)]],
    };

    pub(super) fn build(properties: &Properties<'_>, _numbers: &Palette<Mono>) -> Result<Self> {
        let g = properties.float("g")? as f32;
        Ok(Self { g })
    }

    /// By the cosine of the angle between `wo` and `wi`.
    #[inline(always)]
    fn value<F: Lanes>(&self, cosine: F) -> F {
        let (g, one) = (F::splat(self.g), F::one());
        // Its least is (1 − |g|)², where single precision cancels.
        let least = (1.0 - self.g.abs()) * (1.0 - self.g.abs());
        let base = (one + g * g + (g + g) * cosine).max(F::splat(least));
        F::splat(FRAC_1_PI / 4.0) * (one - g * g) / (base * base.sqrt())
    }
}

impl Scatter for Hg {}

impl BlockPhase for Hg {
    #[inline(always)]
    fn eval_lanes<F: Lanes>(&self, _at: Vec3<F>, wi: Vec3<F>, wo: Vec3<F>) -> F {
        self.value(wo.dot(wi))
    }

    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        _at: Vec3<F>,
        wi: Vec3<F>,
        _u1: F,
        u2: Vec2<F>,
    ) -> PhaseSamples<F> {
        let (g, one) = (F::splat(self.g), F::one());
        let cosine = if self.g.abs() < ISOTROPIC {
            one - u2.x - u2.x
        } else {
            let ratio = (one - g * g) / (one - g + (g + g) * u2.x);
            (one + g * g - ratio * ratio) / (g + g)
        };
        let cosine = cosine.clamp(-1.0, 1.0);
        PhaseSamples {
            wo: around(wi, cosine, u2.y),
            pdf: self.value(-cosine),
        }
    }
}
