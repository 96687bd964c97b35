//! `phong`: the textbook's equation, I = I_a·k_a + Σ I_i·[k_d·max(0, L·N) + k_s·max(0, R·V)ⁿ] (Phong,
//! *Illumination for computer generated pictures*, 1975), with a shadow ray to every light at every hit, and
//! mirrors and clear boundaries followed as in Whitted, *An improved illumination model for shaded display*
//! (1980), but one ray at a time: where his tree splits, one branch is chosen and weighted.
//!
//! I_i is the intensity of a point light in the direction of the point, the irradiance that a directional
//! light brings, and of area lights the integral of L·cos θ·dA over what can be seen of them, one point of
//! which is drawn. With `falloff` `none` (default) that is all; `inverse_square` divides by the squared
//! distance. An environment brings the integral of L·dω. There is no π: against `path`, a matte surface is π
//! times as bright. `shadows` (true) may be switched off; `max_depth`, `rr_depth` and
//! `hide_emitters` are those of `path`;
//! `layers` takes the image apart, see [`super::layers`].

use super::arrival::{Arrival, look_through_emitters, opacity_at_start};
use super::bounce::{Bounces, Decision};
use super::layers::{Layers, Term};
use super::limits::{self, Limits};
use super::{Context, Cost, Estimate, Estimates, Estimator, Start};
use crate::color::{ColorModel, Spectral};
use crate::description::Properties;
use crate::description::declared::{Plugin, boolean, choice, string};
use crate::error::Result;
use crate::interaction::{Interaction, Ray};
use crate::light::LightSample;
use crate::sampler::{Sampler, Stream};
use crate::scene::Scene;

/// The settings.
#[derive(Clone, Debug)]
pub struct Phong {
    limits: Limits,
    hide_emitters: bool,
    falloff: Falloff,
    shadows: bool,
    layers: Layers,
}

/// How light fades on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Falloff {
    None,
    InverseSquare,
}

const FALLOFFS: &[&str] = &["none", "inverse_square"];

/// Shadow rays that are asked about at once: a scene may have any number of lights.
const SHADOWS: usize = 1 << 14;

/// A chain of mirrors and boundaries on its way.
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
}

/// A light's terms, whose visibility is still to be asked.
#[derive(Clone, Copy, Debug)]
struct Shadow<S> {
    ray: Ray,
    diffuse: S,
    specular: S,
    slot: u32,
    light: u32,
}

/// What a batch has come to so far.
#[derive(Debug)]
struct Batch<'a, S> {
    layers: &'a Layers,
    /// How many layers there are.
    count: usize,
    values: &'a mut Vec<Estimate<S>>,
    /// For each start a value a layer.
    sums: Vec<S>,
    shadows: Vec<Shadow<S>>,
    blocked: Vec<bool>,
}

impl<S: Spectral> Batch<'_, S> {
    fn add(&mut self, slot: u32, layer: Option<usize>, value: S) {
        let slot = slot as usize;
        self.values[slot].radiance += value;
        if let Some(layer) = layer {
            self.sums[slot * self.count + layer] += value;
        }
    }

    fn light(&mut self, shadow: &Shadow<S>) {
        let light = shadow.light as usize;
        let layers = self.layers;
        self.add(
            shadow.slot,
            layers.place(Term::Diffuse, light),
            shadow.diffuse,
        );
        self.add(
            shadow.slot,
            layers.place(Term::Specular, light),
            shadow.specular,
        );
    }

    /// Adds what the lights bring that can be seen.
    fn flush<C: ColorModel<Sample = S>>(&mut self, scene: &Scene<C>, cost: &mut Cost) {
        let rays: Vec<Ray> = self.shadows.iter().map(|s| s.ray).collect();
        cost.occluded(scene, &rays, &mut self.blocked);
        let mut shadows = std::mem::take(&mut self.shadows);
        for (i, shadow) in shadows.iter().enumerate() {
            if !self.blocked[i] {
                self.light(shadow);
            }
        }
        shadows.clear();
        self.shadows = shadows;
    }
}

impl Phong {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "Phong's equation as textbooks have it, unnormalised",
        properties: &[
            limits::COMMON,
            limits::LIMITS,
            &[
                choice("falloff", FALLOFFS, "how light weakens with distance"),
                boolean(
                    "shadows",
                    true,
                    "whether lights are hidden by what stands before them",
                ),
                string(
                    "layers",
                    "",
                    "terms, lights or both, parted by commas: EXR layers",
                ),
            ],
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, context: &Context) -> Result<Self> {
        let falloff = match properties.choice("falloff")? {
            "inverse_square" => Falloff::InverseSquare,
            _ => Falloff::None,
        };
        Ok(Self {
            limits: Limits::build(properties)?,
            hide_emitters: properties.boolean("hide_emitters")?,
            falloff,
            shadows: properties.boolean("shadows")?,
            layers: Layers::build(properties, &context.lights)?,
        })
    }

    /// Adds what the ray's end brings: emission, ambient light, opacity.
    fn arrive<C: ColorModel>(
        &self,
        arrival: &Arrival<'_, '_, C>,
        slot: u32,
        batch: &mut Batch<'_, C::Sample>,
    ) {
        if let (Some(light), Some(emission)) = (arrival.light(), arrival.emission()) {
            let layer = self.layers.place(Term::Emission, light.index());
            batch.add(slot, layer, emission);
        }
        if let Some(ambient) = arrival.ambient() {
            batch.add(slot, self.layers.ambient(), ambient);
        }
        if arrival.is_opaque() {
            batch.values[slot as usize].alpha = 1.0;
        }
    }

    /// The terms of one light at a point, as if nothing stood between.
    fn light<C: ColorModel>(
        &self,
        scene: &Scene<C>,
        sampler: &Sampler,
        light: usize,
        walker: &mut Walker<C>,
        at: &Interaction<'_>,
    ) -> Option<Shadow<C::Sample>> {
        let Decision { u2, .. } = Decision::next(&mut walker.stream, sampler);
        let w = &walker.wavelengths;
        let LightSample {
            direction,
            target,
            radiance,
            pdf,
            ..
        } = scene.lights()[light].sample(at.reference(), u2, w)?;
        let wo = at.frame.to_local(direction);
        let terms = scene.material(at).phong(at, at.wi, wo, w)?;
        // What a light sample brings has the inverse square in it.
        let squared = match (self.falloff, target) {
            (Falloff::None, Some(target)) => target.distance_squared(at.position),
            _ => 1.0,
        };
        let intensity = walker.throughput * radiance * (squared / pdf);
        let (diffuse, specular) = (intensity * terms.diffuse, intensity * terms.specular);
        let dark = diffuse.is_black() && specular.is_black();
        (!dark).then(|| Shadow {
            ray: target.map_or_else(|| at.spawn(direction), |target| at.spawn_to(target)),
            diffuse,
            specular,
            slot: walker.slot,
            light: light as u32,
        })
    }

    /// Follows a mirror or a clear boundary at `at`; whether there is one.
    fn follow<C: ColorModel>(
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
        let Some(sample) = sample.filter(|sample| sample.delta) else {
            return false;
        };
        walker.eta *= sample.eta;
        walker.ray = at.spawn(at.frame.to_world(sample.wo));
        let throughput = walker.throughput * sample.weight;
        let draw = || walker.stream.next_1d(sampler);
        match self.limits.roulette(depth, throughput, walker.eta, draw) {
            Some(throughput) => walker.throughput = throughput,
            None => return false,
        }
        true
    }
}

impl<C: ColorModel> Estimator<C> for Phong {
    fn extra_channels(&self) -> Vec<String> {
        let names = self.layers.names();
        let channels = names
            .iter()
            .flat_map(|name| ["R", "G", "B"].map(|c| format!("{name}.{c}")));
        channels.collect()
    }

    fn estimate(
        &self,
        scene: &Scene<C>,
        sampler: &Sampler,
        starts: &[Start<C>],
        estimates: &mut Estimates<C::Sample>,
        cost: &mut Cost,
    ) {
        let nothing = Estimate {
            radiance: C::Sample::zero(),
            alpha: match self.limits.max_depth {
                0 => 0.0,
                _ => opacity_at_start(scene, self.hide_emitters),
            },
        };
        estimates.values.clear();
        estimates.values.resize(starts.len(), nothing);
        let count = self.layers.names().len();
        let mut batch = Batch {
            layers: &self.layers,
            count,
            values: &mut estimates.values,
            sums: vec![C::Sample::zero(); starts.len() * count],
            shadows: Vec::new(),
            blocked: Vec::new(),
        };
        let walker = |(slot, start): (usize, &Start<C>)| Walker {
            ray: start.ray,
            throughput: scene.color().unit(),
            wavelengths: start.wavelengths,
            stream: start.stream,
            slot: slot as u32,
            eta: 1.0,
        };
        let mut walkers: Vec<Walker<C>> = starts.iter().enumerate().map(walker).collect();
        let lights = scene.lights().len();
        let bounces = Bounces {
            decisions: lights as u32 + 1,
        };
        let (mut rays, mut hits) = (Vec::new(), Vec::new());
        for depth in 0..self.limits.max_depth {
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
                let at = (!hit.is_miss()).then(|| scene.interaction(ray, hit));
                let slot = walker.slot as usize;
                let arrival = Arrival {
                    scene,
                    ray,
                    at: at.as_ref(),
                    wavelengths: &walker.wavelengths,
                    throughput: walker.throughput,
                    scattered: None,
                    hides_surroundings: self.hide_emitters && batch.values[slot].alpha == 0.0,
                };
                self.arrive(&arrival, walker.slot, &mut batch);
                let Some(at) = at.filter(|_| depth + 1 < self.limits.max_depth) else {
                    return false;
                };
                cost.stats.shaded += 1;
                if bounces.begin(&mut walker.stream, depth).is_none() {
                    return false;
                }
                let smooth = scene.material(&at).is_smooth();
                for light in (0..lights).filter(|_| smooth) {
                    match self.light(scene, sampler, light, walker, &at) {
                        Some(shadow) if self.shadows => batch.shadows.push(shadow),
                        Some(shadow) => batch.light(&shadow),
                        None => {}
                    }
                    if batch.shadows.len() == SHADOWS {
                        batch.flush(scene, cost);
                    }
                }
                self.follow(scene, sampler, depth, walker, &at, &mut batch.values[slot])
            });
            batch.flush(scene, cost);
        }

        let sums = batch.sums;
        estimates.extra.clear();
        let mut developed = vec![0.0; scene.color().channels().len()];
        for (i, sum) in sums.iter().enumerate() {
            let w = &starts[i / count].wavelengths;
            scene.color().develop(sum, w, &mut developed);
            estimates.extra.extend_from_slice(&developed[..3]);
        }
    }
}
