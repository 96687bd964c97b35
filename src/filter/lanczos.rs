//! `lanczos`:

use std::f32::consts::PI;

use super::Kernel;
use crate::description::Properties;
use crate::description::declared::{Plugin, integer};
use crate::error::Result;
use crate::lanes::{Lanes, sin_cos};

/// A windowed sinc.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Lanczos {
    lobes: f32,
}

impl Lanczos {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a windowed sinc: the sharpest, with ringing",
        properties: &[&[
            integer("lobes", 3, "lobes of the sinc; the radius in pixels")
                .between(1.0, super::MAX_RADIUS),
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, _context: &()) -> Result<Self> {
        Ok(Self {
            lobes: properties.integer("lobes")? as f32,
        })
    }
}

impl Lanczos {
    #[inline(always)]
    pub(super) fn weight<F: Lanes>(&self, x: F) -> F {
        let x = x.abs() * F::splat(PI);
        let window = x / F::splat(self.lobes);
        let lobes = (sin_cos(x).0 / x) * (sin_cos(window).0 / window);
        let weight = F::select(x.lt(F::splat(1e-4)), F::one(), lobes);
        F::select(window.le(F::splat(PI)), weight, F::zero())
    }
}

impl Kernel for Lanczos {
    fn radius(&self) -> f32 {
        self.lobes
    }
}
