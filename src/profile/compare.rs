//! What changed since an older profile: counts exactly, point by point; times in parts of the arithmetic loop's on
//! either machine, so that a faster processor alone changes nothing, and a series at a time, since a single time
//! of few rounds differs by chance.

use serde::Serialize;

use super::fit::{median, median_interval};
use super::{Axis, FORMAT, Point, Profile, Quantity, Way};
use crate::error::{Error, Result};

/// Two profiles, point by point.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Version of the program then.
    pub version: String,
    /// Renders that both have.
    pub common: usize,
    /// Whether times are compared: both machines were calm.
    pub times: bool,
    /// What changed.
    pub changes: Vec<Change>,
}

/// A quantity that changed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Change {
    /// The series' axis.
    pub axis: Axis,
    /// And way.
    pub way: Way,
    /// The place on the axis; of times absent, for they are compared over all of it.
    pub x: Option<f64>,
    /// What changed.
    pub quantity: Quantity,
    /// New in parts of old; of times the median over the axis.
    pub ratio: f64,
    /// The interval of that median.
    pub interval: [f64; 2],
}

impl Change {
    /// Where on the axis.
    pub fn place(&self) -> String {
        self.x.map_or("all".to_owned(), |x| x.to_string())
    }
}

impl Comparison {
    /// How much is alike.
    pub fn summary(&self) -> String {
        let (counts, times): (Vec<_>, Vec<_>) = self
            .changes
            .iter()
            .partition(|change| change.quantity.is_count());
        let mut summary = format!(
            "{} renders in common, {} counts of them changed",
            self.common,
            counts.len()
        );
        if self.times {
            summary += &format!(
                "; {} kinds of times changed over a whole series, in parts of either machine's arithmetic loop",
                times.len()
            );
        } else {
            summary += "; times are not compared, for one of the profiles is too noisy";
        }
        summary
    }
}

/// Counts that are compared.
const COUNTS: [Quantity; 5] = [
    Quantity::Rays,
    Quantity::ShadowRays,
    Quantity::FirstTests,
    Quantity::ShadowTests,
    Quantity::NodeSteps,
];
/// Times that are compared.
const TIMES: [Quantity; 4] = [
    Quantity::Trace,
    Quantity::Shade,
    Quantity::Film,
    Quantity::Render,
];
/// A smaller change of times is not told.
const LEAST: f64 = 0.03;

impl Profile {
    /// Reads what was written as JSON.
    ///
    /// # Errors
    /// Says what makes no sense, and refuses other formats.
    pub fn from_json(text: &str) -> Result<Self> {
        let wrong = |e: serde_json::Error| {
            Error::input(format!("this is no profile: {e}"))
                .help("`etendue profile -o DIR` writes one to DIR/profile.json")
        };
        let value: serde_json::Value = serde_json::from_str(text).map_err(wrong)?;
        if let Some(format) = value["format"].as_u64().filter(|n| *n != u64::from(FORMAT)) {
            let message = format!("this profile has format {format}, and {FORMAT} is read");
            return Err(Error::input(message));
        }
        serde_json::from_value(value).map_err(wrong)
    }

    /// The profile as JSON.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("a profile has only names and numbers")
    }

    /// What changed since `old`.
    pub fn since(&self, old: &Self) -> Comparison {
        let calm = [self, old]
            .iter()
            .all(|profile| profile.noise.warning().is_none());
        let mut comparison = Comparison {
            version: old.version.clone(),
            common: 0,
            times: calm,
            changes: Vec::new(),
        };
        for series in &self.series {
            let Some(before) = old.series(series.axis, series.way) else {
                continue;
            };
            let with_its_past = |point| {
                let then = before.points.iter().find(|then| alike(then, point))?;
                Some((then, point))
            };
            let pairs: Vec<_> = series.points.iter().filter_map(with_its_past).collect();
            comparison.common += pairs.len();
            let (axis, way) = (series.axis, series.way);
            for (then, now) in &pairs {
                comparison
                    .changes
                    .extend(COUNTS.iter().filter_map(|&quantity| {
                        let [old, new] = [then, now].map(|point| median(&quantity.of(point)));
                        let ratio = new / old;
                        (new != old).then_some(Change {
                            axis,
                            way,
                            x: Some(now.x),
                            quantity,
                            ratio,
                            interval: [ratio; 2],
                        })
                    }));
            }
            let machine = old.noise.seconds / self.noise.seconds;
            for quantity in TIMES.into_iter().filter(|_| calm) {
                let ratio = |(then, now): &(&Point, &Point)| {
                    machine * median(&quantity.of(now)) / median(&quantity.of(then))
                };
                let ratios: Vec<f64> = pairs.iter().map(ratio).collect();
                let interval = median_interval(&ratios);
                let changed = interval[0] > 1.0 + LEAST || interval[1] < 1.0 - LEAST;
                if changed && ratios.len() >= FEWEST {
                    comparison.changes.push(Change {
                        axis,
                        way,
                        x: None,
                        quantity,
                        ratio: median(&ratios),
                        interval,
                    });
                }
            }
        }
        comparison
    }
}

/// The fewest points of a series over which times are compared.
const FEWEST: usize = 4;

/// Whether two points are of one render.
fn alike(a: &Point, b: &Point) -> bool {
    let what = |p: &Point| (p.pixels, p.samples, p.primitives, p.lights, p.threads);
    a.x == b.x && what(a) == what(b)
}
