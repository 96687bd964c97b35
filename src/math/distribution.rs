//! Discrete distributions, drawn by inverting their cumulative sums (PBRT 4th ed., appendix A.4), which keeps the order of
//! random numbers. Sums run in double precision.

/// Indices drawn in proportion to weights.
#[derive(Clone, Debug)]
pub struct Discrete {
    /// Cumulative sums from 0 to the total, one more than there are weights.
    cumulative: Vec<f64>,
}

/// An index drawn from [`Discrete`].
#[derive(Clone, Copy, Debug)]
pub struct Drawn {
    /// Which one.
    pub index: usize,
    /// Its probability.
    pub probability: f64,
    /// The random number stretched over the chosen one's share: in [0, 1), to be used again.
    pub rest: f32,
}

impl Discrete {
    /// `None` where no weight is positive; negative and non-finite weights count as 0.
    pub fn new(weights: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut total = 0.0;
        let mut cumulative = vec![0.0];
        for w in weights {
            total += if w.is_finite() { w.max(0.0) } else { 0.0 };
            cumulative.push(total);
        }
        (total > 0.0 && total.is_finite()).then_some(Self { cumulative })
    }

    /// The sum of the weights.
    pub fn total(&self) -> f64 {
        self.cumulative[self.cumulative.len() - 1]
    }

    /// The probability of `index`.
    pub fn probability(&self, index: usize) -> f64 {
        (self.cumulative[index + 1] - self.cumulative[index]) / self.total()
    }

    /// An index for `u` in [0, 1), never one of weight 0.
    pub fn sample(&self, u: f32) -> Drawn {
        let target = f64::from(u) * self.total();
        let index = self.find(target);
        let (low, high) = (self.cumulative[index], self.cumulative[index + 1]);
        let rest = (((target - low) / (high - low)) as f32).clamp(0.0, 1f32.next_down());
        Drawn {
            index,
            probability: (high - low) / self.total(),
            rest,
        }
    }

    /// The index alone of [`Self::sample`].
    pub fn index(&self, u: f32) -> usize {
        self.find(f64::from(u) * self.total())
    }

    fn find(&self, target: f64) -> usize {
        let after = self.cumulative.partition_point(|&c| c <= target);
        let mut index = after.clamp(1, self.cumulative.len() - 1) - 1;
        while self.cumulative[index + 1] <= self.cumulative[index] {
            index -= 1; // only rounding at the upper end leads here
        }
        index
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random;

    #[test]
    fn indices_come_in_proportion_to_their_weights() {
        let d = Discrete::new([0.0, 1.0, 0.0, 3.0, 0.0]).unwrap();
        let n = 40_000;
        let threes = (0..n)
            .filter(|&i| d.sample(random::unit(random::bits(1, i))).index == 3)
            .count();
        assert!((threes as f64 / f64::from(n) - 0.75).abs() < 0.01);
        for u in [0.0, 0.25, 0.249_999, 1f32.next_down()] {
            assert!(d.probability(d.sample(u).index) > 0.0, "{u}");
        }
        assert!(Discrete::new([0.0, f64::NAN]).is_none());
    }
}
