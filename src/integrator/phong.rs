//! `phong`: the textbook's equation, I = I_a·k_a + Σ I_i·[k_d·max(0, L·N) + k_s·max(0, R·V)ⁿ] (Phong,
//! *Illumination for computer generated pictures*, 1975), with a shadow ray to every light at every hit, and
//! mirrors and clear boundaries followed as in Whitted, *An improved illumination model for shaded display*
//! (1980), but one ray at a time: where his tree splits, one branch is chosen and weighted.
//!
//! I_i is the intensity of a point light in the direction of the point, the irradiance that a directional
//! light brings, and of area lights the integral of L·cos θ·dA over what can be seen of them, one point of
//! which is drawn. With `falloff` `none` (default) that is all; `inverse_square` divides by the squared
//! distance. An environment brings the integral of L·dω. There is no π: against `path`, a matte surface is π
//! times as bright, unless `falloff` is `radiometric`, which is `inverse_square` over π. `shadows` (true) may be switched off; `max_depth`, `rr_depth` and
//! `hide_emitters` are those of `path`;
//! `layers` takes the image apart, see [`super::layers`].

use std::f32::consts::FRAC_1_PI;

use super::arrival::Arrival;
use super::bounce::Bounces;
use super::layers::{Layers, Term};
use super::limits::{self, Limits};
use super::wave::{Block, Outcome, Shading, Wave, Ways};
use super::{Context, Cost, Estimate, Estimates, Estimator, Footprint, Start};
use crate::color::{ColorModel, Spectra as _, Spectral};
use crate::description::Properties;
use crate::description::declared::{Plugin, boolean, choice, string};
use crate::error::Result;
use crate::lanes::{Lanes, Mask as _};
use crate::sampler::Sampler;
use crate::scene::Scene;

/// The settings.
#[derive(Clone, Debug)]
pub struct Phong {
    limits: Limits,
    hide_emitters: bool,
    falloff: Falloff,
    shadows: bool,
    layers: Layers,
    footprint: Option<Footprint>,
}

/// How light fades on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Falloff {
    None,
    InverseSquare,
    Radiometric,
}

pub(super) const FALLOFFS: &[&str] = &["none", "inverse_square", "radiometric"];

/// A light's terms, whose visibility is still to be asked.
#[derive(Clone, Copy, Debug)]
struct Shadow<S> {
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
}

impl<S: Spectral> Batch<'_, S> {
    fn add(&mut self, slot: usize, layer: Option<usize>, value: S) {
        self.values[slot].radiance += value;
        if let Some(layer) = layer {
            self.sums[slot * self.count + layer] += value;
        }
    }

    fn light(&mut self, shadow: &Shadow<S>) {
        let (slot, light) = (shadow.slot as usize, shadow.light as usize);
        let layers = self.layers;
        self.add(slot, layers.place(Term::Diffuse, light), shadow.diffuse);
        self.add(slot, layers.place(Term::Specular, light), shadow.specular);
    }

    /// Adds what a ray's end brings: emission, ambient light, opacity.
    fn arrive<C: ColorModel<Sample = S>>(&mut self, slot: usize, arrival: &Arrival<'_, '_, C>) {
        let layers = self.layers;
        if let (Some(light), Some(emission)) = (
            arrival.light(),
            arrival.emission(|light_pdf| arrival.weight(light_pdf)),
        ) {
            self.add(slot, layers.place(Term::Emission, light.index()), emission);
        }
        if let Some(ambient) = arrival.ambient() {
            self.add(slot, layers.ambient(), ambient);
        }
        if arrival.is_opaque() {
            self.values[slot].alpha = 1.0;
        }
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
            "radiometric" => Falloff::Radiometric,
            _ => Falloff::None,
        };
        Ok(Self {
            limits: Limits::build(properties)?,
            hide_emitters: properties.boolean("hide_emitters")?,
            falloff,
            shadows: properties.boolean("shadows")?,
            layers: Layers::build(properties, &context.lights)?,
            footprint: context.footprint.clone(),
        })
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
        let nothing = self.limits.start(scene, self.hide_emitters);
        estimates.values.clear();
        estimates.values.resize(starts.len(), nothing);
        let count = self.layers.names().len();
        let mut batch = Batch {
            layers: &self.layers,
            count,
            values: &mut estimates.values,
            sums: vec![C::Sample::zero(); starts.len() * count],
        };
        let lights = scene.lights().len() as u32;
        let bounces = Bounces {
            decisions: lights + 1,
        };
        let mut wave = Wave::new(scene, sampler, starts).with_cones(self.footprint.as_ref());
        for depth in 0..self.limits.max_depth {
            if wave.is_over() {
                break;
            }
            wave.trace(depth, self.hide_emitters, cost);
            wave.arrive(|walker, mut arrival| {
                let slot = walker.slot as usize;
                arrival.hides_surroundings = self.hide_emitters && batch.values[slot].alpha == 0.0;
                batch.arrive(slot, &arrival);
            });
            let Some(first) = bounces.first(depth) else {
                break;
            };
            if depth + 1 == self.limits.max_depth {
                break;
            }
            let mut bounce = Bounce {
                phong: self,
                lights,
                depth,
                batch: &mut batch,
            };
            let light = |bounce: &mut Bounce<'_, '_, C::Sample>, shadow: &Shadow<C::Sample>| {
                bounce.batch.light(shadow);
            };
            wave.shade(first, lights, &mut bounce, light, cost);
        }

        let sums = batch.sums;
        estimates.extra.clear();
        let mut developed = vec![0.0; scene.color().channels().len()];
        for (i, sum) in sums.iter().enumerate() {
            let Start {
                pass, wavelengths, ..
            } = &starts[i / count];
            (scene.color()).develop(*pass, sum, wavelengths, &mut developed);
            estimates.extra.extend_from_slice(&developed[..3]);
        }
    }
}

/// A bounce: all lights, and the way through a mirror or a clear boundary.
struct Bounce<'a, 'b, S> {
    phong: &'a Phong,
    lights: u32,
    depth: u32,
    batch: &'a mut Batch<'b, S>,
}

impl<C: ColorModel> Shading<C> for Bounce<'_, '_, C::Sample> {
    type Shadow = Shadow<C::Sample>;

    #[inline(always)]
    fn shade<F: Lanes>(&mut self, block: &Block<'_, C, F>, out: &mut Outcome<'_, C, Self::Shadow>) {
        if block.material.is_smooth() {
            for light in 0..self.lights {
                self.light(block, light, out);
            }
        }
        self.follow(block, out);
    }
}

impl<S: Spectral> Bounce<'_, '_, S> {
    /// The terms of one light.
    #[inline(always)]
    fn light<C: ColorModel<Sample = S>, F: Lanes>(
        &mut self,
        block: &Block<'_, C, F>,
        light: u32,
        out: &mut Outcome<'_, C, Shadow<S>>,
    ) {
        let u2 = block.decisions(light).u2();
        let (at, w) = (&block.at, block.wavelengths);
        let from = &block.scene.lights()[light as usize];
        let sample = from.sample_lanes(at, u2, w, at.active);
        let wo = at.frame.to_local(sample.direction);
        let terms = block.material.phong_lanes(at, at.wi, wo, w);
        // What a light sample brings has the inverse square in it.
        let squared = match self.phong.falloff {
            Falloff::None => {
                let squared = (sample.target - at.position).length_squared();
                F::select(sample.distant, F::one(), squared)
            }
            Falloff::InverseSquare => F::one(),
            Falloff::Radiometric => F::splat(FRAC_1_PI),
        };
        let intensity = block.throughput * sample.radiance * (squared / sample.pdf);
        let (diffuse, specular) = (intensity * terms.diffuse, intensity * terms.specular);
        let dark = diffuse.is_black() & specular.is_black();
        let lit = at.active & F::zero().lt(sample.pdf) & !dark;
        let (diffuse, specular) = (diffuse.rows(), specular.rows());
        let shadow = |lane| Shadow {
            diffuse: C::Columns::<F>::of(&diffuse, lane),
            specular: C::Columns::<F>::of(&specular, lane),
            slot: block.walker(lane).slot,
            light,
        };
        if self.phong.shadows {
            out.ask(block, &sample, lit, shadow);
        } else {
            for lane in lit.lanes() {
                self.batch.light(&shadow(lane));
            }
        }
    }

    /// Follows mirrors and clear boundaries.
    #[inline(always)]
    fn follow<C: ColorModel<Sample = S>, F: Lanes>(
        &mut self,
        block: &Block<'_, C, F>,
        out: &mut Outcome<'_, C, Shadow<S>>,
    ) {
        let numbers = block.decisions(self.lights);
        let (u2, u1) = (numbers.u2(), numbers.u1());
        let (at, w) = (&block.at, block.wavelengths);
        let sample = block.material.sample_lanes(at, at.wi, u1, u2, w);
        for lane in (at.active & !(sample.drawn & sample.null)).lanes() {
            self.batch.values[block.walker(lane).slot as usize].alpha = 1.0;
        }
        let eta = block.eta() * sample.eta;
        let throughput = block.throughput * sample.weight;
        let limits = &self.phong.limits;
        let (lives, throughput) = limits.roulette(self.depth, throughput, eta, &numbers);
        let ways = Ways {
            lives: lives & sample.drawn & sample.delta & at.active,
            wo: sample.wo,
            throughput,
            eta,
            pdf: sample.pdf,
            // Lights are not found by chance.
            delta: F::Mask::splat(true),
            light_share: 1.0,
        };
        out.send(block, &ways);
    }
}
