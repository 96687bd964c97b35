//! `ptracer`: light tracing. Paths set out from lights and are connected with the sensor from every surface that they come
//! to; the camera's own rays see lights and surroundings alone. What only the camera's mirrors and glasses show stays dark,
//! as in Mitsuba; caustics on what is not are found soon.
//!
//! `max_depth`, `rr_depth` and `hide_emitters`: see [`super::limits`].

use super::lens::Lens;
use super::light_paths::LightPaths;
use super::limits::{self, Limits};
use super::wave::Wave;
use super::{Context, Cost, Estimates, Estimator, Start};
use crate::color::ColorModel;
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::light::Light;
use crate::sampler::Sampler;
use crate::scene::Scene;

/// The light tracer's settings.
#[derive(Clone, Debug)]
pub struct PTracer {
    limits: Limits,
    hide_emitters: bool,
    lens: Lens,
}

impl PTracer {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "paths from the lights, connected with the camera",
        properties: &[limits::COMMON, limits::LIMITS],
    };

    pub(super) fn build(properties: &Properties<'_>, context: &Context) -> Result<Self> {
        Ok(Self {
            limits: Limits::build(properties)?,
            hide_emitters: properties.boolean("hide_emitters")?,
            lens: Lens::wanted(properties, context)?,
        })
    }
}

impl<C: ColorModel> Estimator<C> for PTracer {
    fn leaves_out(&self, scene: &Scene<C>) -> Option<String> {
        let sends = |light: &&Light<C>| !light.sends_paths();
        let left = scene.lights().iter().filter(sends).count();
        (left > 0).then(|| {
            format!("ptracer leaves out {left} lights: area lights that move, and those on curves and on cones")
        })
    }

    fn traces_light(&self) -> bool {
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
        let values = &mut estimates.values;
        values.clear();
        values.resize(starts.len(), self.limits.start(scene, self.hide_emitters));
        if self.limits.max_depth > 0 {
            let mut wave = Wave::<C, ()>::new(scene, sampler, starts);
            wave.trace(0, self.hide_emitters, cost);
            for (slot, met) in wave.met() {
                values[slot].alpha = values[slot].alpha.max(if met { 1.0 } else { 0.0 });
            }
            wave.arrive(|walker, mut arrival| {
                let estimate = &mut values[walker.slot as usize];
                arrival.hides_surroundings = self.hide_emitters && estimate.alpha == 0.0;
                arrival.add_to(estimate);
            });
        }
        estimates.splats.clear();
        LightPaths {
            scene,
            sampler,
            lens: &self.lens,
            limits: &self.limits,
            ball: scene.ball(),
            hide_emitters: self.hide_emitters,
            weighted: false,
        }
        .trace(starts, &mut estimates.splats, cost);
    }
}
