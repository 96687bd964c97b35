//! `heterogeneous`: a medium whose extinction varies over a volume's box and is nothing beyond it. Distances are drawn by
//! delta tracking, transmittances estimated by ratio tracking (Novák et al., *Monte Carlo methods for volumetric light
//! transport simulation*, 2018), both with bounds that hold nearby.

use super::majorants::{Majorants, March, inside};
use super::{BlockMedium, COMMON, Common, Flight, Matter, Way, hero, optical_depth};
use crate::color::{ColorModel, Spectra};
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::lanes::{Lanes, Mask as _};
use crate::sampler::Draws;
use crate::texture::Palettes;

/// Varying over space.
#[derive(Clone, Debug)]
pub struct Heterogeneous<C: ColorModel> {
    common: Common<C>,
    /// `None` where extinction is the same in all of the box.
    majorants: Option<Majorants>,
}

/// Thicker media would be tracked for ever.
const MOST_THICKNESS: f32 = 1e7;
/// Below, roulette ends a transmittance.
const FAINT: f32 = 0.05;
/// With that probability it goes on.
const SURVIVAL: f32 = 0.25;

impl<C: ColorModel> Heterogeneous<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a medium that varies over space",
        properties: &[COMMON],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let common = Common::build(properties, palettes)?;
        let varies = common.sigma_t.constant().is_none();
        let area = common.phase.most_area();
        let majorants = varies.then(|| Majorants::new(&common.sigma_t, common.scale * area));
        if let Some(majorants) = &majorants {
            let thickness = majorants.thickness();
            if thickness.is_nan() || thickness > MOST_THICKNESS {
                let message =
                    format!("an optical thickness of {thickness:e} is too much to be tracked");
                let error = properties.error("scale", message);
                return Err(error.help(format!("scale it to {MOST_THICKNESS:e} at most")));
            }
        }
        Ok(Self { common, majorants })
    }
}

impl<C: ColorModel> Matter<C> for Heterogeneous<C> {
    fn common(&self) -> &Common<C> {
        &self.common
    }
}

impl<C: ColorModel> BlockMedium<C> for Heterogeneous<C> {
    #[inline(always)]
    fn fly<F: Lanes>(
        &self,
        way: &Way<'_, C, F>,
        first: F,
        draws: Draws<F>,
    ) -> Flight<F, C::Columns<F>> {
        let Way {
            active,
            origin,
            direction,
            end,
            ..
        } = *way;
        let Some(majorants) = &self.majorants else {
            let bounds = self.common.sigma_t.bounds();
            let [enter, exit] = inside(&bounds, origin, direction, end);
            let within = Way {
                active: active & enter.lt(exit),
                end: exit.max(enter),
                ..*way
            };
            let flight = self.common.fly_evenly(&within, enter, first);
            return Flight {
                distance: F::select(flight.scattered, flight.distance, end),
                ..flight
            };
        };
        let is_grey = self.common.sigma_t.is_grey();
        let mut flight = Flight::through(end);
        let mut march = March::new(majorants, active, origin, direction, end);
        let mut tau = optical_depth(first);
        let mut number = 0;
        while march.alive.any() {
            let step = march.step(&mut tau);
            number += 2;
            if !step.collided.any() {
                continue;
            }
            let sigma = self.common.extinction(way, march.place());
            let own = hero(sigma, way.hero);
            let rest = (step.majorant - own).max(F::zero());
            let real = step.collided & (draws.number(number) * step.majorant).lt(own);
            let null = step.collided & !real;
            if !is_grey {
                let mut ratios = C::Columns::<F>::splat(F::one());
                for channel in 0..C::Columns::<F>::CHANNELS {
                    let other = sigma[channel];
                    let goes_on = (step.majorant - other).max(F::zero()) / rest;
                    let ratio = F::select(real, other / own, F::select(null, goes_on, F::one()));
                    ratios.set(channel, ratio);
                }
                flight.density = flight.density * ratios;
            }
            let asked = (flight.asked * (step.majorant / rest)).min(F::splat(1e30));
            flight.asked = F::select(null, asked, flight.asked);
            flight.distance = F::select(real, march.t, flight.distance);
            flight.scattered = flight.scattered | real;
            march.alive = march.alive & !real;
            tau = F::select(null, optical_depth(draws.number(number + 1)), tau);
        }
        self.common.scatter(way, flight)
    }

    #[inline(always)]
    fn transmit<F: Lanes>(&self, way: &Way<'_, C, F>, draws: Draws<F>) -> C::Columns<F> {
        let Way {
            active,
            origin,
            direction,
            end,
            ..
        } = *way;
        let Some(majorants) = &self.majorants else {
            let bounds = self.common.sigma_t.bounds();
            let [enter, exit] = inside(&bounds, origin, direction, end);
            return self
                .common
                .transmit_evenly(way, (exit - enter).max(F::zero()));
        };
        let mut transmittance = C::Columns::<F>::splat(F::one());
        let mut march = March::new(majorants, active, origin, direction, end);
        let mut number = 0;
        let mut tau = optical_depth(draws.number(0));
        while march.alive.any() {
            let step = march.step(&mut tau);
            number += 2;
            if !step.collided.any() {
                continue;
            }
            let sigma = self.common.extinction(way, march.place());
            let mut shares = C::Columns::<F>::splat(F::one());
            for channel in 0..C::Columns::<F>::CHANNELS {
                let share = (step.majorant - sigma[channel]).max(F::zero()) / step.majorant;
                shares.set(channel, F::select(step.collided, share, F::one()));
            }
            transmittance = transmittance * shares;
            let faint = step.collided & transmittance.max_value().lt(F::splat(FAINT));
            if faint.any() {
                let survives = draws.number(number).lt(F::splat(SURVIVAL));
                let factor = F::select(survives, F::splat(1.0 / SURVIVAL), F::zero());
                transmittance = transmittance * F::select(faint, factor, F::one());
                march.alive = march.alive & !(faint & !survives);
            }
            tau = F::select(step.collided, optical_depth(draws.number(number + 1)), tau);
        }
        transmittance
    }
}
