//! What changed since an older profile: counts exactly, times by their medians in parts of the arithmetic loop's
//! on either machine, so that a faster processor alone changes nothing.

use serde::Serialize;

use super::fit::{median, median_interval};
use super::{Axis, FORMAT, Noise, Point, Profile, Quantity, Series, Way};
use crate::error::{Error, Result};

/// Two profiles, point by point.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Version of the program then.
    pub version: String,
    /// Renders that both have.
    pub common: usize,
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
    /// The place on the axis.
    pub x: f64,
    /// What changed.
    pub quantity: Quantity,
    /// Then; of times the median.
    pub old: f64,
    /// And now.
    pub new: f64,
    /// New in parts of old; of times, after each was divided by its own arithmetic loop.
    pub ratio: f64,
}

/// What is compared.
const QUANTITIES: [Quantity; 9] = [
    Quantity::Rays,
    Quantity::ShadowRays,
    Quantity::FirstTests,
    Quantity::ShadowTests,
    Quantity::NodeSteps,
    Quantity::Load,
    Quantity::Build,
    Quantity::Trace,
    Quantity::Render,
];
/// A smaller change of a time is not told.
const LEAST: f64 = 0.05;

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
        let mut comparison = Comparison {
            version: old.version.clone(),
            common: 0,
            changes: Vec::new(),
        };
        for series in &self.series {
            let Some(before) = old.series(series.axis, series.way) else {
                continue;
            };
            for point in &series.points {
                let alike = |p: &&Point| {
                    p.x == point.x
                        && (p.pixels, p.samples) == (point.pixels, point.samples)
                        && (p.primitives, p.lights) == (point.primitives, point.lights)
                };
                let Some(then) = before.points.iter().find(alike) else {
                    continue;
                };
                comparison.common += 1;
                let pair = Pair {
                    series,
                    then,
                    point,
                };
                let noises = [&old.noise, &self.noise];
                let changes = QUANTITIES.iter().filter_map(|q| pair.change(*q, noises));
                comparison.changes.extend(changes);
            }
        }
        comparison
    }
}

struct Pair<'a> {
    series: &'a Series,
    then: &'a Point,
    point: &'a Point,
}

impl Pair<'_> {
    fn change(&self, quantity: Quantity, noises: [&Noise; 2]) -> Option<Change> {
        let values = [self.then, self.point].map(|p| quantity.of(p));
        let [old, new] = [&values[0], &values[1]].map(|v| median(v));
        let (ratio, changed) = if quantity.is_count() {
            (new / old, new != old)
        } else {
            let scaled = |i: usize| {
                let by = noises[i].seconds;
                let scaled: Vec<f64> = values[i].iter().map(|t| t / by).collect();
                (median(&scaled), median_interval(&scaled))
            };
            let ((old, [old_low, old_high]), (new, [new_low, new_high])) = (scaled(0), scaled(1));
            let apart = new_low > old_high || new_high < old_low;
            let ratio = new / old;
            (ratio, apart && (ratio - 1.0).abs() > LEAST)
        };
        changed.then_some(Change {
            axis: self.series.axis,
            way: self.series.way,
            x: self.point.x,
            quantity,
            old,
            new,
            ratio,
        })
    }
}
