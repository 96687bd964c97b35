//! Which light a path looks toward: half of the choices are in proportion to the power that lights give to the
//! scene, half are even, since a weak light may be a near one. An environment, whose power grows with the
//! scene's size, counts for no more than all other lights together: samples of the material find it as well.
//! Lights without power are never chosen.

use super::LightId;
use crate::color::ColorModel;
use crate::lanes::{Ints as _, Lanes};
use crate::light::Light;
use crate::math::distribution::Discrete;
use crate::shape::Bounds;

/// Lights by probability.
#[derive(Debug)]
pub(super) struct Choice {
    /// Of all lights but the first the least random number that it or a later one is chosen for; `None` where no light can
    /// be drawn.
    starts: Option<Vec<f32>>,
    /// By light.
    probabilities: Vec<f32>,
}

/// Up to so many starts are looked at one after another; more are searched by halves.
const FEW: usize = 8;

/// What a light gives to a scene of some radius.
pub(super) type Power<C> = fn(&Light<C>, &C, f64) -> f64;

/// The share of the choices that does not look at power.
const EVEN: f64 = 0.5;

impl Choice {
    /// The `weights` are how often each light is chosen beside others that are alike.
    pub(super) fn new<C: ColorModel>(
        lights: &[Light<C>],
        weights: &[f64],
        power: Power<C>,
        color: &C,
        bounds: Bounds,
    ) -> Self {
        let radius = if bounds.is_empty() {
            1.0
        } else {
            0.5 * bounds.max.as_dvec3().distance(bounds.min.as_dvec3())
        };
        let powers: Vec<f64> = lights
            .iter()
            .map(|light| Some(power(light, color, radius)).filter(|p| p.is_finite()))
            .map(|power| power.unwrap_or(0.0))
            .collect();
        let local = || {
            lights
                .iter()
                .zip(&powers)
                .filter(|(l, _)| !l.is_environment())
        };
        let others: f64 = local().map(|(_, power)| power).sum();
        let bounded = lights.iter().zip(&powers).map(|(light, &power)| {
            if light.is_environment() && others > 0.0 {
                power.min(others)
            } else {
                power
            }
        });
        Self::by(&bounded.collect::<Vec<_>>(), weights)
    }

    fn by(powers: &[f64], weights: &[f64]) -> Self {
        let total: f64 = powers.iter().sum();
        let count = powers.iter().filter(|p| **p > 0.0).count() as f64;
        let share = |power: f64| (1.0 - EVEN) * power / total + EVEN / count;
        let weighted = powers.iter().zip(weights);
        let lights = Discrete::new(weighted.map(|(&power, &weight)| {
            if power > 0.0 {
                weight * share(power)
            } else {
                0.0
            }
        }));
        let probability = |i| {
            lights
                .as_ref()
                .map_or(0.0, |lights| lights.probability(i) as f32)
        };
        Self {
            probabilities: (0..powers.len()).map(probability).collect(),
            starts: lights.map(|lights| {
                let start = |light| least(|u| lights.index(u) >= light);
                (1..powers.len()).map(start).collect()
            }),
        }
    }

    /// The lights' indices for `u` in [0, 1).
    #[inline(always)]
    pub(super) fn sample<F: Lanes>(&self, u: F) -> Option<F::Int> {
        let starts = self.starts.as_ref()?;
        let one = F::Int::splat(1);
        let mut index = F::Int::splat(0);
        if starts.len() <= FEW {
            for start in starts {
                let begun = F::splat(*start).le(u);
                index = F::Int::select(begun, index + one, index);
            }
            return Some(index);
        }
        let mut step = starts.len().next_power_of_two() as u32;
        let count = F::Int::splat(starts.len() as u32);
        while step > 0 {
            let next = index + F::Int::splat(step);
            let begun = F::gather(starts, next - one).le(u) & !count.lt(next);
            index = F::Int::select(begun, next, index);
            step /= 2;
        }
        Some(index)
    }

    /// How likely a light is.
    pub(super) fn probability(&self, light: LightId) -> f32 {
        self.probabilities[light.0 as usize]
    }
}

/// The least number in [0, 1) of which something holds that holds of all above, or 1.
fn least(holds: impl Fn(f32) -> bool) -> f32 {
    let (mut low, mut high) = (0, 1f32.to_bits());
    while low < high {
        let middle = (low + high) / 2;
        if holds(f32::from_bits(middle)) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    f32::from_bits(low)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_part_the_choices_of_lights_that_are_alike_and_0_is_never() {
        let choice = Choice::by(&[1.0; 3], &[2.0, 0.0, 6.0]);
        let of = |i| choice.probability(LightId(i));
        assert_eq!([of(0), of(1), of(2)], [0.25, 0.0, 0.75]);
    }

    #[test]
    fn strong_lights_are_chosen_often_weak_ones_seldom_and_black_ones_never() {
        let choice = Choice::by(&[3.0, 0.0, 1.0, 1e-9], &[1.0; 4]);
        let of = |i| choice.probability(LightId(i));
        assert!((0..4).map(of).sum::<f32>() - 1.0 < 1e-6);
        assert!(of(0) > of(2) && of(2) > of(3));
        assert!(f64::from(of(3)) >= 0.999 * EVEN / 3.0);
        assert_eq!(of(1), 0.0);
        let n = 3000;
        let mut counts = [0; 4];
        for i in 0..n {
            let light = choice.sample((i as f32 + 0.5) / n as f32).unwrap();
            counts[light.0 as usize] += 1;
        }
        for (i, count) in (0..).zip(counts) {
            let share = count as f32 / n as f32;
            assert!((share - of(i)).abs() < 2e-3, "{i}: {share}");
        }
        // Many are searched in another way than few.
        let powers: Vec<f64> = (0..37).map(|i| f64::from(i % 5)).collect();
        let many = Choice::by(&powers, &[1.0; 37]);
        let mut counts = [0; 37];
        for i in 0..n {
            let light = many.sample((i as f32 + 0.5) / n as f32).unwrap();
            counts[light.0 as usize] += 1;
        }
        for (i, count) in (0..).zip(counts) {
            let share = count as f32 / n as f32;
            assert!(
                (share - many.probability(LightId(i))).abs() < 1e-3,
                "{i}: {share}"
            );
        }
        assert!(Choice::by(&[0.0, 0.0], &[1.0; 2]).sample(0.3f32).is_none());
        assert!(Choice::by(&[], &[]).sample(0.3f32).is_none());
    }
}
