//! `moment`: renders its nested integrator. (Mitsuba's also writes the samples' squares; its scenes use
//! it for their references, and the image is the nested one's.)

use super::limits;
use super::{Context, Cost, Estimates, Estimator, Integrator, Start};
use crate::color::ColorModel;
use crate::description::declared::{Plugin, nested};
use crate::description::{Kind, Properties};
use crate::error::Result;
use crate::sampler::Sampler;
use crate::scene::Scene;

/// Around one integrator.
#[derive(Debug)]
pub struct Moment<C: ColorModel> {
    nested: Box<dyn Estimator<C>>,
}

impl<C: ColorModel> Moment<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "the image of its nested integrator",
        properties: &[
            limits::UNUSED,
            &[nested(Kind::Integrator, "what is rendered")],
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, context: &Context) -> Result<Self> {
        match &properties.children(Kind::Integrator)[..] {
            [child] => Ok(Self {
                nested: Box::new(Integrator::<C>::build(child, context)?),
            }),
            children => Err(properties.error(
                "",
                format!(
                    "moment needs one nested integrator, and has {}",
                    children.len()
                ),
            )),
        }
    }
}

impl<C: ColorModel> Estimator<C> for Moment<C> {
    fn extra_channels(&self) -> Vec<String> {
        self.nested.extra_channels()
    }

    fn renders_media(&self) -> bool {
        self.nested.renders_media()
    }

    fn leaves_out(&self, scene: &Scene<C>) -> Option<String> {
        self.nested.leaves_out(scene)
    }

    fn traces_light(&self) -> bool {
        self.nested.traces_light()
    }

    fn photon_bytes(&self) -> u64 {
        self.nested.photon_bytes()
    }

    fn prepare(&self, scene: &Scene<C>) {
        self.nested.prepare(scene);
    }

    fn estimate(
        &self,
        scene: &Scene<C>,
        sampler: &Sampler,
        starts: &[Start<C>],
        estimates: &mut Estimates<C::Sample>,
        cost: &mut Cost,
    ) {
        self.nested
            .estimate(scene, sampler, starts, estimates, cost);
    }
}
