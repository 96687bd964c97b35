//! `path`: unidirectional path tracing (Kajiya, *The rendering equation*, 1986) with one light sample a
//! bounce, multiple importance sampling and Russian roulette.
//!
//! `max_depth`, `rr_depth` and `hide_emitters`: see [`super::limits`].

use super::arrival::{Arrival, Scattered, look_through_emitters, opacity_at_start};
use super::bounce::{Bounces, Decision};
use super::limits::{self, Limits};
use super::mis::power;
use super::{Context, Cost, Estimate, Estimates, Estimator, Start};
use crate::color::{ColorModel, Spectral};
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::interaction::{Interaction, Ray};
use crate::light::LightSample;
use crate::sampler::{Sampler, Stream};
use crate::scene::Scene;

/// The path tracer's settings.
#[derive(Clone, Copy, Debug, Default)]
pub struct Path {
    limits: Limits,
    hide_emitters: bool,
}

/// A bounce decides on a light and on the way on.
const BOUNCES: Bounces = Bounces { decisions: 2 };

/// A path on its way.
#[derive(Clone, Copy, Debug)]
struct Walker<C: ColorModel> {
    ray: Ray,
    throughput: C::Sample,
    wavelengths: C::Wavelengths,
    stream: Stream,
    /// Index of the start, and of the estimate.
    slot: u32,
    /// Product of the indices of refraction passed.
    eta: f32,
    /// Where the ray was scattered, unless at the camera or into a delta lobe.
    scattered: Option<Scattered>,
}

/// A light sample whose visibility is still to be asked.
#[derive(Clone, Copy, Debug)]
struct Shadow<S> {
    ray: Ray,
    contribution: S,
    slot: u32,
}

impl Path {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "paths: emission, light samples and material samples",
        properties: &[limits::COMMON, limits::LIMITS],
    };

    pub(super) fn build(properties: &Properties<'_>, _context: &Context) -> Result<Self> {
        Ok(Self {
            limits: Limits::build(properties)?,
            hide_emitters: properties.boolean("hide_emitters")?,
        })
    }

    /// Light drawn toward `at`, if any may arrive.
    fn light<C: ColorModel>(
        scene: &Scene<C>,
        sampler: &Sampler,
        walker: &mut Walker<C>,
        at: &Interaction<'_>,
    ) -> Option<Shadow<C::Sample>> {
        let Decision { u2, u1 } = Decision::next(&mut walker.stream, sampler);
        let material = scene.material(at);
        if !material.is_smooth() {
            return None;
        }
        let LightSample {
            direction,
            target,
            radiance,
            pdf,
            delta,
        } = scene.sample_light(at.position, u1, u2, &walker.wavelengths)?;
        let value = material.eval(at, at.wi, at.frame.to_local(direction), &walker.wavelengths)?;
        let weight = if delta { 1.0 } else { power(pdf, value.pdf) };
        let contribution = walker.throughput * value.value * radiance * (weight / pdf);
        if contribution.is_black() {
            return None;
        }
        let ray = match target {
            Some(target) => at.spawn_to(target),
            None => at.spawn(direction),
        };
        Some(Shadow {
            ray,
            contribution,
            slot: walker.slot,
        })
    }

    /// Turns the path at `at`; whether it goes on.
    fn scatter<C: ColorModel>(
        &self,
        scene: &Scene<C>,
        sampler: &Sampler,
        depth: u32,
        walker: &mut Walker<C>,
        at: &Interaction<'_>,
        estimate: &mut Estimate<C::Sample>,
    ) -> bool {
        let Decision { u2, u1 } = Decision::next(&mut walker.stream, sampler);
        let material = scene.material(at);
        let sample = material.sample(at, at.wi, u1, u2, &walker.wavelengths);
        if !sample.is_some_and(|sample| sample.null) {
            estimate.alpha = 1.0;
        }
        let Some(sample) = sample else {
            return false;
        };
        walker.eta *= sample.eta;
        walker.ray = at.spawn(at.frame.to_world(sample.wo));
        walker.scattered = (!sample.delta).then_some(Scattered {
            from: at.position,
            pdf: sample.pdf,
            light_share: 1.0,
        });
        let throughput = walker.throughput * sample.weight;
        let draw = || walker.stream.next_1d(sampler);
        match self.limits.roulette(depth, throughput, walker.eta, draw) {
            Some(throughput) => walker.throughput = throughput,
            None => return false,
        }
        true
    }
}

impl<C: ColorModel> Estimator<C> for Path {
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
        let alpha = match self.limits.max_depth {
            0 => 0.0,
            _ => opacity_at_start(scene, self.hide_emitters),
        };
        let radiance = C::Sample::zero();
        estimates.resize(starts.len(), Estimate { radiance, alpha });
        if self.limits.max_depth == 0 {
            return;
        }
        let mut walkers: Vec<Walker<C>> = starts
            .iter()
            .enumerate()
            .map(|(slot, start)| Walker {
                ray: start.ray,
                throughput: scene.color().unit(),
                wavelengths: start.wavelengths,
                stream: start.stream,
                slot: slot as u32,
                eta: 1.0,
                scattered: None,
            })
            .collect();
        let (mut rays, mut hits) = (Vec::new(), Vec::new());
        let mut shadows: Vec<Shadow<C::Sample>> = Vec::with_capacity(starts.len());
        let mut blocked = Vec::new();
        for depth in 0.. {
            if walkers.is_empty() {
                break;
            }
            rays.clear();
            rays.extend(walkers.iter().map(|w| w.ray));
            cost.closest(scene, depth, &rays, &mut hits);

            if depth == 0 && self.hide_emitters {
                look_through_emitters(scene, &mut rays, &mut hits, cost);
            }

            let mut ends = rays.iter().zip(&hits);
            walkers.retain_mut(|walker| {
                let (ray, hit) = ends.next().expect("every walker has its ray");
                let estimate = &mut estimates[walker.slot as usize];
                let at = (!hit.is_miss()).then(|| scene.interaction(ray, hit));
                let arrival = Arrival {
                    scene,
                    ray,
                    at: at.as_ref(),
                    wavelengths: &walker.wavelengths,
                    throughput: walker.throughput,
                    scattered: walker.scattered,
                    hides_surroundings: self.hide_emitters && estimate.alpha == 0.0,
                };
                arrival.add_to(estimate);
                let Some(at) = at.filter(|_| depth + 1 < self.limits.max_depth) else {
                    return false;
                };
                cost.stats.shaded += 1;
                if BOUNCES.begin(&mut walker.stream, depth).is_none() {
                    return false;
                }
                shadows.extend(Self::light(scene, sampler, walker, &at));
                self.scatter(scene, sampler, depth, walker, &at, estimate)
            });

            cost.occluded(scene, shadows.iter().map(|s| s.ray), &mut blocked);
            for (shadow, _) in shadows
                .drain(..)
                .zip(&blocked)
                .filter(|(_, blocked)| !**blocked)
            {
                estimates[shadow.slot as usize].radiance += shadow.contribution;
            }
        }
    }
}
