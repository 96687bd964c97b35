//! `direct`: emission and light that arrives directly, by `emitter_samples` of the lights and
//! `bsdf_samples` of the material (`shading_samples`, 1, for both), combined by multiple importance
//! sampling. Equal to `path` at `max_depth` 2 in the mean. Whatever the camera meets is opaque, surroundings are not.
//! `hide_emitters`: see [`super::limits`].

use super::arrival::{Arrival, Scattered, look_through_emitters};
use super::bounce::{Bounces, Decision};
use super::limits;
use super::mis::power;
use super::{Context, Cost, Estimate, Estimates, Estimator, Start};
use crate::color::{ColorModel, Spectral};
use crate::description::Properties;
use crate::description::declared::{Plugin, integer};
use crate::error::Result;
use crate::interaction::Ray;
use crate::sampler::Sampler;
use crate::scene::Scene;

/// The settings.
#[derive(Clone, Copy, Debug)]
pub struct Direct {
    emitter_samples: u32,
    bsdf_samples: u32,
    hide_emitters: bool,
}

/// A sample of the light or of the material, still to be traced.
#[derive(Clone, Copy, Debug)]
struct Probe<S> {
    ray: Ray,
    /// What light found there is multiplied by; of a light sample, the light itself is in it.
    factor: S,
    slot: u32,
    /// For a material's sample, unless that is a delta.
    scattered: Option<Scattered>,
}

/// The most samples of a kind.
const MAX_SAMPLES: f64 = 4096.0;

impl Direct {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "direct light",
        properties: &[
            limits::COMMON,
            &[
                integer(
                    "shading_samples",
                    1,
                    "samples of either kind; not beside the other two",
                )
                .between(0.0, MAX_SAMPLES),
                integer("emitter_samples", 1, "samples of lights")
                    .between(0.0, MAX_SAMPLES)
                    .absent("shading_samples"),
                integer("bsdf_samples", 1, "samples of materials")
                    .between(0.0, MAX_SAMPLES)
                    .absent("shading_samples"),
            ],
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, _context: &Context) -> Result<Self> {
        let shading = properties.integer("shading_samples")?;
        let count = |name| -> Result<u32> { Ok(properties.given(name)?.unwrap_or(shading) as u32) };
        if properties.has("shading_samples") {
            for name in ["emitter_samples", "bsdf_samples"] {
                if properties.has(name) {
                    return Err(properties.error(
                        name,
                        format!("{name} and shading_samples exclude each other"),
                    ));
                }
            }
        }
        let (emitter_samples, bsdf_samples) = (count("emitter_samples")?, count("bsdf_samples")?);
        if emitter_samples + bsdf_samples == 0 {
            return Err(properties.error(
                "bsdf_samples",
                "direct needs at least one sample of either kind",
            ));
        }
        let hide_emitters = properties.boolean("hide_emitters")?;
        Ok(Self {
            emitter_samples,
            bsdf_samples,
            hide_emitters,
        })
    }

    /// The share of samples of a kind in both.
    fn share(&self, samples: u32) -> f32 {
        samples as f32 / (self.emitter_samples + self.bsdf_samples) as f32
    }
}

impl<C: ColorModel> Estimator<C> for Direct {
    fn estimate(
        &self,
        scene: &Scene<C>,
        sampler: &Sampler,
        starts: &[Start<C>],
        estimates: &mut Estimates<C::Sample>,
        cost: &mut Cost,
    ) {
        let estimates = &mut estimates.values;
        estimates.clear();
        let (light_share, bsdf_share) = (
            self.share(self.emitter_samples),
            self.share(self.bsdf_samples),
        );
        let (mut rays, mut hits): (Vec<Ray>, _) =
            (starts.iter().map(|s| s.ray).collect(), Vec::new());
        cost.closest(scene, 0, &rays, &mut hits);

        if self.hide_emitters {
            look_through_emitters(scene, &mut rays, &mut hits, cost);
        }

        let bounces = Bounces {
            decisions: self.emitter_samples + self.bsdf_samples,
        };
        let mut shadows: Vec<Probe<C::Sample>> = Vec::new();
        let mut probes: Vec<Probe<C::Sample>> = Vec::new();
        for (slot, ((start, ray), hit)) in starts.iter().zip(&rays).zip(&hits).enumerate() {
            let (w, slot) = (&start.wavelengths, slot as u32);
            let at = (!hit.is_miss()).then(|| scene.interaction(ray, hit));
            let mut estimate = Estimate {
                radiance: C::Sample::zero(),
                alpha: if at.is_some() { 1.0 } else { 0.0 },
            };
            let arrival = Arrival {
                scene,
                ray,
                at: at.as_ref(),
                wavelengths: w,
                throughput: scene.color().unit(),
                scattered: None,
                hides_surroundings: self.hide_emitters,
            };
            arrival.add_to(&mut estimate);
            estimates.push(estimate);
            let Some(at) = at else { continue };
            cost.stats.shaded += 1;
            let material = scene.material(&at);
            let mut stream = start.stream;
            if bounces.begin(&mut stream, 0).is_none() {
                continue;
            }
            for _ in 0..self.emitter_samples {
                let Decision { u2, u1 } = Decision::next(&mut stream, sampler);
                let Some(light) = scene.sample_light(at.reference(), u1, u2, w) else {
                    continue;
                };
                let Some(value) = material.eval(&at, at.wi, at.frame.to_local(light.direction), w)
                else {
                    continue;
                };
                let other = if light.delta {
                    0.0
                } else {
                    value.pdf * bsdf_share
                };
                let weight = power(light.pdf * light_share, other)
                    / (light.pdf * self.emitter_samples as f32);
                let factor = scene.color().unit() * value.value * light.radiance * weight;
                if !factor.is_black() {
                    let ray = light
                        .target
                        .map_or_else(|| at.spawn(light.direction), |target| at.spawn_to(target));
                    shadows.push(Probe {
                        ray,
                        factor,
                        slot,
                        scattered: None,
                    });
                }
            }
            for _ in 0..self.bsdf_samples {
                let Decision { u2, u1 } = Decision::next(&mut stream, sampler);
                let Some(sample) = material.sample(&at, at.wi, u1, u2, w) else {
                    continue;
                };
                let factor = scene.color().unit() * sample.weight / self.bsdf_samples as f32;
                let ray = at.spawn(at.frame.to_world(sample.wo));
                let scattered = (!sample.delta).then_some(Scattered {
                    from: at.position,
                    pdf: sample.pdf * bsdf_share,
                    light_share,
                });
                probes.push(Probe {
                    ray,
                    factor,
                    slot,
                    scattered,
                });
            }
        }

        let mut blocked = Vec::new();
        let shadow_rays: Vec<Ray> = shadows.iter().map(|s| s.ray).collect();
        cost.occluded(scene, &shadow_rays, &mut blocked);
        for (shadow, _) in shadows
            .iter()
            .zip(&blocked)
            .filter(|(_, blocked)| !**blocked)
        {
            estimates[shadow.slot as usize].radiance += shadow.factor;
        }

        rays.clear();
        rays.extend(probes.iter().map(|p| p.ray));
        cost.closest(scene, 1, &rays, &mut hits);
        for (probe, hit) in probes.iter().zip(&hits) {
            let w = &starts[probe.slot as usize].wavelengths;
            let at = (!hit.is_miss()).then(|| scene.interaction(&probe.ray, hit));
            let arrival = Arrival {
                scene,
                ray: &probe.ray,
                at: at.as_ref(),
                wavelengths: w,
                throughput: probe.factor,
                scattered: probe.scattered,
                hides_surroundings: false,
            };
            arrival.add_to(&mut estimates[probe.slot as usize]);
        }
    }
}
