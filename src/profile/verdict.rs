//! The textbook's loops, one at a time: what it predicts, what was measured, and whether that confirms it.
//! Counts are judged always; times only where the machine was calm enough to tell.

use serde::{Deserialize, Serialize};

use super::{Axis, Fit, Model, Noise, Observed, Point, Quantity, Series, Way};

/// How far an exponent may be from the predicted one.
const TOLERANCE: f64 = 0.05;
/// How far off the prediction of the largest size may be.
const FORETOLD: f64 = 0.05;

/// What became of a prediction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// It was measured.
    Confirmed,
    /// Something else was measured.
    NotConfirmed,
    /// Noise hides it.
    TooNoisy,
}

impl Outcome {
    /// As in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Confirmed => "confirmed",
            Self::NotConfirmed => "not confirmed",
            Self::TooNoisy => "too noisy to say",
        }
    }
}

/// A prediction held against what was measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// Whose it is: pixel loop, object loop, …
    pub subject: String,
    /// What is predicted.
    pub predicted: String,
    /// What was measured.
    pub measured: String,
    /// Whether they agree.
    pub outcome: Outcome,
}

/// Every verdict that the series allow.
pub(super) fn all(series: &[Series], noise: &Noise) -> Vec<Verdict> {
    let judge = Judge {
        series,
        noisy: noise.warning().is_some(),
    };
    let power = |subject, axis, way, quantity: Quantity, exponent| {
        judge.power(subject, axis, way, quantity, exponent)
    };
    use Quantity as Q;
    let verdicts = [
        judge.exact("primary tests = P·O", |p| {
            let tests = p.stats.tracing.primitive_tests - p.stats.shadow_tracing.primitive_tests;
            (tests, p.stats.camera_rays * p.primitives)
        }),
        judge.shadows(),
        power(
            "pixel loop, brute force",
            Axis::Pixels,
            Way::Brute,
            Q::Render,
            1.0,
        ),
        power("pixel loop, tree", Axis::Pixels, Way::Tree, Q::Render, 1.0),
        power(
            "object loop, brute force",
            Axis::Objects,
            Way::Brute,
            Q::TracePerRay,
            1.0,
        ),
        judge.logarithm(),
        power(
            "light loop, brute force",
            Axis::Lights,
            Way::Brute,
            Q::Shadows,
            1.0,
        ),
        power(
            "light loop, tree",
            Axis::Lights,
            Way::Tree,
            Q::ShadowRays,
            1.0,
        ),
        power("light loop, tree", Axis::Lights, Way::Tree, Q::Shadows, 1.0),
        power(
            "one light chosen, tree",
            Axis::Lights,
            Way::One,
            Q::ShadowRays,
            0.0,
        ),
        power(
            "one light chosen, tree",
            Axis::Lights,
            Way::One,
            Q::Shadows,
            0.0,
        ),
        power(
            "sample loop, tree",
            Axis::Samples,
            Way::Tree,
            Q::Render,
            1.0,
        ),
        judge.bands(),
    ];
    verdicts.into_iter().flatten().collect()
}

struct Judge<'a> {
    series: &'a [Series],
    noisy: bool,
}

impl Judge<'_> {
    fn along(&self, axis: Axis, way: Way) -> Option<&Series> {
        self.series.iter().find(|s| s.axis == axis && s.way == way)
    }

    /// A count that the cost model gives exactly, over all renders by brute force.
    fn exact(&self, what: &str, counted: impl Fn(&Point) -> (u64, u64)) -> Option<Verdict> {
        let brute = self.series.iter().filter(|s| s.way == Way::Brute);
        let pairs: Vec<(u64, u64)> = brute.flat_map(|s| &s.points).map(counted).collect();
        let equal = pairs
            .iter()
            .filter(|(measured, model)| measured == model)
            .count();
        let measured = match pairs.iter().find(|(measured, model)| measured != model) {
            Some((measured, model)) => format!("{measured} in place of {model}"),
            None => format!("equal in all {equal} renders"),
        };
        (!pairs.is_empty()).then(|| Verdict {
            subject: "brute force, counted".to_owned(),
            predicted: what.to_owned(),
            measured,
            outcome: outcome(equal == pairs.len()),
        })
    }

    /// Shadow tests: of all hits where every light shines on every hit, as on the landscape; of a mesh some hits
    /// face away.
    fn shadows(&self) -> Option<Verdict> {
        let mut brute = self.series.iter().filter(|s| s.way == Way::Brute);
        let all_lit = brute.all(|s| {
            let mut points = s.points.iter();
            points.all(|p| p.stats.shadow_rays == p.stats.shaded * p.lights as u64)
        });
        let tests = |p: &Point| p.stats.shadow_tracing.primitive_tests;
        if all_lit {
            return self.exact("shadow tests = hits·L·O", |p| {
                (tests(p), p.stats.shaded * p.lights as u64 * p.primitives)
            });
        }
        self.exact(
            "shadow tests = shadow rays·O, for hits that face away have none",
            |p| (tests(p), p.stats.shadow_rays * p.primitives),
        )
    }

    /// A power law's exponent.
    fn power(
        &self,
        subject: &str,
        axis: Axis,
        way: Way,
        quantity: Quantity,
        exponent: f64,
    ) -> Option<Verdict> {
        let fit = self.along(axis, way)?.growth(quantity, Model::Power)?.fit;
        let of = match quantity.is_count() {
            true => quantity.name().to_owned(),
            false => format!("time ({})", quantity.bare_name()),
        };
        Some(Verdict {
            subject: subject.to_owned(),
            predicted: match exponent {
                0.0 => format!("{of} flat in {axis}"),
                _ => format!("{of} ∝ {axis}"),
            },
            measured: exponent_text(axis, &fit),
            outcome: if quantity.is_count() {
                outcome((fit.b - exponent).abs() <= TOLERANCE)
            } else {
                self.of_time(&fit, exponent)
            },
        })
    }

    /// The textbook's rays, one for three bands, beside what a path costs that carries all of them.
    fn bands(&self) -> Option<Verdict> {
        let series = self.along(Axis::Bands, Way::Tree)?;
        let fit = series.growth(Quantity::Render, Model::Power)?.fit;
        let observed = series.observed(Quantity::Render, 0.0);
        let median = |values: &[f64]| {
            let mut values = values.to_vec();
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied()
        };
        let (rgb, bands) = observed.split_first()?;
        let rgb_time = median(&rgb.values)?;
        let times = |of: &dyn Fn(f64, f64) -> f64| -> Vec<String> {
            let of_one = |point: &Observed| {
                let ratio = of(point.x, median(&point.values)?);
                Some(format!("{ratio:.1}× for {}", point.x))
            };
            bands.iter().filter_map(of_one).collect()
        };
        Some(Verdict {
            subject: "band loop, one ray for all bands".to_owned(),
            predicted: format!(
                "time × N/3: {} the time of RGB",
                times(&|n, _| n / 3.0).join(", ")
            ),
            measured: format!(
                "{}; {}",
                times(&|_, time| time / rgb_time).join(", "),
                exponent_text(Axis::Bands, &fit)
            ),
            outcome: self.of_time(&fit, 1.0),
        })
    }

    fn of_time(&self, fit: &Fit, exponent: f64) -> Outcome {
        let [low, high] = fit.interval;
        if self.noisy {
            Outcome::TooNoisy
        } else if low > exponent + TOLERANCE || high < exponent - TOLERANCE {
            Outcome::NotConfirmed
        } else if high - low > 4.0 * TOLERANCE {
            Outcome::TooNoisy
        } else {
            outcome((fit.b - exponent).abs() <= TOLERANCE)
        }
    }

    /// The tree: a logarithm predicts the largest size, and better than a power law does.
    fn logarithm(&self) -> Option<Verdict> {
        let tree = self.along(Axis::Objects, Way::Tree)?;
        let of = |model| tree.growth(Quantity::StepsPerRay, model).map(|g| g.fit);
        let (logarithm, power) = (of(Model::Logarithm)?, of(Model::Power)?);
        let (by_logarithm, by_power) = (logarithm.held_out?, power.held_out?);
        Some(Verdict {
            subject: "object loop, tree".to_owned(),
            predicted: "node steps a ray = a + b·log₂ O".to_owned(),
            measured: format!(
                "{:.2} + {:.3}·log₂ O; largest size predicted to {:+.1} % (power law {:+.1} %)",
                logarithm.a,
                logarithm.b,
                100.0 * by_logarithm,
                100.0 * by_power
            ),
            outcome: outcome(by_logarithm.abs() <= FORETOLD && by_logarithm.abs() < by_power.abs()),
        })
    }
}

fn outcome(confirmed: bool) -> Outcome {
    if confirmed {
        Outcome::Confirmed
    } else {
        Outcome::NotConfirmed
    }
}

/// `∝ O^0.98 [0.97, 1.00]`
fn exponent_text(axis: Axis, fit: &Fit) -> String {
    let [low, high] = fit.interval;
    format!("∝ {axis}^{:.3} [{low:.3}, {high:.3}]", fit.b)
}
