//! How a quantity grows: a power law y = a·xᵇ, a logarithm y = a + b·log₂ x or a line y = a + b·x, by least
//! squares in log space for the first and on relative errors for the others. Intervals of b are percentiles of a
//! bootstrap over points and repetitions (Efron, *Bootstrap methods: another look at the jackknife*, 1979) with a
//! fixed seed, so that the same measurements have the same intervals. A model is judged by what it predicts of
//! the largest x from all others.

use rand::RngExt;
use serde::{Deserialize, Serialize};

use crate::math::random::Sequence;

/// What grows how.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Model {
    /// a·xᵇ
    Power,
    /// a + b·log₂ x
    Logarithm,
    /// a + b·x
    Line,
}

/// What was observed at one x.
#[derive(Clone, Debug, PartialEq)]
pub struct Observed {
    /// Positive.
    pub x: f64,
    /// One a repetition; a count has one. Positive.
    pub values: Vec<f64>,
}

/// A model with its numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// Which model.
    pub model: Model,
    /// Its a.
    pub a: f64,
    /// Its b: the exponent of a power law.
    pub b: f64,
    /// Holds b in 95 of 100 cases.
    pub interval: [f64; 2],
    /// How far off the largest x is predicted from all others, in parts of what was observed there; absent
    /// with fewer than four points.
    pub held_out: Option<f64>,
}

/// How many samples the bootstrap draws.
const DRAWS: usize = 1000;
/// What it draws them with.
const SEED: u64 = 1;

impl Model {
    /// What b is multiplied by.
    fn basis(self, x: f64) -> f64 {
        match self {
            Self::Power => x.ln(),
            Self::Logarithm => x.log2(),
            Self::Line => x,
        }
    }

    /// a and b for points (x, y); `None` with fewer than two different x.
    fn solve(self, points: &[(f64, f64)]) -> Option<(f64, f64)> {
        // Weighted normal equations around the weighted mean, so that nothing large cancels.
        let rows = points.iter().map(|&(x, y)| match self {
            Self::Power => (self.basis(x), y.ln(), 1.0),
            _ => (self.basis(x), y, 1.0 / (y * y)),
        });
        let (mut weight, mut mean_x, mut mean_y) = (0.0, 0.0, 0.0);
        for (x, y, w) in rows.clone() {
            weight += w;
            mean_x += w * x;
            mean_y += w * y;
        }
        (mean_x, mean_y) = (mean_x / weight, mean_y / weight);
        let (mut square, mut product) = (0.0, 0.0);
        for (x, y, w) in rows {
            square += w * (x - mean_x) * (x - mean_x);
            product += w * (x - mean_x) * (y - mean_y);
        }
        let b = product / square;
        let a = mean_y - b * mean_x;
        let a = if self == Self::Power { a.exp() } else { a };
        (a.is_finite() && b.is_finite()).then_some((a, b))
    }

    fn predict(self, a: f64, b: f64, x: f64) -> f64 {
        match self {
            Self::Power => a * x.powf(b),
            _ => a + b * self.basis(x),
        }
    }
}

impl Fit {
    /// Fits medians; `None` where fewer than three x are observed, or anything is not positive.
    pub fn new(model: Model, observed: &[Observed]) -> Option<Self> {
        let sound = |v: &f64| *v > 0.0 && v.is_finite();
        let usable =
            |o: &Observed| sound(&o.x) && !o.values.is_empty() && o.values.iter().all(sound);
        if observed.len() < 3 || !observed.iter().all(usable) {
            return None;
        }
        let mut points: Vec<(f64, f64)> =
            observed.iter().map(|o| (o.x, median(&o.values))).collect();
        let (a, b) = model.solve(&points)?;
        let interval = bootstrap(model, observed).unwrap_or([b, b]);
        points.sort_by(|p, q| p.0.total_cmp(&q.0));
        let held_out = points
            .split_last()
            .filter(|(_, rest)| rest.len() >= 3)
            .and_then(|(&(x, y), rest)| {
                let (a, b) = model.solve(rest)?;
                Some(model.predict(a, b, x) / y - 1.0)
            });
        Some(Self {
            model,
            a,
            b,
            // The bootstrap's percentiles need not hold the estimate itself.
            interval: [interval[0].min(b), interval[1].max(b)],
            held_out,
        })
    }

    /// The fitted y.
    pub fn at(&self, x: f64) -> f64 {
        self.model.predict(self.a, self.b, x)
    }
}

/// The interval of b.
fn bootstrap(model: Model, observed: &[Observed]) -> Option<[f64; 2]> {
    let mut random = Sequence::new(SEED);
    let mut values = Vec::with_capacity(DRAWS);
    for _ in 0..DRAWS {
        let draw = |_| {
            let one = &observed[random.random_range(0..observed.len())];
            let of = |_| one.values[random.random_range(0..one.values.len())];
            let again: Vec<f64> = (0..one.values.len()).map(of).collect();
            (one.x, median(&again))
        };
        let points: Vec<(f64, f64)> = (0..observed.len()).map(draw).collect();
        // Draws of fewer than three different x say little.
        let mut xs: Vec<f64> = points.iter().map(|p| p.0).collect();
        xs.sort_by(f64::total_cmp);
        xs.dedup();
        if xs.len() >= 3.min(observed.len() - 1) {
            values.extend(model.solve(&points).map(|(_, b)| b));
        }
    }
    values.sort_by(f64::total_cmp);
    let at = |part: f64| values.get((part * (values.len() as f64 - 1.0)).round() as usize);
    Some([*at(0.025)?, *at(0.975)?])
}

/// The middle one; the mean of the middle two. Not a number where there is none.
pub fn median(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    let n = values.len();
    match n {
        0 => f64::NAN,
        _ => 0.5 * (values[(n - 1) / 2] + values[n / 2]),
    }
}

/// An interval that holds the median of what the values are drawn from in 95 of 100 cases, whatever that is, by
/// the binomial distribution of ranks; with fewer than six values their whole range, which holds it less often.
pub fn median_interval(values: &[f64]) -> [f64; 2] {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    let n = values.len();
    if n == 0 {
        return [f64::NAN; 2];
    }
    // Ranks are left out at either end as long as together they have less than 1/40.
    let (mut left_out, mut term, mut sum) = (0, 0.5_f64.powi(n as i32), 0.0);
    while sum + term <= 0.025 && left_out < n / 2 {
        sum += term;
        term *= (n - left_out) as f64 / (left_out + 1) as f64;
        left_out += 1;
    }
    let first = left_out.saturating_sub(1);
    [values[first], values[n - 1 - first]]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Repetitions of y with a noise of `noise` of it.
    fn observed(xs: &[f64], noise: f64, seed: u64, y: impl Fn(f64) -> f64) -> Vec<Observed> {
        let mut random = Sequence::new(seed);
        let mut noisy = |x: f64| Observed {
            x,
            values: (0..7)
                .map(|_| y(x) * (1.0 + noise * (2.0 * random.random::<f64>() - 1.0)))
                .collect(),
        };
        xs.iter().map(|x| noisy(*x)).collect()
    }

    const XS: [f64; 7] = [1e3, 4e3, 16e3, 64e3, 256e3, 1e6, 4e6];

    #[test]
    fn known_exponents_come_out_exactly_where_there_is_no_noise() {
        for exponent in [-0.5, 0.0, 0.3, 1.0, 2.0] {
            let points = observed(&XS, 0.0, 1, |x| 3.0 * x.powf(exponent));
            let fit = Fit::new(Model::Power, &points).unwrap();
            assert!((fit.b - exponent).abs() < 1e-12, "{fit:?}");
            assert!((fit.a / 3.0 - 1.0).abs() < 1e-10, "{fit:?}");
            assert!(fit.held_out.unwrap().abs() < 1e-10);
            assert!(fit.interval[1] - fit.interval[0] < 1e-10);
        }
        let points = observed(&XS, 0.0, 1, |x| 5.0 + 2.0 * x.log2());
        let fit = Fit::new(Model::Logarithm, &points).unwrap();
        assert!((fit.a - 5.0).abs() < 1e-10 && (fit.b - 2.0).abs() < 1e-10);
        let points = observed(&XS, 0.0, 1, |x| 7.0 + 0.25 * x);
        let fit = Fit::new(Model::Line, &points).unwrap();
        assert!((fit.a - 7.0).abs() < 1e-6 && (fit.b - 0.25).abs() < 1e-10);
    }

    #[test]
    fn intervals_hold_the_exponent_about_as_often_as_they_say() {
        let trials = 60;
        let held = (0..trials).filter(|seed| {
            let points = observed(&XS, 0.1, *seed, |x| 0.1 * x.powf(0.7));
            let [low, high] = Fit::new(Model::Power, &points).unwrap().interval;
            low <= 0.7 && 0.7 <= high
        });
        let held = held.count();
        // Medians of seven leave intervals from seven points a little short.
        assert!(held >= 50, "{held} of {trials}");
    }

    #[test]
    fn the_largest_point_tells_a_logarithm_from_a_power_law() {
        let logarithm = observed(&XS, 0.01, 3, |x| 5.0 + 2.0 * x.log2());
        let power = observed(&XS, 0.01, 3, |x| 5.0 * x.powf(0.4));
        let off = |model, points: &[Observed]| Fit::new(model, points).unwrap().held_out.unwrap();
        assert!(off(Model::Logarithm, &logarithm).abs() < 0.02);
        assert!(off(Model::Power, &logarithm) > 0.03);
        assert!(off(Model::Power, &power).abs() < 0.02);
        assert!(off(Model::Logarithm, &power) < -0.1);
    }

    #[test]
    fn what_cannot_be_fitted_is_not() {
        assert_eq!(
            Fit::new(Model::Power, &observed(&XS[..2], 0.0, 1, |x| x)),
            None
        );
        assert_eq!(
            Fit::new(Model::Power, &observed(&XS, 0.0, 1, |_| 0.0)),
            None
        );
        assert_eq!(
            Fit::new(Model::Power, &observed(&[5.0; 4], 0.0, 1, |x| x)),
            None
        );
        assert_eq!(
            Fit::new(Model::Line, &observed(&XS, 0.0, 1, |_| f64::NAN)),
            None
        );
    }

    #[test]
    fn medians_and_their_intervals_are_those_of_ranks() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), 2.5);
        assert!(median(&[]).is_nan());
        assert_eq!(median_interval(&[2.0, 1.0, 3.0]), [1.0, 3.0]);
        // Of nine values the second and the eighth: 2·(1 + 9)/512 = 3.9 % lie outside.
        let nine: Vec<f64> = (1..=9).map(f64::from).collect();
        assert_eq!(median_interval(&nine), [2.0, 8.0]);
        let six: Vec<f64> = (1..=6).map(f64::from).collect();
        assert_eq!(median_interval(&six), [1.0, 6.0]);
    }
}
