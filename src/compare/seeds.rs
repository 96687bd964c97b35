//! Several renders a side, each with a seed of its own: do both sides estimate the same image? Welch's test
//! is held over the image's means, over tiles of 16 × 16 pixels and over every pixel, each time between
//! seeds.
//!
//! The error of a mean is never computed from the variances of pixels: a filter that splats a sample into
//! several pixels makes neighbours vary together, so the variance of their mean is not the sum of theirs
//! divided by n². (A tent leaves a pixel 0.4 of the variance that a box does, and the image's mean all of it:
//! the error would come out 1.6 times too small.) Seeds share nothing, whatever the filter.
//!
//! All tests together find a difference by chance with probability 1 − confidence: the three kinds share
//! that equally, and within each its share is Šidák's for their number (the inequality holds for tests
//! that depend on each other, as luminance does on red). Differences that sums in single precision explain,
//! 10⁻⁵ of the mean in question and 10⁻⁶ of the image's, count as noise.

mod side;

use serde::Serialize;

pub(in crate::compare) use side::LUMINANCE;
pub use side::{Side, TILE};

use crate::compare::metric::GUARD;
use crate::compare::statistics::{Moments, Welch, sidak, welch, z_two_sided};
use crate::error::{Error, Result};

/// Differences that single-precision sums explain: a part of the mean in question, and of the image's.
const ROUNDING: f64 = 1e-5;
const ROUNDING_OF_IMAGE: f64 = 1e-6;

/// The image mean of a channel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeanTest {
    /// `luminance` or the channel's name.
    pub channel: String,
    /// The mean over side a.
    pub a: f64,
    /// The mean over side b.
    pub b: f64,
    /// b − a in parts of a; where a is 0, b − a itself.
    pub difference: f64,
    /// Half the width of the difference's interval, for the confidence of all tests together. A difference
    /// below it would have gone unnoticed.
    pub half_width: f64,
    /// The probability of as large a difference by chance, for this test alone.
    pub p: f64,
    /// Whether the interval holds 0.
    pub agrees: bool,
}

impl MeanTest {
    /// Such as `B is 2.0 % brighter`, or `B has 2.0 % more R`; `b` names the second side.
    pub fn in_words(&self, b: &str) -> String {
        brighter(b, &self.channel, self.a, self.difference)
    }
}

/// By how much the side `b` is brighter, in words: `difference` is in parts of side a's mean, where that is not 0.
pub fn brighter(b: &str, channel: &str, a: f64, difference: f64) -> String {
    let size = match a {
        0.0 => format!("{:.3e}", difference.abs()),
        _ if difference.abs() >= 1.0 => {
            return format!("{b} has {:.1} times the {channel}", 1.0 + difference);
        }
        _ => {
            let percent = 100.0 * difference.abs();
            let digits = if percent < 1.0 { 3 } else { 1 };
            format!("{percent:.digits$} %")
        }
    };
    match (channel, difference) {
        (_, 0.0) => format!("{b} is as bright"),
        ("luminance", d) if d > 0.0 => format!("{b} is {size} brighter"),
        ("luminance", _) => format!("{b} is {size} darker"),
        (channel, d) if d > 0.0 => format!("{b} has {size} more {channel}"),
        (channel, _) => format!("{b} has {size} less {channel}"),
    }
}

/// Tests of many places at once.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlacesTest {
    /// How many tests: places times channels.
    pub tests: usize,
    /// Tests whose p is below the limit.
    pub differing: usize,
    /// What p is held against: Šidák's share of the level.
    pub limit: f64,
    /// The place that differs most.
    pub worst: WorstPlace,
    /// Whether none differs.
    pub agrees: bool,
}

/// The place with the least p.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WorstPlace {
    /// The first column, from 0.
    pub x: usize,
    /// The first row, from 0.
    pub y: usize,
    /// The channel's name.
    pub channel: String,
    /// b − a.
    pub difference: f64,
    /// The mean of a there.
    pub a: f64,
    /// The difference in standard errors.
    pub t: f64,
    /// The probability of as large a difference by chance, in one test.
    pub p: f64,
}

/// The relative mean squared difference of the two mean images, beside what noise alone would make.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Noise {
    /// Mean of (b̄ − ā)² / (m² + 0.01), m the mean of both sides.
    pub relmse: f64,
    /// Mean of (s²ₐ/nₐ + s²_b/n_b) / (m² + 0.01): what is expected where both estimate the same.
    pub expected: f64,
    /// Their ratio; about 1 where both estimate the same, 0 where there is neither difference nor noise.
    pub ratio: f64,
}

/// Whether two sides agree, and how sharp the test was.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// Whether no test found a difference.
    pub agrees: bool,
    /// The probability that two sides of the same image are found to agree.
    pub confidence: f64,
    /// Images of side a and b.
    pub seeds: [usize; 2],
    /// Luminance first, where there is one.
    pub means: Vec<MeanTest>,
    /// Tiles of 16 × 16 pixels.
    pub tiles: PlacesTest,
    /// Single pixels.
    pub pixels: PlacesTest,
    /// All pixels' differences beside their noise.
    pub noise: Noise,
    /// The verdict in words.
    pub sentence: String,
}

/// Holds two sides against each other; `confidence` in (0, 1) is usually 0.99.
///
/// # Errors
/// Where the sides' sizes or channels differ, or one has fewer than two images: the spread of the seeds is
/// the yardstick.
pub fn judge(a: &Side, b: &Side, confidence: f64) -> Result<Verdict> {
    check(a, b)?;
    let level = sidak(1.0 - confidence, 3);
    let means = means(a, b, level);
    let columns = a.width.div_ceil(TILE);
    let scale = a.scale();
    let tiles = Places {
        channels: &a.channels,
        level,
        scale,
        count: a.tiles.len(),
        place: |tile| (tile % columns * TILE, tile / columns * TILE),
    }
    .test(|i| (a.tiles[i], b.tiles[i]));
    let pixels = Places {
        channels: &a.channels,
        level,
        scale,
        count: a.pixels.len(),
        place: |pixel| (pixel % a.width, pixel / a.width),
    }
    .test(|i| (a.pixel(i), b.pixel(i)));
    let mut verdict = Verdict {
        agrees: means.iter().all(|m| m.agrees) && tiles.agrees && pixels.agrees,
        confidence,
        seeds: [a.count, b.count],
        means,
        tiles,
        pixels,
        noise: noise(a, b),
        sentence: String::new(),
    };
    verdict.sentence = sentence(&verdict);
    Ok(verdict)
}

fn check(a: &Side, b: &Side) -> Result<()> {
    for (side, name) in [(a, "A"), (b, "B")] {
        if side.count < 2 {
            return Err(
                Error::input(format!("{name} has fewer than two images")).help(
                    "give at least two a side, of different seeds: their spread is the yardstick",
                ),
            );
        }
    }
    if (a.width, a.height) != (b.width, b.height) {
        return Err(Error::input(format!(
            "the sizes differ: {} × {} and {} × {} pixels",
            a.width, a.height, b.width, b.height
        )));
    }
    if a.channels != b.channels {
        let names = |s: &Side| s.channels.join(", ");
        return Err(Error::input(format!(
            "the channels differ: {} and {}",
            names(a),
            names(b)
        )));
    }
    Ok(())
}

fn means(a: &Side, b: &Side, level: f64) -> Vec<MeanTest> {
    let count = a.means.len();
    let confidence = 1.0 - sidak(level, count);
    // Luminance was pushed last and is told first.
    let order = (a.channels.len()..count).chain(0..a.channels.len());
    let of_image = a.means[count - 1].mean.abs();
    order
        .map(|i| {
            let (ma, mb) = (&a.means[i], &b.means[i]);
            let floor = ROUNDING * ma.mean.abs() + ROUNDING_OF_IMAGE * of_image;
            let test = welch(ma, mb, floor);
            let scale = if ma.mean == 0.0 { 1.0 } else { ma.mean.abs() };
            let half_width = test.half_width(confidence) / scale;
            let difference = test.difference / scale;
            MeanTest {
                channel: a.channels.get(i).map_or("luminance", |n| n).to_owned(),
                a: ma.mean,
                b: mb.mean,
                difference,
                half_width,
                p: test.p(),
                agrees: difference.abs() <= half_width,
            }
        })
        .collect()
}

/// Places that are tested together.
struct Places<'a, F> {
    channels: &'a [String],
    level: f64,
    /// The image's mean.
    scale: f64,
    /// Places times channels.
    count: usize,
    /// The first pixel of a place.
    place: F,
}

impl<F: Fn(usize) -> (usize, usize)> Places<'_, F> {
    fn test(&self, sides: impl Fn(usize) -> (Moments, Moments)) -> PlacesTest {
        let limit = sidak(self.level, self.count);
        let (mut worst, mut least, mut differing) = (0, f64::INFINITY, 0);
        let at = |i| -> (Welch, Moments) {
            let (a, b) = sides(i);
            let floor = ROUNDING * a.mean.abs() + ROUNDING_OF_IMAGE * self.scale;
            (welch(&a, &b, floor), a)
        };
        for i in 0..self.count {
            let (test, _) = at(i);
            // Student's tails are heavier than the bell's, which is quicker to know.
            if z_two_sided(test.t()) >= limit.max(least) {
                continue;
            }
            let p = test.p();
            differing += usize::from(p < limit);
            if p < least {
                (worst, least) = (i, p);
            }
        }
        let (test, a) = at(worst);
        let (x, y) = (self.place)(worst / self.channels.len());
        PlacesTest {
            tests: self.count,
            differing,
            limit,
            agrees: differing == 0,
            worst: WorstPlace {
                x,
                y,
                channel: self.channels[worst % self.channels.len()].clone(),
                difference: test.difference,
                a: a.mean,
                t: test.t(),
                p: test.p(),
            },
        }
    }
}

fn noise(a: &Side, b: &Side) -> Noise {
    let (mut measured, mut expected) = (0.0, 0.0);
    for i in 0..a.pixels.len() {
        let (pa, pb) = (a.pixel(i), b.pixel(i));
        let mean = 0.5 * (pa.mean + pb.mean);
        let guard = mean * mean + GUARD;
        measured += (pb.mean - pa.mean).powi(2) / guard;
        expected += (pa.variance_of_mean() + pb.variance_of_mean()) / guard;
    }
    let n = a.pixels.len().max(1) as f64;
    Noise {
        relmse: measured / n,
        expected: expected / n,
        ratio: if measured == 0.0 {
            0.0
        } else {
            measured / expected
        },
    }
}

/// |t| of every pixel, the greatest over its channels, row by row: the map of where two sides differ.
///
/// # Errors
/// As [`judge`].
pub fn map(a: &Side, b: &Side) -> Result<Vec<f32>> {
    check(a, b)?;
    let scale = a.scale();
    let channels = a.channels.len();
    let t = |i| {
        let (pa, pb) = (a.pixel(i), b.pixel(i));
        let floor = ROUNDING * pa.mean.abs() + ROUNDING_OF_IMAGE * scale;
        welch(&pa, &pb, floor).t().abs() as f32
    };
    let of_pixel = |p: usize| {
        (p * channels..(p + 1) * channels)
            .map(t)
            .fold(0.0, f32::max)
    };
    Ok((0..a.width * a.height).map(of_pixel).collect())
}

fn sentence(verdict: &Verdict) -> String {
    let percent = |v: f64| format!("{:.3} %", 100.0 * v);
    let [na, nb] = verdict.seeds;
    let confidence = 100.0 * verdict.confidence;
    if verdict.agrees {
        let mean = &verdict.means[0];
        let relative = if mean.a == 0.0 {
            format!("{:.3e}", mean.half_width)
        } else {
            percent(mean.half_width)
        };
        return format!(
            "A and B agree: {na} and {nb} seeds show no difference at {confidence} % confidence; \
             had the mean {} differed by more than {relative}, they would have",
            mean.channel
        );
    }
    let mut found: Vec<String> = Vec::new();
    let means = verdict.means.iter().filter(|m| !m.agrees);
    let means: Vec<String> = means
        .map(|m| match m.a {
            0.0 => format!("{} {:+.3e}", m.channel, m.difference),
            _ => format!("{} {:+.3} %", m.channel, 100.0 * m.difference),
        })
        .collect();
    if !means.is_empty() {
        found.push(format!("the mean ({})", means.join(", ")));
    }
    for (test, name) in [(&verdict.tiles, "tile"), (&verdict.pixels, "pixel")] {
        if !test.agrees {
            let WorstPlace { x, y, channel, .. } = &test.worst;
            found.push(format!(
                "{} of {} {name} tests (most at {x}, {y} in {channel})",
                test.differing, test.tests
            ));
        }
    }
    format!(
        "A and B differ at {confidence} % confidence, by {na} and {nb} seeds, in {}{}",
        found.join(", "),
        if verdict.means[0].agrees {
            String::new()
        } else {
            format!("; {}", verdict.means[0].in_words("B"))
        }
    )
}
