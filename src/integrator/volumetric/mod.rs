//! Paths through participating media. In each round all paths are traced to the next surface; those in a medium draw how
//! far they get ([`flights`]); those that come through arrive and are shaded ([`surfaces`]); light that was asked for is
//! followed through media and surfaces that let it pass ([`segments`]).
//!
//! A path's densities are carried as ratios to that of its hero channel, so that what any technique and any hero would
//! have done is weighed by the balance heuristic: a contribution is divided by the mean, over channels, of all densities
//! that might have led there (Miller, Georgiev and Jarosz, *A null-scattering path integral formulation of light
//! transport*, 2019; Pharr, Jakob and Humphreys, *PBRT* 4th ed., 14.2).

mod flights;
mod segments;
mod surfaces;

use super::bounce::{Bounces, Decisions};
use super::limits::{self, Limits};
use super::runs::Runs;
use super::wave::{Outcome, Walker, Wave};
use super::{Context, Cost, Estimates, Footprint, Start};
use crate::color::{ColorModel, Spectra, Spectral};
use crate::description::{NodeId, Properties};
use crate::error::Result;
use crate::interaction::{Hit, Ray};
use crate::lanes::{Ints, Lanes, Mask as _, Vec3};
use crate::medium::Way;
use crate::sampler::Sampler;
use crate::scene::{MediumId, Scene};

use segments::{Segment, Segments};
use surfaces::Surfaces;

/// The settings.
#[derive(Clone, Debug)]
pub(super) struct Volumetric {
    pub(super) limits: Limits,
    pub(super) hide_emitters: bool,
    /// The node of the medium that the camera stands in.
    pub(super) medium: Option<NodeId>,
    pub(super) footprint: Option<Footprint>,
}

/// A round decides on a light, on the way on and on how far a path gets.
const ROUNDS: Bounces = Bounces { decisions: 3 };
/// The first decision.
const LIGHT: u32 = 0;
/// The second.
const WAY: u32 = 1;
/// The third.
const FLIGHT: u32 = 2;
/// The dimension, of those that the camera leaves, that chooses the hero.
const HERO: u32 = 6;
/// Dimensions after a round's first whose numbers no sampler places: for flights and for segments.
const FLIGHT_DRAWS: u32 = 8;
const SEGMENT_DRAWS: u32 = 9;

/// What a path carries beside its throughput, which is over the hero's density.
#[derive(Clone, Copy, Debug)]
pub(super) struct Carried<S> {
    /// Where it is.
    medium: Option<MediumId>,
    /// The index of its channel.
    hero: u32,
    /// How often it was scattered, by more than a passage straight on.
    depth: u32,
    /// Each channel's density of the path, over the hero's; 0 for channels that are not in use.
    density: S,
    /// The same of a path that came by light sampling to where this one comes next, but for the density of its light.
    asked: S,
}

/// The mean over the channels in use.
#[derive(Clone, Copy, Debug)]
struct Mean {
    share: f32,
}

impl Mean {
    fn of<C: ColorModel>(color: &C) -> Self {
        let unit = color.unit();
        let count: f32 = (0..C::Sample::LANES).map(|channel| unit[channel]).sum();
        Self { share: 1.0 / count }
    }

    /// Of a sample that is 0 in channels that are not in use.
    fn one<S: Spectral>(self, sample: S) -> f32 {
        (0..S::LANES).map(|channel| sample[channel]).sum::<f32>() * self.share
    }

    #[inline(always)]
    fn lanes<F: Lanes, S: Spectra<F>>(self, samples: S) -> F {
        let mut sum = samples[0];
        for channel in 1..S::CHANNELS {
            sum = sum + samples[channel];
        }
        sum * F::splat(self.share)
    }

    /// Roulette for those paths that play, of these densities: which live on, and with which throughputs.
    #[inline(always)]
    fn roulette<F: Lanes, S: Spectra<F>>(
        self,
        plays: F::Mask,
        throughput: S,
        densities: S,
        eta: F,
        decision: &Decisions<'_, F>,
    ) -> (F::Mask, S) {
        if !plays.any() {
            return (F::Mask::splat(true), throughput);
        }
        let density = self.lanes(densities);
        let survival = limits::survival(throughput * (F::one() / density), eta);
        let lives = !plays | decision.survival().lt(survival);
        let grown = throughput * F::select(plays, F::one() / survival, F::one());
        (lives, grown)
    }
}

/// A value over a density; 0 where that is none.
fn over<S: Spectral>(value: S, density: f32) -> S {
    match density > 0.0 {
        true => value / density,
        false => S::zero(),
    }
}

/// Some of the rays, on their way to what they hit, through one medium.
#[inline(always)]
fn way<'a, C: ColorModel, F: Lanes>(
    rays: &[Ray],
    hits: &[Hit],
    indices: &[u32],
    hero: impl Fn(usize) -> u32,
    wavelengths: &'a [C::Wavelengths],
) -> Way<'a, C, F> {
    let (mut origins, mut directions) = ([F::ROW; 3], [F::ROW; 3]);
    let (mut ends, mut heroes) = (F::ROW, F::Int::ROW);
    for (lane, index) in indices.iter().enumerate() {
        let index = *index as usize;
        let ray = &rays[index];
        for axis in 0..3 {
            origins[axis][lane] = ray.origin[axis];
            directions[axis][lane] = ray.direction[axis];
        }
        (ends[lane], heroes[lane]) = (hits[index].t, hero(index));
    }
    Way {
        active: F::Mask::from_bits(!(u32::MAX << indices.len())),
        origin: Vec3::<F>::load(&origins),
        direction: Vec3::<F>::load(&directions),
        end: F::load(&ends),
        hero: F::Int::load(&heroes),
        wavelengths,
    }
}

/// A path of this integrator.
type Path<C> = Walker<C, Carried<<C as ColorModel>::Sample>>;

impl Volumetric {
    /// What both plugins read.
    pub(super) fn build(properties: &Properties<'_>, context: &Context) -> Result<Self> {
        Ok(Self {
            limits: Limits::build(properties)?,
            hide_emitters: properties.boolean("hide_emitters")?,
            medium: context.medium,
            footprint: context.footprint.clone(),
        })
    }

    /// See [`super::Estimator::estimate`].
    pub(super) fn estimate<C: ColorModel>(
        &self,
        scene: &Scene<C>,
        sampler: &Sampler,
        starts: &[Start<C>],
        estimates: &mut Estimates<C::Sample>,
        cost: &mut Cost,
    ) {
        let estimates = &mut estimates.values;
        estimates.clear();
        estimates.resize(starts.len(), self.limits.start(scene, self.hide_emitters));
        if self.limits.max_depth == 0 {
            return;
        }
        let unit = scene.color().unit();
        let mean = Mean::of(scene.color());
        let channels = 1.0 / mean.share;
        let medium = self.medium.and_then(|node| scene.medium_of(node));
        let mut wave = Wave::carrying(scene, sampler, starts, |_, start| Carried {
            medium,
            hero: match scene.medium_count() {
                0 => 0,
                _ => (start.stream.number(sampler, HERO) * channels) as u32,
            },
            depth: 0,
            density: unit,
            asked: unit,
        })
        .with_cones(self.footprint.as_ref());
        let mut segments = Segments::new(scene);
        let (mut media, mut gets_there) = (Runs::new(scene.medium_count()), Vec::new());
        for round in 0.. {
            let Some(first) = ROUNDS.first(round) else {
                break;
            };
            if wave.is_over() {
                break;
            }
            let seen = |carried: &Carried<C::Sample>| carried.depth == 0;
            wave.trace_looking(round, self.hide_emitters, seen, cost);
            if scene.medium_count() > 0 {
                wave.before(&mut gets_there, |paths, hits, out, gets_there| {
                    let round = flights::Round {
                        scene,
                        sampler,
                        limits: &self.limits,
                        mean,
                        first,
                        paths,
                        hits,
                        out: Outcome {
                            shadows: &mut *out.shadows,
                            next: out.next,
                            cones: out.cones,
                        },
                        gets_there,
                        estimates,
                    };
                    round.fly(&mut media);
                    segments.settle(first, out.shadows, mean, estimates, cost);
                    out.shadows.clear();
                });
            }
            wave.arrive(|path, arrival| {
                let estimate = &mut estimates[path.slot as usize];
                let Carried {
                    depth,
                    density,
                    asked,
                    ..
                } = path.media;
                if self.hide_emitters && depth == 0 {
                    return;
                }
                let densities = |light_pdf: f32| match path.scattered {
                    None => density,
                    Some(_) => density + asked * light_pdf,
                };
                if let Some((radiance, light_pdf)) = arrival.emitted() {
                    let value = path.throughput * radiance;
                    estimate.radiance += over(value, mean.one(densities(light_pdf)));
                }
                if let Some(ambient) = arrival.ambient() {
                    estimate.radiance += over(ambient, mean.one(density));
                }
                if arrival.is_opaque() {
                    estimate.alpha = 1.0;
                }
            });
            let mut surfaces = Surfaces {
                limits: &self.limits,
                mean,
                estimates,
            };
            let settle = |surfaces: &mut Surfaces<'_, C>, shadows: &mut _, cost: &mut Cost| {
                segments.settle(first, shadows, mean, surfaces.estimates, cost);
            };
            wave.shade_and(first, 1, &mut surfaces, settle, cost);
        }
    }
}
