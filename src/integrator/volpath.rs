//! `volpath`: paths through participating media, with one light sample where they are scattered, shadow rays that pass
//! media and surfaces which light goes straight through, and multiple importance sampling over channels and techniques
//! ([`super::volumetric`]). Surfaces that are passed so do not count as a bounce, other than in `path`.
//!
//! `max_depth`, `rr_depth` and `hide_emitters`: see [`super::limits`].

use super::limits;
use super::volumetric::Volumetric;
use super::{Context, Cost, Estimates, Estimator, Start};
use crate::color::ColorModel;
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::sampler::Sampler;
use crate::scene::Scene;

/// The volumetric path tracer's settings.
#[derive(Clone, Debug)]
pub struct VolPath(Volumetric);

impl VolPath {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "paths through participating media",
        properties: &[limits::COMMON, limits::LIMITS],
    };

    pub(super) fn build(properties: &Properties<'_>, context: &Context) -> Result<Self> {
        Volumetric::build(properties, context).map(Self)
    }
}

impl<C: ColorModel> Estimator<C> for VolPath {
    fn renders_media(&self) -> bool {
        true
    }

    fn estimate(
        &self,
        scene: &Scene<C>,
        sampler: &Sampler,
        starts: &[Start<C>],
        estimates: &mut Estimates<C::Sample>,
        cost: &mut Cost,
    ) {
        self.0.estimate(scene, sampler, starts, estimates, cost);
    }
}
