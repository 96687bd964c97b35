//! Samplers place points in the unit cube of a pixel's sample: film, lens, time, light and BSDF each take
//! dimensions of their own. A sampler places a *set* of points at a time; how many sets a pixel gets is
//! the budget's decision (`render`), not the sampler's. Points are pure functions of (key, index,
//! dimension), and inside a set the strata are visited in a keyed permutation, so that every prefix of a
//! set is unbiased.

mod independent;
mod stratified;

use glam::Vec2;

use crate::description::Properties;
use crate::error::Result;
use crate::family::family;
use crate::math::random;

/// What every sampler does.
pub trait PointSet: std::fmt::Debug + Send + Sync {
    /// The samples a pixel that the scene asks for, a multiple of the set's size.
    fn sample_count(&self) -> u32;
    /// How many points make a set.
    fn set_size(&self) -> u32;
    /// The same sampler for about `count` samples a pixel, at least 1: its sets are as large as that allows.
    fn sized(&self, count: u32) -> Sampler;
    /// Coordinate `dimension` of point `index` (counted over all sets of a pixel) in [0, 1); `key` is
    /// the pixel's.
    fn get_1d(&self, key: u64, index: u32, dimension: u32) -> f32;
    /// Coordinates `dimension` and `dimension + 1`, placed as a pair.
    fn get_2d(&self, key: u64, index: u32, dimension: u32) -> Vec2;
}

family! {
    /// Every sampler there is.
    #[derive(Clone, Debug)]
    pub enum Sampler: PointSet, kind "sampler", context () {
        "independent" => Independent(independent::Independent),
        "stratified" => Stratified(stratified::Stratified),
    }
}

impl Sampler {
    /// The samples a pixel that whole sets make of `wanted`.
    pub fn round_up(&self, wanted: u32) -> u32 {
        let set = self.set_size();
        wanted.div_ceil(set).saturating_mul(set)
    }
}

/// `sample_count`, 4 by default; a sampler reads it and may round it up.
fn sample_count(properties: &Properties<'_>) -> Result<u32> {
    let count = properties.integer("sample_count")?.unwrap_or(4);
    u32::try_from(count)
        .ok()
        .filter(|c| (1..=MAX_SAMPLES).contains(c))
        .ok_or_else(|| {
            properties.error(
                "sample_count",
                format!("{count} samples; 1 to {MAX_SAMPLES} are possible"),
            )
        })
}

/// The most samples a pixel can have.
pub const MAX_SAMPLES: u32 = 1 << 30;

/// One sample's place in the sequence of its pixel, and how many dimensions it has used.
#[derive(Clone, Copy, Debug)]
pub struct Stream {
    key: u64,
    index: u32,
    dimension: u32,
}

impl Stream {
    /// Sample `index` of the pixel (x, y) of the full film, under `seed`.
    pub fn new(seed: u64, x: u32, y: u32, index: u32) -> Self {
        let pixel = u64::from(x) | u64::from(y) << 32;
        Self {
            key: random::key(random::key(0, seed), pixel),
            index,
            dimension: 0,
        }
    }

    /// Goes to a dimension, such as the first of a bounce.
    pub fn seek(&mut self, dimension: u32) {
        self.dimension = dimension;
    }

    /// The next number in [0, 1).
    #[inline]
    pub fn next_1d(&mut self, sampler: &Sampler) -> f32 {
        self.dimension += 1;
        sampler.get_1d(self.key, self.index, self.dimension - 1)
    }

    /// The next pair in [0, 1)².
    #[inline]
    pub fn next_2d(&mut self, sampler: &Sampler) -> Vec2 {
        self.dimension += 2;
        sampler.get_2d(self.key, self.index, self.dimension - 2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::{Description, Kind, Options};
    use std::path::Path;

    /// Every sampler of the family, for about `count` samples.
    fn every_sampler(count: u32) -> impl Iterator<Item = (&'static str, Sampler)> {
        Sampler::NAMES.iter().map(move |name| {
            let text = format!(
                r#"<scene version="3.0.0"><sampler type="{name}"><integer name="sample_count" value="{count}"/></sampler></scene>"#
            );
            let scene = Description::parse(&text, Path::new("test.xml"), &Options::default()).unwrap();
            let child = scene.root().children(Kind::Sampler)[0];
            (*name, Sampler::build(&child, &()).unwrap())
        })
    }

    #[test]
    fn every_sampler_fills_the_unit_square_evenly_and_repeats_itself() {
        for (name, sampler) in every_sampler(1000) {
            assert!(
                sampler.sample_count() >= 1000 && sampler.sample_count() % sampler.set_size() == 0
            );
            for dimension in [0, 5, 40] {
                let n = sampler.sample_count();
                let points: Vec<Vec2> = (0..n).map(|i| sampler.get_2d(9, i, dimension)).collect();
                assert!(
                    points
                        .iter()
                        .all(|p| (0.0..1.0).contains(&p.x) && (0.0..1.0).contains(&p.y)),
                    "{name}"
                );
                let mean = points.iter().sum::<Vec2>() / n as f32;
                // Five standard deviations of independent points.
                let tolerance = 5.0 * 0.289 / (n as f32).sqrt();
                assert!(
                    (mean - Vec2::splat(0.5)).abs().max_element() < tolerance,
                    "{name}: {mean}"
                );
                let again: Vec<Vec2> = (0..n).map(|i| sampler.get_2d(9, i, dimension)).collect();
                assert_eq!(points, again, "{name}");
                let other: Vec<Vec2> = (0..n).map(|i| sampler.get_2d(10, i, dimension)).collect();
                assert_ne!(points, other, "{name} gives two pixels the same points");
            }
        }
    }

    #[test]
    fn prefixes_of_every_sampler_are_unbiased() {
        for (name, sampler) in every_sampler(64) {
            let keys = 4000;
            let sum: f64 = (0..keys)
                .map(|k| f64::from(sampler.get_1d(random::key(3, k), 0, 2)))
                .sum();
            assert!(
                (sum / keys as f64 - 0.5).abs() < 5.0 * 0.289 / (keys as f64).sqrt(),
                "{name}"
            );
        }
    }

    #[test]
    fn stratified_points_lie_one_in_each_stratum() {
        let (_, sampler) = every_sampler(64)
            .find(|(name, _)| *name == "stratified")
            .unwrap();
        let (mut cells, mut intervals) = ([0; 64], [0; 64]);
        for i in 64..128 {
            let p = sampler.get_2d(4, i, 6) * 8.0;
            cells[p.x as usize + 8 * p.y as usize] += 1;
            intervals[(sampler.get_1d(4, i, 3) * 64.0) as usize] += 1;
        }
        assert_eq!((cells, intervals), ([1; 64], [1; 64]));
    }
}
