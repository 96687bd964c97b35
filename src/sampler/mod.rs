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

use glam::Vec2;

use crate::description::Properties;
use crate::description::declared::{Row, boolean, integer};
use crate::error::{Problem, Result};
use crate::family::{self, family};
use crate::math::random;

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
    /// Coordinate `dimension` of point `index` (counted over all sets of a pixel) in [0, 1); `key` is
    /// the pixel's.
    fn get_1d(&self, key: u64, index: u32, dimension: u32) -> f32;
    /// Coordinates `dimension`, which is even, and `dimension + 1`, placed as a pair.
    fn get_2d(&self, key: u64, index: u32, dimension: u32) -> Vec2;

    /// Coordinate `dimension` of each sample.
    fn fill_1d(&self, streams: &[Stream], dimension: u32, out: &mut [f32]) {
        for (out, stream) in out.iter_mut().zip(streams) {
            *out = self.get_1d(stream.key, stream.index, dimension);
        }
    }
    /// Coordinates `dimension`, which is even, and `dimension + 1` of each sample.
    fn fill_2d(&self, streams: &[Stream], dimension: u32, out: &mut [Vec2]) {
        for (out, stream) in out.iter_mut().zip(streams) {
            *out = self.get_2d(stream.key, stream.index, dimension);
        }
    }
}

family! {
    /// Every sampler there is.
    #[derive(Clone, Debug)]
    pub enum Sampler: PointSet, context () {
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

/// A key of its own for each set and dimension, and the point's index in its set of `n`.
#[inline]
fn place(key: u64, index: u32, n: u32, dimension: u32) -> (u64, u32) {
    // Most samplers' only set is the first: a branch is sooner decided than a division is done.
    let set = if index < n { 0 } else { index / n };
    (
        random::bits(random::bits(key, dimension), set),
        index - set * n,
    )
}

/// Two numbers in [0, 1), each uniform on multiples of 2⁻²⁴.
#[inline]
fn units(bits: u64) -> Vec2 {
    Vec2::new(random::unit(bits), random::unit(bits << 32))
}

/// The largest number below 1: coordinates that rounding brings to 1 are put here.
#[inline]
fn below_one() -> f32 {
    1f32.next_down()
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
            key: random::key(random::key(0, seed), pixel),
            index,
        }
    }

    /// Its number in `dimension`.
    #[inline]
    pub fn number(&self, sampler: &Sampler, dimension: u32) -> f32 {
        sampler.get_1d(self.key, self.index, dimension)
    }

    /// Its numbers in `dimension`, which is even, and the next one.
    #[inline]
    pub fn pair(&self, sampler: &Sampler, dimension: u32) -> Vec2 {
        sampler.get_2d(self.key, self.index, dimension)
    }
}
