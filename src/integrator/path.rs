//! `path`: unidirectional path tracing (Kajiya, *The rendering equation*, 1986) with one light sample a
//! bounce, multiple importance sampling and Russian roulette.
//!
//! `max_depth`, `rr_depth` and `hide_emitters`: see [`super::limits`].

use super::bounce::{Bounces, Decisions};
use super::guide::{Cells, Guide};
use super::limits::{self, Limits};
use super::mis::power;
use super::wave::{Block, Contribution, Outcome, Shading, Wave, Ways};
use super::{Context, Cost, Estimate, Estimates, Estimator, Footprint, Start};
use crate::color::{ColorModel, Spectra as _};
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::lanes::{Lanes, Mask as _, Vec3};
use crate::material::{BsdfSamples, Surface};
use crate::sampler::Sampler;
use crate::scene::Scene;

/// The path tracer's settings.
#[derive(Clone, Debug, Default)]
pub struct Path {
    limits: Limits,
    hide_emitters: bool,
    footprint: Option<Footprint>,
}

/// A bounce decides on a light and on the way on.
const BOUNCES: Bounces = Bounces { decisions: 2 };
/// The first decision.
const LIGHT: u32 = 0;
/// The second.
const WAY: u32 = 1;

impl Path {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "paths: emission, light samples and material samples",
        properties: &[limits::COMMON, limits::LIMITS],
    };

    /// Mitsuba's, without a limit, seen by a camera.
    pub(super) fn seen_by(footprint: Option<Footprint>) -> Self {
        Self {
            footprint,
            ..Self::default()
        }
    }

    pub(super) fn build(properties: &Properties<'_>, context: &Context) -> Result<Self> {
        Ok(Self {
            limits: Limits::build(properties)?,
            hide_emitters: properties.boolean("hide_emitters")?,
            footprint: context.footprint.clone(),
        })
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
        self.follow(scene, sampler, starts, None, (estimates, cost));
    }
}

impl Path {
    /// The most edges of a path.
    pub(super) fn max_depth(&self) -> u32 {
        self.limits.max_depth
    }

    /// [`Estimator::estimate`], with paths that a guide leads, if there is one.
    pub(super) fn follow<C: ColorModel>(
        &self,
        scene: &Scene<C>,
        sampler: &Sampler,
        starts: &[Start<C>],
        guide: Option<&Guide>,
        (estimates, cost): (&mut Estimates<C::Sample>, &mut Cost),
    ) {
        let estimates = &mut estimates.values;
        estimates.clear();
        estimates.resize(starts.len(), self.limits.start(scene, self.hide_emitters));
        let mut wave = Wave::new(scene, sampler, starts).with_cones(self.footprint.as_ref());
        for depth in 0..self.limits.max_depth {
            if wave.is_over() {
                break;
            }
            wave.trace(depth, self.hide_emitters, cost);
            wave.arrive(|walker, mut arrival| {
                let estimate = &mut estimates[walker.slot as usize];
                arrival.hides_surroundings = self.hide_emitters && estimate.alpha == 0.0;
                arrival.add_to(estimate);
            });
            let Some(first) = BOUNCES.first(depth) else {
                break;
            };
            if depth + 1 == self.limits.max_depth {
                break;
            }
            let mut bounce = Bounce {
                limits: &self.limits,
                guide,
                depth,
                estimates,
            };
            let light = |bounce: &mut Bounce<'_, C>, shadow: &Contribution<C::Sample>| {
                shadow.add_to(bounce.estimates);
            };
            wave.shade(first, 1, &mut bounce, light, cost);
        }
    }
}

/// A bounce: a light sample and a way on.
struct Bounce<'a, C: ColorModel> {
    limits: &'a Limits,
    guide: Option<&'a Guide>,
    depth: u32,
    estimates: &'a mut [Estimate<C::Sample>],
}

impl<C: ColorModel> Shading<C> for Bounce<'_, C> {
    type Shadow = Contribution<C::Sample>;

    #[inline(always)]
    fn shade<F: Lanes>(&mut self, block: &Block<'_, C, F>, out: &mut Outcome<'_, C, Self::Shadow>) {
        let surface = block.material.surface(&block.at, block.wavelengths);
        let mut cells = None;
        if block.material.is_smooth() {
            if let Some(guide) = self.guide {
                let found = guide.cells(&block.at);
                cells = found.known.any().then_some(found);
            }
            self.light(block, &surface, cells.as_ref(), out);
        }
        self.way(block, &surface, cells.as_ref(), out);
    }
}

impl<C: ColorModel> Bounce<'_, C> {
    /// Draws light toward the points, where any may arrive.
    #[inline(always)]
    fn light<F: Lanes>(
        &self,
        block: &Block<'_, C, F>,
        surface: &Surface<'_, C, F>,
        cells: Option<&Cells<'_, F>>,
        out: &mut Outcome<'_, C, Contribution<C::Sample>>,
    ) {
        let numbers = block.decisions(LIGHT);
        let (u2, u1) = (numbers.u2(), numbers.u1());
        let (at, w) = (&block.at, block.wavelengths);
        let light = block.scene.sample_lights(at, u1, u2, w);
        let wo = at.frame.to_local(light.direction);
        let value = surface.eval(wo);
        let pdf = match cells {
            Some(cells) => cells.mixed(light.direction, value.pdf),
            None => value.pdf,
        };
        let weight = F::select(light.delta, F::one(), power(light.pdf, pdf));
        let contribution = block.throughput * value.value * light.radiance * (weight / light.pdf);
        out.light(block, &light, contribution);
    }

    /// Turns the paths.
    #[inline(always)]
    fn way<F: Lanes>(
        &mut self,
        block: &Block<'_, C, F>,
        surface: &Surface<'_, C, F>,
        cells: Option<&Cells<'_, F>>,
        out: &mut Outcome<'_, C, Contribution<C::Sample>>,
    ) {
        let numbers = block.decisions(WAY);
        let at = &block.at;
        let sample = match cells {
            Some(cells) => draw_guided(block, surface, cells, &numbers),
            None => surface.sample(numbers.lobe(surface), numbers.u2()),
        };
        for lane in (at.active & !(sample.drawn & sample.null)).lanes() {
            self.estimates[block.walker(lane).slot as usize].alpha = 1.0;
        }
        let eta = block.eta() * sample.eta;
        let throughput = block.throughput * sample.weight;
        let (lives, throughput) = self.limits.roulette(self.depth, throughput, eta, &numbers);
        let lives = lives & sample.drawn & at.active;
        if !lives.any() {
            return;
        }
        let ways = Ways {
            lives,
            wo: sample.wo,
            throughput,
            eta,
            pdf: sample.pdf,
            delta: sample.delta,
            light_share: 1.0,
        };
        out.send(block, &ways);
    }
}

/// Draws directions by the guide or by the material, and where there is no cell by the material alone.
#[inline(always)]
fn draw_guided<C: ColorModel, F: Lanes>(
    block: &Block<'_, C, F>,
    surface: &Surface<'_, C, F>,
    cells: &Cells<'_, F>,
    numbers: &Decisions<'_, F>,
) -> BsdfSamples<F, C::Columns<F>> {
    let (u2, u1) = (numbers.u2(), numbers.u1());
    let at = &block.at;
    let share = cells.share();
    let guided = u1.lt(share);
    let rest = F::one() - share;
    let below_one = F::splat(1f32.next_down());
    let lobe = ((u1 - share) / rest).max(F::zero()).min(below_one);
    let sample = surface.sample(lobe, u2);
    let toward = cells.sample(guided, u2, at.frame.to_world(sample.wo));
    let wo = Vec3::select(guided, at.frame.to_local(toward), sample.wo);
    let value = surface.eval(wo);
    let pdf = cells.mixed(toward, value.pdf);
    let delta = sample.delta & !guided;
    let mixed = cells.known & !delta;
    let weight = C::Columns::<F>::select(
        mixed,
        value.value * (F::one() / pdf),
        sample.weight * (F::one() / rest),
    );
    let possible = F::zero().lt(pdf) & pdf.is_finite();
    BsdfSamples {
        drawn: (guided | sample.drawn) & (possible | !mixed),
        wo,
        weight,
        pdf: F::select(mixed, pdf, sample.pdf * rest),
        eta: F::select(guided, F::one(), sample.eta),
        delta,
        null: sample.null & !guided,
    }
}
