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

use super::bounce::Bounces;
use super::limits::Limits;
use super::wave::{Outcome, Walker, Wave};
use super::{Cost, Estimates, Start};
use crate::color::{ColorModel, Spectra, Spectral};
use crate::description::NodeId;
use crate::lanes::Lanes;
use crate::sampler::Sampler;
use crate::scene::{MediumId, Scene};

use segments::{Segment, Segments};
use surfaces::Surfaces;

/// The settings.
#[derive(Clone, Copy, Debug)]
pub(super) struct Volumetric {
    pub(super) limits: Limits,
    pub(super) hide_emitters: bool,
    /// The node of the medium that the camera stands in.
    pub(super) medium: Option<NodeId>,
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
}

/// A value over a density; 0 where that is none.
fn over<S: Spectral>(value: S, density: f32) -> S {
    match density > 0.0 {
        true => value / density,
        false => S::zero(),
    }
}

/// A path of this integrator.
type Path<C> = Walker<C, Carried<<C as ColorModel>::Sample>>;

impl Volumetric {
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
        let mut wave = Wave::carrying(scene, sampler, starts, |start| Carried {
            medium,
            hero: match scene.medium_count() {
                0 => 0,
                _ => (start.stream.number(sampler, HERO) * channels) as u32,
            },
            depth: 0,
            density: unit,
            asked: unit,
        });
        let mut segments = Segments::new(scene);
        let mut stopped = Vec::new();
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
                wave.before(&mut stopped, |paths, hits, out, stopped| {
                    flights::fly(flights::Round {
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
                        },
                        stopped,
                        estimates,
                    });
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
