//! Student's t and Welch's test: are the means of two sets of numbers those of one distribution?
//! t = (b̄ − ā) / √(s²ₐ/nₐ + s²_b/n_b), held against Student's distribution with Welch's degrees of freedom
//! (Welch, *The generalization of "Student's" problem when several different population variances are
//! involved*, 1947), whose tail is an incomplete beta function (DLMF 8.17). All in double precision.

use serde::Serialize;

/// The regularised incomplete beta function I_x(a, b) for positive a and b, by Lentz's continued fraction
/// (DLMF 8.17.22). `x` is clamped to [0, 1].
pub fn incomplete_beta(a: f64, b: f64, x: f64) -> f64 {
    /// Terms grow as √max(a, b), and are a few dozen for any number of seeds.
    const MOST_TERMS: u32 = 10_000;
    const TINY: f64 = 1e-300;
    if x <= 0.0 || x >= 1.0 {
        return if x >= 1.0 { 1.0 } else { 0.0 };
    }
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - incomplete_beta(b, a, 1.0 - x);
    }
    let not_zero = |v: f64| if v == 0.0 { TINY } else { v };
    let beta = libm::lgamma(a) + libm::lgamma(b) - libm::lgamma(a + b);
    let front = (a * x.ln() + b * (-x).ln_1p() - beta).exp() / a;
    let mut c = 1.0;
    let mut d = 1.0 / not_zero(1.0 - (a + b) * x / (a + 1.0));
    let mut fraction = d;
    for m in 1..=MOST_TERMS {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        for term in [even, odd] {
            d = 1.0 / not_zero(1.0 + term * d);
            c = not_zero(1.0 + term / c);
            fraction *= c * d;
        }
        if (c * d - 1.0).abs() < 1e-15 {
            break;
        }
    }
    front * fraction
}

/// The probability that |T| exceeds |`t`| for Student's T with `freedom` > 0 degrees of freedom.
pub fn t_two_sided(t: f64, freedom: f64) -> f64 {
    incomplete_beta(0.5 * freedom, 0.5, freedom / (freedom + t * t))
}

/// The t that |T| stays below with probability `confidence` in [0, 1), for Student's T with `freedom` > 0
/// degrees of freedom.
pub fn t_quantile(confidence: f64, freedom: f64) -> f64 {
    quantile(1.0 - confidence, |t| t_two_sided(t, freedom))
}

/// The probability that |Z| exceeds |`z`| for a standard normal Z.
pub fn z_two_sided(z: f64) -> f64 {
    libm::erfc(z.abs() / std::f64::consts::SQRT_2)
}

/// The z that |Z| exceeds with probability `level` in (0, 1], for a standard normal Z.
pub fn z_quantile(level: f64) -> f64 {
    quantile(level, z_two_sided)
}

/// Where a falling `tail` takes the value `level`: by bisection, to the last bit.
fn quantile(level: f64, tail: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while tail(high) > level && high < f64::MAX / 4.0 {
        (low, high) = (high, 2.0 * high);
    }
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return middle;
        }
        if tail(middle) > level {
            low = middle;
        } else {
            high = middle;
        }
    }
}

/// The level of each of `tests` tests that together reject by chance with probability `level` at most:
/// 1 − (1 − level)^(1/tests) (Šidák, *Rectangular confidence regions for the means of multivariate normal
/// distributions*, 1967).
pub fn sidak(level: f64, tests: usize) -> f64 {
    -((-level).ln_1p() / tests.max(1) as f64).exp_m1()
}

/// How many numbers there were, their mean and their spread, gathered one by one (Welford, *Note on a method
/// for calculating corrected sums of squares and products*, 1962).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Moments {
    /// How many numbers.
    pub count: usize,
    /// Their mean; 0 where there are none.
    pub mean: f64,
    /// The sum of their squared distances from the mean.
    pub squares: f64,
}

impl Moments {
    /// Takes one more number.
    pub fn push(&mut self, value: f64) {
        self.count += 1;
        let before = value - self.mean;
        self.mean += before / self.count as f64;
        self.squares += before * (value - self.mean);
    }

    /// The unbiased estimate of the variance of one number; 0 where there are fewer than two.
    pub fn variance(&self) -> f64 {
        match self.count {
            0 | 1 => 0.0,
            n => self.squares / (n - 1) as f64,
        }
    }

    /// The variance of the mean.
    pub fn variance_of_mean(&self) -> f64 {
        self.variance() / self.count.max(1) as f64
    }

    /// The standard error of the mean.
    pub fn error(&self) -> f64 {
        self.variance_of_mean().sqrt()
    }
}

impl FromIterator<f64> for Moments {
    fn from_iter<I: IntoIterator<Item = f64>>(values: I) -> Self {
        let mut moments = Self::default();
        for value in values {
            moments.push(value);
        }
        moments
    }
}

/// The difference of two means, and how well it is known.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Welch {
    /// The mean of b less that of a.
    pub difference: f64,
    /// Its standard error, with the floor in it.
    pub error: f64,
    /// Welch's degrees of freedom.
    pub freedom: f64,
}

/// Holds the means of two independent sets against each other, each of at least two numbers. `floor` is a
/// standard error that is there in any case, such as that of sums in single precision: without it two
/// noiseless sides would differ significantly by their rounding.
pub fn welch(a: &Moments, b: &Moments, floor: f64) -> Welch {
    let (va, vb) = (a.variance_of_mean(), b.variance_of_mean());
    let less_one = |m: &Moments| m.count.saturating_sub(1).max(1) as f64;
    let (fa, fb) = (less_one(a), less_one(b));
    // Scaled before squaring, so that small variances do not vanish.
    let largest = va.max(vb);
    let freedom = if largest > 0.0 {
        let (pa, pb) = (va / largest, vb / largest);
        (pa + pb) * (pa + pb) / (pa * pa / fa + pb * pb / fb)
    } else {
        fa + fb
    };
    Welch {
        difference: b.mean - a.mean,
        error: (va + vb + floor * floor).sqrt(),
        freedom,
    }
}

impl Welch {
    /// The difference in standard errors: 0 where there is no difference, infinite where a difference is
    /// known without error.
    pub fn t(&self) -> f64 {
        if self.difference == 0.0 {
            0.0
        } else {
            self.difference / self.error
        }
    }

    /// The probability that chance alone makes as large a difference.
    pub fn p(&self) -> f64 {
        t_two_sided(self.t(), self.freedom)
    }

    /// Half the width of the interval around `difference` that holds the true one with this probability.
    pub fn half_width(&self, confidence: f64) -> f64 {
        t_quantile(confidence, self.freedom) * self.error
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn assert_near(value: f64, expected: f64) {
        let error = ((value - expected) / expected).abs();
        assert!(error < 1e-10, "{value} is not {expected}: {error:e}");
    }

    #[test]
    fn the_beta_function_and_t_have_scipys_values() {
        for (a, b, x, expected) in [
            (0.5, 0.5, 0.3, 0.369_010_119_565_545_36),
            (2.0, 3.0, 0.7, 0.9163),
            (50.0, 0.5, 0.99, 0.317_304_397_874_197_3),
            (1000.0, 0.5, 0.999, 0.157_247_274_266_723_83),
            (0.1, 4.0, 0.01, 0.751_004_558_011_693_2),
        ] {
            assert_near(incomplete_beta(a, b, x), expected);
        }
        for (t, freedom, expected) in [
            (0.0, 5.0, 1.0),
            (1.0, 1.0, 0.5),
            (2.5, 7.0, 0.040_992_218_585_752_89),
            (-3.0, 14.0, 0.009_551_512_753_539_37),
            (4.2, 2.37, 0.038_603_688_326_527_3),
            (12.0, 31.5, 2.757_582_858_756_717e-13),
            (40.0, 7.0, 1.590_217_998_485_036_4e-9),
            (1e-3, 3.0, 0.999_264_894_969_460_9),
        ] {
            assert_near(t_two_sided(t, freedom), expected);
        }
        for (confidence, freedom, expected) in [
            (0.99, 7.0, 3.499_483_297_350_492_4),
            (0.99, 14.0, 2.976_842_734_370_834_4),
            (0.95, 2.5, 3.574_654_842_003_681_7),
            (0.999_999, 30.0, 6.119_075_620_334_066),
            (0.99, 1e5, 2.575_878_469_908_375),
        ] {
            assert_near(t_quantile(confidence, freedom), expected);
        }
    }

    #[test]
    fn a_million_degrees_of_freedom_are_nearly_a_bell() {
        let p = t_two_sided(6.5, 1e6);
        assert!((p / 8.035_754_335_304_4e-11 - 1.0).abs() < 1e-8, "{p}");
        assert_near(z_two_sided(1.959_963_984_540_054), 0.05);
        assert_near(z_quantile(0.01), 2.575_829_303_548_900_4);
    }

    #[test]
    fn ends_of_the_range_are_finite() {
        assert_eq!(t_two_sided(f64::INFINITY, 3.0), 0.0);
        assert_eq!(t_quantile(0.0, 3.0), 0.0);
        assert!(t_quantile(1.0 - f64::EPSILON, 1.0).is_finite());
        assert_eq!(z_two_sided(1e9), 0.0);
    }

    #[test]
    fn welchs_test_has_scipys_values() {
        let a: Moments = [3.1, 2.9, 3.4, 3.0, 2.7].into_iter().collect();
        let b: Moments = [3.6, 3.3, 3.9].into_iter().collect();
        let test = welch(&a, &b, 0.0);
        assert_near(test.t(), 2.784_089_092_276_450_3);
        assert_near(test.freedom, 3.806_017_498_838_124);
        assert_near(test.p(), 0.052_472_108_042_145_894);
        assert_near(test.half_width(0.99), 1.573_372_234_236_446_4 - 0.58);
    }

    #[test]
    fn sides_without_noise_are_judged_by_the_floor() {
        let constant = |value| Moments::from_iter([value; 4]);
        let (a, b) = (constant(1.0), constant(1.0 + 1e-6));
        assert_eq!(welch(&a, &a, 0.0).p(), 1.0);
        assert_eq!(welch(&a, &b, 0.0).p(), 0.0);
        assert!(welch(&a, &b, 1e-5).p() > 0.9);
        assert_eq!(welch(&a, &b, 1e-5).freedom, 6.0);
    }

    #[test]
    fn a_thousand_tests_together_reject_as_often_as_one() {
        let each = sidak(0.01, 1000);
        assert_near(1.0 - (1.0 - each).powi(1000), 0.01);
        assert_eq!(sidak(0.01, 1), 0.01);
        assert!(sidak(1e-12, 1_000_000_000) > 0.0);
    }
}
