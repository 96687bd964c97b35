//! What a tree and what threads bring: from how many triangles on the tree overtakes brute force, how much of what
//! more threads could bring at best is there, and which part of the work is serial by Amdahl's law (*Validity of
//! the single processor approach*, 1967): with n processors a program whose part f is serial is
//! n/(1 + f·(n − 1)) times as fast.

use serde::{Deserialize, Serialize};

use super::fit::{median, median_interval};
use super::{Axis, Noise, Point, Quantity, Series, Way};

/// Where the tree overtakes brute force.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Crossover {
    /// Triangles from which on a ray is traced faster through the tree.
    pub tracing: Option<f64>,
    /// Triangles from which on the tree is faster although it must be built, for so many rays.
    pub with_build: Option<f64>,
    /// How many rays.
    pub rays: u64,
    /// The fewest triangles that were measured.
    pub least: f64,
}

impl Crossover {
    /// By two series over triangles; `None` where they do not have sizes in common.
    pub(super) fn of(series: &[Series]) -> Option<Self> {
        let along = |way| {
            let mut objects = series.iter().filter(|s| s.axis == Axis::Objects);
            objects.find(|s| s.way == way)
        };
        let (brute, tree) = (along(Way::Brute)?, along(Way::Tree)?);
        let middle = |quantity: Quantity, point: &Point| median(&quantity.of(point));
        let rays = tree.points.first()?.stats.rays();
        let (mut tracing, mut with_build) = (Vec::new(), Vec::new());
        for slow in &brute.points {
            let Some(fast) = tree.points.iter().find(|p| p.x == slow.x) else {
                continue;
            };
            let [of_brute, of_tree] = [slow, fast].map(|p| middle(Quantity::TracePerRay, p));
            tracing.push((slow.x, of_brute, of_tree));
            let build = 1e9 * middle(Quantity::Build, fast) / rays as f64;
            with_build.push((slow.x, of_brute, of_tree + build));
        }
        (tracing.len() >= 2).then(|| Self {
            tracing: crossing(&tracing),
            with_build: crossing(&with_build),
            rays,
            least: tracing[0].0,
        })
    }
}

/// The x from which on the second of two quantities is the smaller one: between points both are power laws.
fn crossing(points: &[(f64, f64, f64)]) -> Option<f64> {
    let lead = |(_, brute, tree): (f64, f64, f64)| (brute / tree).ln();
    let last_behind = points.iter().rposition(|p| lead(*p) < 0.0);
    let Some(i) = last_behind else {
        return points.first().map(|p| p.0);
    };
    let (p, q) = (points[i], *points.get(i + 1)?);
    let part = -lead(p) / (lead(q) - lead(p));
    Some((p.0.ln() + part * (q.0 / p.0).ln()).exp())
}

/// What threads bring to a phase.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scaling {
    /// The phase.
    pub phase: Quantity,
    /// Threads.
    pub threads: usize,
    /// How many times as fast it is with them as with one, as a median over rounds.
    pub speedup: f64,
    /// The interval of that median.
    pub interval: [f64; 2],
    /// The speed-up in parts of the arithmetic loop's; absent where the loop had other threads.
    pub efficiency: Option<f64>,
    /// Amdahl's serial part, if the machine were as good as the arithmetic loop says; absent like the
    /// efficiency.
    pub serial: Option<f64>,
}

impl Scaling {
    /// By the series over threads.
    pub(super) fn of(series: &[Series], noise: &Noise) -> Vec<Self> {
        let Some(threads) = series.iter().find(|s| s.axis == Axis::Threads) else {
            return Vec::new();
        };
        let Some((one, more)) = threads.points.split_first() else {
            return Vec::new();
        };
        let phases = [Quantity::Load, Quantity::Build, Quantity::Render];
        let of = |(phase, point): (Quantity, &Point)| {
            let pairs = phase.of(one).into_iter().zip(phase.of(point));
            let speedups: Vec<f64> = pairs.map(|(one, many)| one / many).collect();
            let speedup = median(&speedups);
            let efficiency = (point.threads == noise.threads).then(|| speedup / noise.gain);
            Self {
                phase,
                threads: point.threads,
                speedup,
                interval: median_interval(&speedups),
                efficiency,
                serial: efficiency.map(|part| serial(part, point.threads)),
            }
        };
        let all = more
            .iter()
            .flat_map(|point| phases.map(|phase| (phase, point)));
        all.map(of)
            .filter(|scaling| scaling.speedup.is_finite())
            .collect()
    }
}

/// The serial part that leaves so much of n processors; none where more is left than they have.
fn serial(efficiency: f64, n: usize) -> f64 {
    ((1.0 / efficiency - 1.0) / (n as f64 - 1.0)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tree_overtakes_where_two_power_laws_cross() {
        let points: Vec<_> = [2.0, 8.0, 32.0, 128.0]
            .map(|x: f64| (x, 5.0 * x, 60.0 * x.powf(0.25)))
            .to_vec();
        let expected = 12.0_f64.powf(1.0 / 0.75);
        assert!((crossing(&points).unwrap() / expected - 1.0).abs() < 1e-9);
        assert_eq!(crossing(&[(2.0, 9.0, 1.0), (4.0, 9.0, 1.0)]), Some(2.0));
        assert_eq!(crossing(&[(2.0, 1.0, 9.0), (4.0, 1.0, 9.0)]), None);
    }

    #[test]
    fn amdahls_law_gives_back_the_serial_part() {
        for (n, part) in [(2, 0.0), (2, 0.1), (8, 0.25), (4, 1.0)] {
            let speedup = n as f64 / (1.0 + part * (n as f64 - 1.0));
            assert!((serial(speedup / n as f64, n) - part).abs() < 1e-12);
        }
        assert_eq!(serial(1.01, 2), 0.0);
    }
}
