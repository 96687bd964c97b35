//! Samplers place points in the unit cube of a pixel's sample: film, lens, time, light and BSDF each take
//! dimensions of their own. A sampler places a *set* of points at a time; how many sets a pixel gets is
//! the budget's decision (`render`), not the sampler's. Points are pure functions of (key, index,
//! dimension), and inside a set the strata are visited in a keyed permutation, so that every prefix of a
//! set is unbiased.

mod digits;
mod grid;
mod independent;
mod ldsampler;
mod multijitter;
mod orthogonal;
mod poisson;
mod sobol;
mod stratified;
#[cfg(test)]
mod tests;

use crate::description::Properties;
use crate::description::declared::{Row, boolean, integer};
use crate::error::{Problem, Result};
use crate::family::{self, family};
use crate::lanes::{Call, Divisor, Ints, Lanes, Long, Vec2, random};
use crate::math;

/// What every sampler does.
pub trait PointSet: std::fmt::Debug + Send + Sync {
    /// The samples a pixel that the scene asks for, a multiple of the set's size.
    fn sample_count(&self) -> u32;
    /// How many points make a set; sets are independent of each other.
    fn set_size(&self) -> u32;
    /// The sample counts that are not rounded up, in words.
    fn counts(&self) -> &'static str;
    /// The same sampler for another count, 1 to [`MAX_SAMPLES`], which it may round up.
    fn with_count(&self, count: u32) -> Sampler;
    /// Coordinate `dimension` of each sample, in [0, 1). Must be `#[inline(always)]`, and so must [`Self::pair`].
    fn number<F: Lanes>(&self, streams: Streams<F>, dimension: u32) -> F
    where
        Self: Sized;
    /// Coordinates `dimension`, which is even, and `dimension + 1` of each sample, placed as a pair.
    fn pair<F: Lanes>(&self, streams: Streams<F>, dimension: u32) -> Vec2<F>
    where
        Self: Sized;
}

family! {
    /// Every sampler there is.
    #[derive(Clone, Debug)]
    pub enum Sampler: PointSet, context (), visitor Visitor {
        "grid" => Grid(grid::Grid),
        "independent" => Independent(independent::Independent),
        "ldsampler" => LdSampler(ldsampler::LdSampler),
        "multijitter" => MultiJitter(multijitter::MultiJitter),
        "orthogonal" => Orthogonal(orthogonal::Orthogonal),
        "poisson" => Poisson(poisson::Poisson),
        "sobol" => Sobol(sobol::Sobol),
        "stratified" => Stratified(stratified::Stratified),
    }
}

impl Sampler {
    /// The same sampler with its samples parted, for an error to be estimated from: of its
    /// `sample_count()` = m, the samples 0..m, m..2m, … of a pixel are independent of each other, and
    /// `parts` of them are at least as many as this sampler takes. `None` for more parts than samples.
    ///
    /// Parts are rounded up one by one: 100 stratified samples in four parts are four times 25, and 64 are
    /// four times 16, but 100 `sobol` samples, which are 128, become four times 32.
    pub fn parted(&self, parts: u32) -> Option<Sampler> {
        let count = self.sample_count();
        (1..=count)
            .contains(&parts)
            .then(|| self.with_count(count.div_ceil(parts)))
    }

    /// Coordinate `dimension` of each sample, in [0, 1).
    #[inline(always)]
    pub fn number<F: Lanes>(&self, streams: Streams<F>, dimension: u32) -> F {
        F::call(Number(self, streams, dimension))
    }

    /// Coordinates `dimension`, which is even, and `dimension + 1` of each sample, placed as a pair.
    #[inline(always)]
    pub fn pair<F: Lanes>(&self, streams: Streams<F>, dimension: u32) -> Vec2<F> {
        F::call(Pair(self, streams, dimension))
    }

    /// The note that the count which `properties` ask for was rounded up, where it was.
    pub fn rounding(&self, properties: &Properties<'_>) -> Result<Option<Problem>> {
        let properties = family::declared(properties, Self::PLUGINS.iter().copied())?;
        let (wanted, count) = (sample_count(&properties)?, self.sample_count());
        let name = properties.plugin();
        let error = properties.error(
            "sample_count",
            format!("{wanted} samples a pixel are rounded up to {count}"),
        );
        let error = error.help(format!("{name} takes {}", self.counts()));
        Ok((count != wanted).then(|| error.problems()[0].clone()))
    }
}

/// What every sampler reads.
const COMMON: &[Row] = &[
    integer(
        "sample_count",
        DEFAULT_COUNT,
        "samples per pixel, which the sampler may round up",
    )
    .between(1.0, MAX_SAMPLES as f64),
    integer("seed", 0, "the command line's --seed takes its place").without_effect(),
];

/// The samples a pixel that a scene asks for.
fn sample_count(properties: &Properties<'_>) -> Result<u32> {
    Ok(properties.integer("sample_count")? as u32)
}

/// Whether points lie anywhere in their strata.
const JITTER: Row = boolean(
    "jitter",
    true,
    "points anywhere in their strata, and not at the centres",
);

impl Default for Sampler {
    /// Mitsuba's: independent points, 4 per pixel.
    fn default() -> Self {
        Self::Independent(independent::Independent::new(DEFAULT_COUNT as u32))
    }
}

/// The samples per pixel where a scene does not say.
const DEFAULT_COUNT: i64 = 4;

/// The most samples a pixel can have.
pub const MAX_SAMPLES: u32 = 1 << 30;

/// Something to be asked of whichever sampler it is. `visit` must be `#[inline(always)]`.
trait Visitor {
    type Output;

    fn visit<P: PointSet>(self, points: &P) -> Self::Output;
}

/// A sampler, the samples that ask it, and the dimension.
struct Number<'a, F: Lanes>(&'a Sampler, Streams<F>, u32);

impl<F: Lanes> Call<F> for Number<'_, F> {
    type Output = F;

    #[inline(always)]
    fn run(self) -> F {
        self.0.visit(self)
    }
}

impl<F: Lanes> Visitor for Number<'_, F> {
    type Output = F;

    #[inline(always)]
    fn visit<P: PointSet>(self, points: &P) -> F {
        points.number(self.1, self.2)
    }
}

/// See [`Number`].
struct Pair<'a, F: Lanes>(&'a Sampler, Streams<F>, u32);

impl<F: Lanes> Call<F> for Pair<'_, F> {
    type Output = Vec2<F>;

    #[inline(always)]
    fn run(self) -> Vec2<F> {
        self.0.visit(self)
    }
}

impl<F: Lanes> Visitor for Pair<'_, F> {
    type Output = Vec2<F>;

    #[inline(always)]
    fn visit<P: PointSet>(self, points: &P) -> Vec2<F> {
        points.pair(self.1, self.2)
    }
}

/// A key of its own for each set and dimension, and the points' indices in their sets.
#[inline(always)]
fn place<F: Lanes>(streams: Streams<F>, set: Divisor, dimension: u32) -> Streams<F> {
    let (sets, index) = set.divide(streams.index);
    let key = random::bits_along(random::bits(streams.key, dimension), sets);
    Streams { key, index }
}

/// Two numbers in [0, 1), each uniform on multiples of 2⁻²⁴.
#[inline(always)]
fn units<F: Lanes>(bits: Long<F::Int>) -> Vec2<F> {
    Vec2::new(random::unit(bits.high), random::unit(bits.low))
}

/// How many there are of what is counted by dividing.
#[inline(always)]
fn count<F: Lanes>(divisor: Divisor) -> F {
    F::splat(divisor.value() as f32)
}

/// Coordinates that rounding brings to 1 become the largest number below.
#[inline(always)]
fn below_one<F: Lanes>(coordinate: F) -> F {
    coordinate.min(F::splat(1f32.next_down()))
}

/// One sample's place in the sequence of its pixel.
///
/// A path's dimensions are the same whatever it meets: 0 and 1 for the place in the pixel, 2 and 3 for the
/// lens, 4 for the time, 5 for the wavelength; from 8 on each bounce has its own, which its integrator lays
/// out. Pairs begin at even dimensions. Four dimensions from a multiple of four on may be placed jointly, so what is
/// decided together belongs there.
#[derive(Clone, Copy, Debug)]
pub struct Stream {
    key: u64,
    index: u32,
}

impl Stream {
    /// Sample `index` of the pixel (x, y) of the full film, under `seed`.
    pub fn new(seed: u64, x: u32, y: u32, index: u32) -> Self {
        let pixel = u64::from(x) | u64::from(y) << 32;
        Self {
            key: math::random::key(math::random::key(0, seed), pixel),
            index,
        }
    }

    /// The stream of another path that belongs to the same sample.
    #[must_use]
    pub fn other(&self, path: u64) -> Self {
        Self {
            key: math::random::key(self.key, path),
            ..*self
        }
    }

    /// Its number in `dimension`.
    pub fn number(&self, sampler: &Sampler, dimension: u32) -> f32 {
        sampler.number::<f32>(Streams::of(&[*self]), dimension)
    }

    /// Its numbers in `dimension`, which is even, and the next one.
    pub fn pair(&self, sampler: &Sampler, dimension: u32) -> glam::Vec2 {
        sampler.pair::<f32>(Streams::of(&[*self]), dimension).into()
    }
}

/// Streams in lanes.
#[derive(Clone, Copy, Debug)]
pub struct Streams<F: Lanes> {
    key: Long<F::Int>,
    index: F::Int,
}

impl<F: Lanes> Streams<F> {
    /// The first of a slice; lanes beyond its end are those of no pixel.
    #[inline(always)]
    pub fn of(streams: &[Stream]) -> Self {
        let [mut low, mut high, mut index] = [<F::Int as Ints>::ROW; 3];
        for (lane, stream) in streams.iter().take(F::WIDTH).enumerate() {
            (low[lane], high[lane]) = (stream.key as u32, (stream.key >> 32) as u32);
            index[lane] = stream.index;
        }
        let [low, high, index] = [
            F::Int::load(&low),
            F::Int::load(&high),
            F::Int::load(&index),
        ];
        let key = Long { low, high };
        Self { key, index }
    }
}

impl<F: Lanes> Streams<F> {
    /// As many numbers as are wanted, which no sampler places; those of each dimension are others.
    #[inline(always)]
    pub fn draws(&self, dimension: u32) -> Draws<F> {
        let key = random::bits_along(random::bits(self.key, dimension), self.index);
        Draws { key }
    }
}

/// Numbers of paths in lanes, as many as are wanted.
#[derive(Clone, Copy, Debug)]
pub struct Draws<F: Lanes> {
    key: Long<F::Int>,
}

impl<F: Lanes> Draws<F> {
    /// Each path's number `index`, in [0, 1).
    #[inline(always)]
    pub fn number(&self, index: u32) -> F {
        random::unit(random::bits(self.key, index).high)
    }

    /// Others, as many again.
    #[inline(always)]
    pub fn part(&self, index: u32) -> Self {
        let key = random::mix(random::bits(self.key, index) + Long::splat(1));
        Self { key }
    }
}
