//! `bdpt`: paths from the camera and paths from the lights, weighted against each other by multiple importance sampling
//! (Veach and Guibas, *Bidirectional estimators for light transport*, 1994; Lafortune and Willems, *Bi-directional path
//! tracing*, 1993). The two are joined at their ends: paths from the camera meet lights or draw them, as those of `path` do,
//! and paths from lights are connected with the sensor; surfaces of the one are not connected with surfaces of the other. So
//! caustics, which `path` finds by chance, come from the lights, and what mirrors and glasses show comes from the camera.
//!
//! `max_depth`, `rr_depth` and `hide_emitters`: see [`super::limits`]. How paths are weighted: [`super::light_paths`].

use super::arrival::Arrival;
use super::bounce::Bounces;
use super::lens::Lens;
use super::light_paths::LightPaths;
use super::limits::{self, Limits};
use super::mis::power_of_three;
use super::wave::{Block, Contribution, Outcome, Shading, Walker, Wave, Ways};
use super::{Context, Cost, Estimate, Estimates, Estimator, Footprint, Start};
use crate::color::ColorModel;
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::lanes::{Lanes, Mask as _, Vec3};
use crate::light::{Ball, LightSamples, Seen};
use crate::sampler::Sampler;
use crate::scene::{LightId, Scene};

/// The settings.
#[derive(Clone, Debug)]
pub struct Bdpt {
    limits: Limits,
    hide_emitters: bool,
    lens: Lens,
    footprint: Option<Footprint>,
}

/// A bounce decides on a light and on the way on.
const BOUNCES: Bounces = Bounces { decisions: 2 };
/// The first decision.
const LIGHT: u32 = 0;
/// The second.
const WAY: u32 = 1;

/// What a path carries: how dense the paths from lights are that make it, relative to this one, without the factors of its
/// last surface.
type FromLights = f32;

impl Bdpt {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "paths from the camera and from the lights, joined at their ends",
        properties: &[limits::COMMON, limits::LIMITS],
    };

    pub(super) fn build(properties: &Properties<'_>, context: &Context) -> Result<Self> {
        Ok(Self {
            limits: Limits::build(properties)?,
            hide_emitters: properties.boolean("hide_emitters")?,
            lens: Lens::wanted(properties, context)?,
            footprint: context.footprint.clone(),
        })
    }
}

impl<C: ColorModel> Estimator<C> for Bdpt {
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
        let Estimates { values, splats, .. } = estimates;
        values.clear();
        values.resize(starts.len(), self.limits.start(scene, self.hide_emitters));
        let ball = scene.ball();
        let wave = Wave::carrying(scene, sampler, starts, |_, _| 0.0);
        let mut wave = wave.with_cones(self.footprint.as_ref());
        for depth in 0..self.limits.max_depth {
            if wave.is_over() {
                break;
            }
            wave.trace(depth, self.hide_emitters, cost);
            wave.arrive(|walker, mut arrival| {
                let estimate = &mut values[walker.slot as usize];
                arrival.hides_surroundings = self.hide_emitters && estimate.alpha == 0.0;
                arrival.add_weighted(estimate, |light_pdf| {
                    weight(&ball, walker, &arrival, depth, light_pdf)
                });
            });
            let Some(first) = BOUNCES.first(depth) else {
                break;
            };
            if depth + 1 == self.limits.max_depth {
                break;
            }
            let mut bounce = Bounce {
                integrator: self,
                ball,
                depth,
                estimates: values,
            };
            let light = |bounce: &mut Bounce<'_, C>, shadow: &Contribution<C::Sample>| {
                shadow.add_to(bounce.estimates);
            };
            wave.shade(first, 1, &mut bounce, light, cost);
        }
        splats.clear();
        LightPaths {
            scene,
            sampler,
            lens: &self.lens,
            limits: &self.limits,
            ball,
            hide_emitters: self.hide_emitters,
            weighted: true,
        }
        .trace(starts, splats, cost);
    }
}

/// The weight of light that a path has met, which light sampling finds with density `light_pdf`.
fn weight<C: ColorModel>(
    ball: &Ball,
    walker: &Walker<C, FromLights>,
    arrival: &Arrival<'_, '_, C>,
    depth: u32,
    light_pdf: f32,
) -> f32 {
    // What the camera sees without a surface between, no other path brings.
    let Some(light) = arrival.light().filter(|_| depth > 0) else {
        return 1.0;
    };
    let seen = Seen {
        direction: arrival.ray.direction,
        position: arrival.ray.origin,
        distance: arrival.at.map_or(f32::INFINITY, |at| at.t),
        pdf: light_pdf,
        time: arrival.ray.time,
    };
    let from_lights = arrival.scene.emission_density(ball, light, &seen) * walker.media;
    let drawn = arrival.scattered.map_or(0.0, |s| light_pdf / s.pdf);
    power_of_three(drawn, from_lights)
}

/// A bounce: a light sample and a way on.
struct Bounce<'a, C: ColorModel> {
    integrator: &'a Bdpt,
    ball: Ball,
    depth: u32,
    estimates: &'a mut [Estimate<C::Sample>],
}

type Outgoing<'o, C> = Outcome<'o, C, Contribution<<C as ColorModel>::Sample>, FromLights>;

impl<C: ColorModel> Shading<C, FromLights> for Bounce<'_, C> {
    type Shadow = Contribution<C::Sample>;

    #[inline(always)]
    fn shade<F: Lanes>(&mut self, block: &Block<'_, C, F, FromLights>, out: &mut Outgoing<'_, C>) {
        let at = &block.at;
        let toward = at.frame.to_world(at.wi);
        let cos_in = at.normal.dot(toward).abs();
        let from_lights = match self.depth {
            0 => F::one() / (self.integrator.lens.density(at, toward) * cos_in),
            _ => self.carried(block) / cos_in,
        };
        if block.material.is_smooth() {
            self.light(block, from_lights, out);
        }
        self.way(block, from_lights, out);
    }
}

impl<C: ColorModel> Bounce<'_, C> {
    #[inline(always)]
    fn carried<F: Lanes>(&self, block: &Block<'_, C, F, FromLights>) -> F {
        let mut row = F::ROW;
        for lane in block.at.lanes() {
            row[lane] = block.walker(lane).media;
        }
        F::load(&row)
    }

    /// The factor of a surface whose light comes from `wo`: how it would be left toward where the path came from, if it was
    /// not the camera.
    #[inline(always)]
    fn back<F: Lanes>(&self, block: &Block<'_, C, F, FromLights>, wo: Vec3<F>) -> F {
        match self.depth {
            0 => F::one(),
            _ => {
                let at = &block.at;
                let value = block.material.eval_lanes(at, wo, at.wi, block.wavelengths);
                value.pdf
            }
        }
    }

    /// Draws light toward the points.
    #[inline(always)]
    fn light<F: Lanes>(
        &self,
        block: &Block<'_, C, F, FromLights>,
        from_lights: F,
        out: &mut Outgoing<'_, C>,
    ) {
        let numbers = block.decisions(LIGHT);
        let (u2, u1) = (numbers.u2(), numbers.u1());
        let (at, w) = (&block.at, block.wavelengths);
        let (light, lights) = block.scene.sample_chosen_lights(at, u1, u2, w);
        let wo = at.frame.to_local(light.direction);
        let value = block.material.eval_lanes(at, at.wi, wo, w);
        let met = F::select(light.delta, F::zero(), value.pdf / light.pdf);
        let cos_out = at.normal.dot(light.direction).abs();
        let density = self.density(block, &light, |lane| lights[lane]);
        let traced = density * from_lights * self.back(block, wo) * (cos_out / light.pdf);
        let weight = power_of_three(met, traced);
        let contribution = block.throughput * value.value * light.radiance * (weight / light.pdf);
        out.light(block, &light, contribution);
    }

    /// How densely paths come from the lights that were drawn.
    #[inline(always)]
    fn density<F: Lanes>(
        &self,
        block: &Block<'_, C, F, FromLights>,
        light: &LightSamples<F, C::Columns<F>>,
        index: impl Fn(usize) -> u32,
    ) -> F {
        let (positions, directions) = (block.at.position.rows(), light.direction.rows());
        let (targets, pdfs) = (light.target.rows(), light.pdf.row());
        let distant = light.distant.to_bits();
        let mut density = F::ROW;
        for lane in (block.at.active & F::zero().lt(light.pdf)).lanes() {
            let position = Vec3::<F>::of(&positions, lane);
            let seen = Seen {
                direction: Vec3::<F>::of(&directions, lane),
                position,
                distance: match distant >> lane & 1 {
                    1 => f32::INFINITY,
                    _ => position.distance(Vec3::<F>::of(&targets, lane)),
                },
                pdf: pdfs[lane],
                time: block.at.source.time(lane),
            };
            let light = LightId::new(index(lane));
            density[lane] = block.scene.emission_density(&self.ball, light, &seen);
        }
        F::load(&density)
    }

    /// Turns the paths.
    #[inline(always)]
    fn way<F: Lanes>(
        &mut self,
        block: &Block<'_, C, F, FromLights>,
        from_lights: F,
        out: &mut Outgoing<'_, C>,
    ) {
        let numbers = block.decisions(WAY);
        let (u2, u1) = (numbers.u2(), numbers.u1());
        let (at, w) = (&block.at, block.wavelengths);
        let sample = block.material.sample_lanes(at, at.wi, u1, u2, w);
        for lane in (at.active & !(sample.drawn & sample.null)).lanes() {
            self.estimates[block.walker(lane).slot as usize].alpha = 1.0;
        }
        let eta = block.eta() * sample.eta;
        let throughput = block.throughput * sample.weight;
        let limits = &self.integrator.limits;
        let (lives, throughput) = limits.roulette(self.depth, throughput, eta, &numbers);
        let lives = lives & sample.drawn & at.active;
        if !lives.any() {
            return;
        }
        let cos_out = at.normal.dot(at.frame.to_world(sample.wo)).abs();
        let mut carried = match self.depth {
            // The sensor is not connected with what has no choice of directions.
            0 => F::zero(),
            _ => from_lights * cos_out,
        };
        if block.material.is_smooth() {
            let smooth = from_lights * self.back(block, sample.wo) * (cos_out / sample.pdf);
            carried = F::select(sample.delta, carried, smooth);
        }
        let carried = carried.row();
        let ways = Ways {
            lives,
            wo: sample.wo,
            throughput,
            eta,
            pdf: sample.pdf,
            delta: sample.delta,
            light_share: 1.0,
        };
        out.send_changed(block, &ways, |lane, _, walker| {
            walker.media = carried[lane];
        });
    }
}
