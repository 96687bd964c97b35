//! What rendering costs as it grows, held against the textbook's O(P·O·L) for pixels, objects and lights by brute
//! force, × N/3 for N bands, and log O for a tree. [`run`] sweeps the axes, one at a time, in rounds, so that what
//! disturbs the machine disturbs all renders alike; it counts, times and fits, and says which loops it confirms.
//! Counts are the same on every machine; times are medians with intervals, and verdicts on them are withheld where
//! the machine is too noisy.

mod axis;
mod fit;
mod measure;
mod noise;
mod quantity;
mod resize;
mod scaling;
mod subject;
mod sweep;
mod verdict;

mod answer;
mod chart;
mod compare;
mod csv;
mod facts;
mod html;
mod plot;

use serde::{Deserialize, Serialize};

use crate::integrator::Stats;
use crate::render::Seconds;

pub use axis::{Axis, Effort, Way};
pub use compare::{Change, Comparison};
pub use fit::{Fit, Model, Observed, median, median_interval};
pub use measure::{Settings, Watch, run};
pub use noise::Noise;
pub use plot::Plot;
pub use quantity::Quantity;
pub use scaling::{Crossover, Scaling};
pub use subject::Subject;
pub use verdict::{Outcome, Verdict};

/// The version of [`Profile`] as JSON.
pub const FORMAT: u32 = 1;

/// All that a run has found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Profile {
    /// [`FORMAT`].
    pub format: u32,
    /// Version of the program.
    pub version: String,
    /// What was rendered.
    pub subject: String,
    /// The machine, in words; profiles of older versions have none.
    #[serde(default)]
    pub machine: String,
    /// How much was taken on.
    pub effort: Effort,
    /// Rounds over all renders.
    pub rounds: usize,
    /// Seconds of the whole run.
    pub seconds: f64,
    /// What the machine itself does.
    pub noise: Noise,
    /// Along each axis in each way.
    pub series: Vec<Series>,
    /// From how many triangles on the tree is faster than brute force.
    pub crossover: Option<Crossover>,
    /// What more threads bring, by phase.
    pub scaling: Vec<Scaling>,
    /// Bytes of geometry and of trees a triangle, at the largest size.
    pub bytes_per_triangle: Option<[f64; 2]>,
    /// Which of the textbook's loops are confirmed.
    pub verdicts: Vec<Verdict>,
    /// What was left out, and why.
    pub notes: Vec<String>,
}

/// Renders along one axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// What grows.
    pub axis: Axis,
    /// How rays find shapes.
    pub way: Way,
    /// In the order of x.
    pub points: Vec<Point>,
    /// How quantities grow.
    pub fits: Vec<Growth>,
}

/// A quantity's growth along a series.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Growth {
    /// What grows.
    pub quantity: Quantity,
    /// From which x on it was fitted.
    pub from: f64,
    /// How it grows.
    pub fit: Fit,
}

/// One render, measured as often as there were rounds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// The place on the series' axis.
    pub x: f64,
    /// Pixels.
    pub pixels: u64,
    /// Samples of each.
    pub samples: u32,
    /// Triangles and other primitives.
    pub primitives: u64,
    /// Lights.
    pub lights: usize,
    /// Threads.
    pub threads: usize,
    /// Bytes of geometry and of trees.
    pub bytes: [usize; 2],
    /// The counts.
    pub stats: Stats,
    /// The times of each round: the mean of renders in it, where one is too short to be timed.
    pub seconds: Vec<Seconds>,
}

impl Series {
    /// A quantity's values along the axis, from an x on.
    pub fn observed(&self, quantity: Quantity, from: f64) -> Vec<Observed> {
        let points = self.points.iter().filter(|point| point.x >= from);
        let observed = |point: &Point| Observed {
            x: point.x,
            values: quantity.of(point),
        };
        points.map(observed).collect()
    }

    /// How a quantity grows by a model.
    pub fn growth(&self, quantity: Quantity, model: Model) -> Option<&Growth> {
        let wanted = |growth: &&Growth| growth.quantity == quantity && growth.fit.model == model;
        self.fits.iter().find(wanted)
    }

    /// As titles say it.
    pub fn title(&self) -> String {
        format!("{} · {}", self.axis, self.way.name())
    }
}

impl Profile {
    /// The series along an axis in one way.
    pub fn series(&self, axis: Axis, way: Way) -> Option<&Series> {
        let wanted = |series: &&Series| series.axis == axis && series.way == way;
        self.series.iter().find(wanted)
    }
}

#[cfg(test)]
mod tests;
