//! `path`: unidirectional path tracing (Kajiya, *The rendering equation*, 1986) with one light sample a
//! bounce, multiple importance sampling and Russian roulette.
//!
//! `max_depth` counts edges: 1 is emission seen directly, 2 direct light, −1 (default) no limit.
//! Roulette starts at `rr_depth` (5) and lets a path live with probability min(max(throughput)·η², 0.95).

use super::mis::power;
use super::{Context, Cost, Estimate, Estimates, Estimator, FIRST_DIMENSION, Start};
use crate::color::{ColorModel, Spectral};
use crate::description::Properties;
use crate::error::Result;
use crate::interaction::{Interaction, Ray};
use crate::light::LightSample;
use crate::sampler::{Sampler, Stream};
use crate::scene::Scene;
use glam::Vec3;

/// The path tracer's settings.
#[derive(Clone, Copy, Debug, Default)]
pub struct Path {
    limits: Limits,
    hide_emitters: bool,
}

/// How long a path may become: `max_depth` and `rr_depth`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Edges; `u32::MAX` is no limit.
    pub(super) max_depth: u32,
    rr_depth: u32,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_depth: u32::MAX,
            rr_depth: 5,
        }
    }
}

impl Limits {
    pub(super) fn build(properties: &Properties<'_>) -> Result<Self> {
        let depth = |name: &'static str, default: i64, least: i64| {
            let depth = properties.integer(name)?.unwrap_or(default);
            if depth < least {
                return Err(properties.error(
                    name,
                    format!("{name} must be at least {least}, and {depth} is not"),
                ));
            }
            Ok(u32::try_from(depth).unwrap_or(u32::MAX))
        };
        Ok(Self {
            max_depth: depth("max_depth", -1, -1)?,
            rr_depth: depth("rr_depth", 5, 1)?,
        })
    }

    /// The probability with which roulette lets a path live on after its bounce at `depth`; `None` where it
    /// carries nothing.
    pub(super) fn survival<S: Spectral>(&self, depth: u32, throughput: S, eta: f32) -> Option<f32> {
        if throughput.is_black() {
            return None;
        }
        if depth + 1 < self.rr_depth {
            return Some(1.0);
        }
        Some((throughput.max_value() * eta * eta).min(MAX_SURVIVAL))
    }
}

/// Dimensions of a bounce, in fours: the point on a light, which light, and one to spare; the direction, the
/// lobe, roulette.
const DIMENSIONS: u32 = 8;
/// The longest life that roulette grants.
const MAX_SURVIVAL: f32 = 0.95;

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
    /// Where the ray was scattered and with what density, unless at the camera or into a delta lobe.
    scattered: Option<(Vec3, f32)>,
}

/// A light sample whose visibility is still to be asked.
#[derive(Clone, Copy, Debug)]
struct Shadow<S> {
    ray: Ray,
    contribution: S,
    slot: u32,
}

impl Path {
    pub(super) fn build(properties: &Properties<'_>, _context: &Context) -> Result<Self> {
        Ok(Self {
            limits: Limits::build(properties)?,
            hide_emitters: properties.boolean("hide_emitters")?.unwrap_or(false),
        })
    }

    /// Adds to the estimate what comes from the ray's end: the point `at`, or the surroundings.
    fn arrive<C: ColorModel>(
        &self,
        scene: &Scene<C>,
        depth: u32,
        walker: &Walker<C>,
        at: Option<&Interaction<'_>>,
        estimate: &mut Estimate<C::Sample>,
    ) {
        let hidden = depth == 0 && self.hide_emitters;
        let from = walker.scattered.map_or(walker.ray.origin, |(from, _)| from);
        let emission = match at {
            Some(at) => scene.emitted(at, from, &walker.wavelengths),
            None => scene.surrounding(walker.ray.direction, &walker.wavelengths),
        };
        if let Some((radiance, light_pdf)) = emission.filter(|_| !hidden) {
            let weight = walker
                .scattered
                .map_or(1.0, |(_, pdf)| power(pdf, light_pdf));
            estimate.radiance += walker.throughput * radiance * weight;
        }
        let ambient = |at| scene.ambient(at, &walker.wavelengths);
        if let Some(ambient) = at.and_then(ambient) {
            estimate.radiance += walker.throughput * ambient;
        }
        if depth == 0 {
            let surrounded = scene.has_environment() && !self.hide_emitters;
            estimate.alpha = if at.is_some() || surrounded { 1.0 } else { 0.0 };
        }
    }

    /// Light drawn toward `at`, if any may arrive.
    fn light<C: ColorModel>(
        scene: &Scene<C>,
        sampler: &Sampler,
        walker: &mut Walker<C>,
        at: &Interaction<'_>,
    ) -> Option<Shadow<C::Sample>> {
        let u2 = walker.stream.next_2d(sampler);
        let u1 = walker.stream.next_1d(sampler);
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
    ) -> bool {
        let u2 = walker.stream.next_2d(sampler);
        let u1 = walker.stream.next_1d(sampler);
        let material = scene.material(at);
        let Some(sample) = material.sample(at, at.wi, u1, u2, &walker.wavelengths) else {
            return false;
        };
        walker.throughput *= sample.weight;
        walker.eta *= sample.eta;
        walker.ray = at.spawn(at.frame.to_world(sample.wo));
        walker.scattered = (!sample.delta).then_some((at.position, sample.pdf));
        let survival = self.limits.survival(depth, walker.throughput, walker.eta);
        let Some(survival) = survival else {
            return false;
        };
        if survival < 1.0 {
            if walker.stream.next_1d(sampler) >= survival {
                return false;
            }
            walker.throughput = walker.throughput / survival;
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
        estimates.resize(
            starts.len(),
            Estimate {
                radiance: C::Sample::zero(),
                alpha: 0.0,
            },
        );
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

            let mut hits = hits.iter();
            walkers.retain_mut(|walker| {
                let hit = hits.next().expect("every ray has its hit");
                let estimate = &mut estimates[walker.slot as usize];
                if hit.is_miss() {
                    self.arrive(scene, depth, walker, None, estimate);
                    return false;
                }
                let at = scene.interaction(&walker.ray, hit);
                self.arrive(scene, depth, walker, Some(&at), estimate);
                if depth + 1 >= self.limits.max_depth {
                    return false;
                }
                cost.stats.shaded += 1;
                walker.stream.seek(FIRST_DIMENSION + depth * DIMENSIONS);
                shadows.extend(Self::light(scene, sampler, walker, &at));
                self.scatter(scene, sampler, depth, walker, &at)
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
