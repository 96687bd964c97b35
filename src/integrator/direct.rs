//! `direct`: emission and light that arrives directly, by `emitter_samples` of the lights and
//! `bsdf_samples` of the material (`shading_samples`, 1, for both), combined by multiple importance
//! sampling. Equal to `path` at `max_depth` 2 in the mean. Whatever the camera meets is opaque, surroundings are not.
//! `hide_emitters`: see [`super::limits`].

use super::bounce::Bounces;
use super::limits;
use super::mis::power;
use super::wave::{Block, Contribution, Outcome, Shading, Wave, Ways};
use super::{Context, Cost, Estimate, Estimates, Estimator, Footprint, Start};
use crate::color::{ColorModel, Spectral as _};
use crate::description::Properties;
use crate::description::declared::{Plugin, integer};
use crate::error::Result;
use crate::lanes::{Lanes, MAX_LANES};
use crate::material::Surface;
use crate::sampler::Sampler;
use crate::scene::Scene;

/// The settings.
#[derive(Clone, Debug)]
pub struct Direct {
    emitter_samples: u32,
    bsdf_samples: u32,
    hide_emitters: bool,
    footprint: Option<Footprint>,
}

/// About how many samples of a kind are in memory at once.
const SAMPLES: usize = 1 << 14;

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

    pub(super) fn build(properties: &Properties<'_>, context: &Context) -> Result<Self> {
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
            footprint: context.footprint.clone(),
        })
    }

    /// The shares of the samples of lights and of the material in both.
    fn shares(&self) -> [f32; 2] {
        let both = (self.emitter_samples + self.bsdf_samples) as f32;
        [self.emitter_samples, self.bsdf_samples].map(|samples| samples as f32 / both)
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
        let nothing = Estimate {
            radiance: C::Sample::zero(),
            alpha: 0.0,
        };
        estimates.values.clear();
        estimates.values.resize(starts.len(), nothing);
        let most = self.emitter_samples.max(self.bsdf_samples) as usize;
        let together = (SAMPLES / most).max(MAX_LANES);
        let parts = starts.chunks(together);
        for (starts, estimates) in parts.zip(estimates.values.chunks_mut(together)) {
            let wave = Wave::new(scene, sampler, starts).with_cones(self.footprint.as_ref());
            self.estimate_part(wave, estimates, cost);
        }
    }
}

impl Direct {
    fn estimate_part<C: ColorModel>(
        &self,
        mut wave: Wave<'_, C, Contribution<C::Sample>>,
        estimates: &mut [Estimate<C::Sample>],
        cost: &mut Cost,
    ) {
        wave.trace(0, self.hide_emitters, cost);
        for (slot, met) in wave.met() {
            estimates[slot].alpha = if met { 1.0 } else { 0.0 };
        }
        wave.arrive(|walker, mut arrival| {
            arrival.hides_surroundings = self.hide_emitters;
            arrival.add_to(&mut estimates[walker.slot as usize]);
        });
        let bounces = Bounces {
            decisions: self.emitter_samples + self.bsdf_samples,
        };
        let Some(first) = bounces.first(0) else {
            return;
        };
        let mut bounce = Bounce(self);
        let light = |_: &mut Bounce<'_>, shadow: &Contribution<C::Sample>| {
            shadow.add_to(estimates);
        };
        wave.shade(first, self.emitter_samples, &mut bounce, light, cost);
        wave.trace(1, false, cost);
        wave.arrive(|walker, arrival| arrival.add_to(&mut estimates[walker.slot as usize]));
    }
}

/// The samples of both kinds.
struct Bounce<'a>(&'a Direct);

impl<C: ColorModel> Shading<C> for Bounce<'_> {
    type Shadow = Contribution<C::Sample>;

    #[inline(always)]
    fn shade<F: Lanes>(&mut self, block: &Block<'_, C, F>, out: &mut Outcome<'_, C, Self::Shadow>) {
        let surface = block.material.surface(&block.at, block.wavelengths);
        if block.material.is_smooth() {
            for number in 0..self.0.emitter_samples {
                self.light(block, &surface, number, out);
            }
        }
        for number in 0..self.0.bsdf_samples {
            self.way(block, &surface, self.0.emitter_samples + number, out);
        }
    }
}

impl Bounce<'_> {
    /// Draws light toward the points.
    #[inline(always)]
    fn light<C: ColorModel, F: Lanes>(
        &self,
        block: &Block<'_, C, F>,
        surface: &Surface<'_, C, F>,
        decision: u32,
        out: &mut Outcome<'_, C, Contribution<C::Sample>>,
    ) {
        let numbers = block.decisions(decision);
        let (u2, u1) = (numbers.u2(), numbers.u1());
        let (at, w) = (&block.at, block.wavelengths);
        let light = block.scene.sample_lights(at, u1, u2, w);
        let wo = at.frame.to_local(light.direction);
        let value = surface.eval(wo);
        let [light_share, bsdf_share] = self.0.shares().map(F::splat);
        let other = F::select(light.delta, F::zero(), value.pdf * bsdf_share);
        let count = F::splat(self.0.emitter_samples as f32);
        let weight = power(light.pdf * light_share, other) / (light.pdf * count);
        let contribution = block.throughput * value.value * light.radiance * weight;
        out.light(block, &light, contribution);
    }

    /// Looks for light where the material scatters to.
    #[inline(always)]
    fn way<C: ColorModel, F: Lanes>(
        &self,
        block: &Block<'_, C, F>,
        surface: &Surface<'_, C, F>,
        decision: u32,
        out: &mut Outcome<'_, C, Contribution<C::Sample>>,
    ) {
        let numbers = block.decisions(decision);
        let sample = surface.sample(numbers.lobe(surface), numbers.u2());
        let [light_share, bsdf_share] = self.0.shares();
        let part = F::splat(1.0 / self.0.bsdf_samples as f32);
        let ways = Ways {
            lives: sample.drawn & block.at.active,
            wo: sample.wo,
            throughput: block.throughput * sample.weight * part,
            eta: sample.eta,
            pdf: sample.pdf * F::splat(bsdf_share),
            delta: sample.delta,
            light_share,
        };
        out.send(block, &ways);
    }
}
