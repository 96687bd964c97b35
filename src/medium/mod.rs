//! Participating media: how far light goes through them, and how it is scattered.
//!
//! A path's channels have one *hero*: distances are drawn by the hero's extinction, and the other channels are weighted by
//! what their densities would have been (Miller, Georgiev and Jarosz, *A null-scattering path integral formulation of
//! light transport*, 2019; Wilkie et al., *Hero wavelength spectral sampling*, 2014). All densities are told as ratios to
//! the hero's.

mod heterogeneous;
mod homogeneous;
mod majorants;

use crate::color::{ColorModel, Role, Spectra};
use crate::description::declared::{Row, boolean, float, nested, volume};
use crate::description::{Kind, Properties};
use crate::error::Result;
use crate::family::family;
use crate::lanes::{Call, Ints as _, Lanes, Mask as _, Vec3, exp, ln};
use crate::phase::Phase;
use crate::sampler::Draws;
use crate::texture::Palettes;
use crate::texture::volume::Volume;

/// What every medium does.
pub trait Matter<C: ColorModel>: std::fmt::Debug + Send + Sync {
    /// What it has like all others.
    fn common(&self) -> &Common<C>;
}

/// Rays through a medium.
#[derive(Clone, Copy, Debug)]
pub struct Way<'a, C: ColorModel, F: Lanes> {
    /// The lanes that there are.
    pub active: F::Mask,
    /// World space.
    pub origin: Vec3<F>,
    /// Unit length.
    pub direction: Vec3<F>,
    /// How far the medium goes at most; may be infinite.
    pub end: F,
    /// The path's hero among the channels.
    pub hero: F::Int,
    /// From the first lane on.
    pub wavelengths: &'a [C::Wavelengths],
}

/// How far light went, and what becomes of it there.
#[derive(Clone, Copy, Debug)]
pub struct Flight<F: Lanes, S> {
    /// Where it was scattered within the medium, and did not come to its end.
    pub scattered: F::Mask,
    /// How far it went.
    pub distance: F,
    /// What its radiance is multiplied by, over the hero's density.
    pub throughput: S,
    /// Radiance that is given where it was scattered, over the hero's density.
    pub emitted: S,
    /// Each channel's density of going so far, over the hero's.
    pub density: S,
    /// The density of asking so far by [`Medium::transmit`], over the hero's.
    pub asked: F,
}

impl<F: Lanes, S: Spectra<F>> Flight<F, S> {
    /// Through nothing.
    #[inline(always)]
    fn through(way_end: F) -> Self {
        Self {
            scattered: F::Mask::splat(false),
            distance: way_end,
            throughput: S::splat(F::one()),
            emitted: S::zero(),
            density: S::splat(F::one()),
            asked: F::one(),
        }
    }
}

/// A medium in lanes; all methods must be `#[inline(always)]`.
trait BlockMedium<C: ColorModel> {
    /// See [`Medium::fly`].
    fn fly<F: Lanes>(
        &self,
        way: &Way<'_, C, F>,
        first: F,
        draws: Draws<F>,
    ) -> Flight<F, C::Columns<F>>;

    /// See [`Medium::transmit`].
    fn transmit<F: Lanes>(&self, way: &Way<'_, C, F>, draws: Draws<F>) -> C::Columns<F>;
}

family! {
    /// Every medium there is.
    #[derive(Clone, Debug)]
    pub enum Medium<C>: Matter, context Palettes<C>, visitor Visitor {
        "heterogeneous" => Heterogeneous(heterogeneous::Heterogeneous<C>),
        "homogeneous" => Homogeneous(homogeneous::Homogeneous<C>),
    }
}

/// Something to be asked of whichever medium it is. `visit` must be `#[inline(always)]`.
trait Visitor<C: ColorModel> {
    type Output;

    fn visit<M: BlockMedium<C>>(self, medium: &M) -> Self::Output;
}

/// Asks a medium in a function that knows the instructions.
struct Ask<'a, C: ColorModel, V>(&'a Medium<C>, V);

impl<C: ColorModel, F: Lanes, V: Visitor<C>> Call<F> for Ask<'_, C, V> {
    type Output = V::Output;

    #[inline(always)]
    fn run(self) -> V::Output {
        self.0.visit(self.1)
    }
}

/// See [`Medium::fly`].
struct Fly<'a, C: ColorModel, F: Lanes>(&'a Way<'a, C, F>, F, Draws<F>);

impl<C: ColorModel, F: Lanes> Visitor<C> for Fly<'_, C, F> {
    type Output = Flight<F, C::Columns<F>>;

    #[inline(always)]
    fn visit<M: BlockMedium<C>>(self, medium: &M) -> Self::Output {
        medium.fly(self.0, self.1, self.2)
    }
}

/// See [`Medium::transmit`].
struct Transmit<'a, C: ColorModel, F: Lanes>(&'a Way<'a, C, F>, Draws<F>);

impl<C: ColorModel, F: Lanes> Visitor<C> for Transmit<'_, C, F> {
    type Output = C::Columns<F>;

    #[inline(always)]
    fn visit<M: BlockMedium<C>>(self, medium: &M) -> Self::Output {
        medium.transmit(self.0, self.1)
    }
}

impl<C: ColorModel> Medium<C> {
    /// How it scatters.
    pub fn phase(&self) -> &Phase {
        &self.common().phase
    }

    /// Whether it gives light.
    pub fn emits(&self) -> bool {
        self.common().emission.is_some()
    }

    /// Whether lights are sampled where it scatters.
    pub fn samples_emitters(&self) -> bool {
        self.common().sample_emitters
    }

    /// Draws how far light goes along rays: `first` is the random number of the first distance, `draws` gives all others.
    #[inline(always)]
    pub fn fly<F: Lanes>(
        &self,
        way: &Way<'_, C, F>,
        first: F,
        draws: Draws<F>,
    ) -> Flight<F, C::Columns<F>> {
        F::call(Ask(self, Fly(way, first, draws)))
    }

    /// Estimates the transmittance from the rays' origins to their ends; the same numbers are the densities with which
    /// [`Medium::fly`] goes that far, over that of asking so.
    #[inline(always)]
    pub fn transmit<F: Lanes>(&self, way: &Way<'_, C, F>, draws: Draws<F>) -> C::Columns<F> {
        F::call(Ask(self, Transmit(way, draws)))
    }
}

/// What both media have.
#[derive(Clone, Debug)]
pub struct Common<C: ColorModel> {
    /// Extinction per scene unit, before it is scaled.
    sigma_t: Volume<C>,
    /// The share of extinction that is scattering.
    albedo: Volume<C>,
    /// Radiance of what absorbs, if it gives any.
    emission: Option<Volume<C>>,
    scale: f32,
    phase: Phase,
    sample_emitters: bool,
}

/// What both media read.
const COMMON: &[Row] = &[
    volume("sigma_t", 1.0, "extinction per scene unit"),
    volume("albedo", 0.75, "the share of extinction that is scattering"),
    float("scale", 1.0, "what extinction is multiplied by").at_least(0.0),
    volume(
        "emission",
        0.0,
        "radiance of what absorbs: a thick medium glows like a surface that gives this",
    )
    .own(),
    nested(Kind::Phase, "how it scatters; isotropic without one"),
    boolean(
        "sample_emitters",
        true,
        "whether lights are sampled where it scatters",
    ),
    boolean(
        "has_spectral_extinction",
        true,
        "whether Mitsuba takes extinction to differ by channel",
    )
    .without_effect(),
];

impl<C: ColorModel> Common<C> {
    fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let phase = match properties.child(Kind::Phase)? {
            Some(phase) => Phase::build(&phase, &palettes.numbers)?,
            None => Phase::default(),
        };
        let volume = |name, role| Volume::named(properties, name, &palettes.colors, role);
        let emission = volume("emission", Role::Emission)?;
        Ok(Self {
            sigma_t: volume("sigma_t", Role::Quantity)?,
            albedo: volume("albedo", Role::Quantity)?,
            emission: properties.has("emission").then_some(emission),
            scale: properties.float("scale")? as f32,
            phase,
            sample_emitters: properties.boolean("sample_emitters")?,
        })
    }

    /// Extinction at places, at least 0.
    #[inline(always)]
    fn extinction<F: Lanes>(&self, way: &Way<'_, C, F>, at: Vec3<F>) -> C::Columns<F> {
        let area = self.phase.projected_area(at, -way.direction);
        let mut sigma =
            self.sigma_t.eval_lanes(at, way.wavelengths) * (area * F::splat(self.scale));
        for channel in 0..C::Columns::<F>::CHANNELS {
            sigma.set(channel, sigma[channel].max(F::zero()));
        }
        sigma
    }

    /// A flight through what is the same everywhere, from `start` on.
    #[inline(always)]
    fn fly_evenly<F: Lanes>(
        &self,
        way: &Way<'_, C, F>,
        start: F,
        first: F,
    ) -> Flight<F, C::Columns<F>> {
        let sigma = self.extinction(way, way.origin);
        let own = hero(sigma, way.hero);
        let far = optical_depth(first) / own;
        let length = way.end - start;
        let scattered = way.active & far.lt(length);
        let way_through = F::select(scattered, far, length.max(F::zero()));
        let mut density = C::Columns::<F>::splat(F::one());
        for channel in 0..C::Columns::<F>::CHANNELS {
            let other = sigma[channel];
            let difference = own - other;
            // Nothing times an infinite way is nothing.
            let depth = F::select(
                difference.eq(F::zero()),
                F::zero(),
                difference * way_through,
            );
            let collides = F::select(scattered, other / own, F::one());
            density.set(channel, exp(depth) * collides);
        }
        let depth = F::select(own.eq(F::zero()), F::zero(), own * way_through);
        let flight = Flight {
            scattered,
            distance: F::select(scattered, start + far, way.end),
            density,
            asked: exp(depth),
            ..Flight::through(way.end)
        };
        self.scatter(way, flight)
    }

    /// The flight with what becomes of light where it was scattered.
    #[inline(always)]
    fn scatter<F: Lanes>(
        &self,
        way: &Way<'_, C, F>,
        flight: Flight<F, C::Columns<F>>,
    ) -> Flight<F, C::Columns<F>> {
        let Flight {
            scattered, density, ..
        } = flight;
        let (mut throughput, mut emitted) = (density, flight.emitted);
        if scattered.any() {
            let at = way.origin + way.direction * flight.distance;
            let albedo = self.albedo.eval_lanes(at, way.wavelengths);
            throughput = C::Columns::<F>::select(scattered, density * albedo, density);
            if let Some(emission) = &self.emission {
                let mut absorbed = density;
                for channel in 0..C::Columns::<F>::CHANNELS {
                    let share = (F::one() - albedo[channel]).max(F::zero());
                    absorbed.set(channel, density[channel] * share);
                }
                let given = absorbed * emission.eval_lanes(at, way.wavelengths);
                emitted = C::Columns::<F>::select(scattered, given, emitted);
            }
        }
        Flight {
            throughput,
            emitted,
            ..flight
        }
    }

    /// The transmittance of so much of what is the same everywhere.
    #[inline(always)]
    fn transmit_evenly<F: Lanes>(&self, way: &Way<'_, C, F>, length: F) -> C::Columns<F> {
        let sigma = self.extinction(way, way.origin);
        let mut transmittance = C::Columns::<F>::splat(F::one());
        for channel in 0..C::Columns::<F>::CHANNELS {
            let depth = sigma[channel] * length;
            let depth = F::select(sigma[channel].eq(F::zero()), F::zero(), depth);
            transmittance.set(channel, exp(-depth));
        }
        transmittance
    }
}

/// The hero's value.
#[inline(always)]
fn hero<F: Lanes, S: Spectra<F>>(values: S, hero: F::Int) -> F {
    let mut own = values[0];
    for channel in 1..S::CHANNELS {
        let mask = hero.eq(F::Int::splat(channel as u32));
        own = F::select(mask, values[channel], own);
    }
    own
}

/// An optical depth with density exp(−τ).
#[inline(always)]
fn optical_depth<F: Lanes>(u: F) -> F {
    -ln(F::one() - u)
}

#[cfg(test)]
mod tests;
