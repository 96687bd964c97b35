//! `isotropic`: the same in all directions, 1/4π.

use std::f32::consts::FRAC_1_PI;

use super::{BlockPhase, PhaseSamples, Scatter};
use crate::color::Mono;
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::lanes::{Lanes, Vec2, Vec3, warp};
use crate::texture::Palette;

/// Everywhere alike.
#[derive(Clone, Copy, Debug)]
pub struct Isotropic;

impl Isotropic {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "the same in all directions",
        properties: &[],
    };

    pub(super) fn build(_properties: &Properties<'_>, _numbers: &Palette<Mono>) -> Result<Self> {
        Ok(Self)
    }
}

impl Scatter for Isotropic {}

impl BlockPhase for Isotropic {
    #[inline(always)]
    fn eval_lanes<F: Lanes>(&self, _at: Vec3<F>, _wi: Vec3<F>, _wo: Vec3<F>) -> F {
        F::splat(FRAC_1_PI / 4.0)
    }

    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        _at: Vec3<F>,
        _wi: Vec3<F>,
        _u1: F,
        u2: Vec2<F>,
    ) -> PhaseSamples<F> {
        PhaseSamples {
            wo: warp::uniform_sphere(u2),
            pdf: F::splat(FRAC_1_PI / 4.0),
        }
    }
}
