//! `volpathmis`: the same as `volpath`, which combines channels by multiple importance sampling anyway; in Mitsuba these
//! are two integrators.

use super::limits;
use super::volumetric::Volumetric;
use super::{Context, Cost, Estimates, Estimator, Start};
use crate::color::ColorModel;
use crate::description::Properties;
use crate::description::declared::{Plugin, boolean};
use crate::error::Result;
use crate::sampler::Sampler;
use crate::scene::Scene;

/// The volumetric path tracer's settings.
#[derive(Clone, Debug)]
pub struct VolPathMis(Volumetric);

impl VolPathMis {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "the same as volpath",
        properties: &[
            limits::COMMON,
            limits::LIMITS,
            &[boolean(
                "use_spectral_mis",
                true,
                "whether Mitsuba combines channels",
            )
            .without_effect()],
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, context: &Context) -> Result<Self> {
        Volumetric::build(properties, context).map(Self)
    }
}

impl<C: ColorModel> Estimator<C> for VolPathMis {
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
