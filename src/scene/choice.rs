//! Which light a path looks toward: half of the choices are in proportion to the power that lights give to the
//! scene, half are even, since a weak light may be a near one. An environment, whose power grows with the
//! scene's size, counts for no more than all other lights together: samples of the material find it as well.
//! Lights without power are never chosen.

use super::LightId;
use crate::color::ColorModel;
use crate::light::Light;
use crate::math::distribution::Discrete;
use crate::shape::Bounds;

/// Lights by probability; none where no light can be drawn.
#[derive(Debug)]
pub(super) struct Choice {
    lights: Option<Discrete>,
    /// By light.
    probabilities: Vec<f32>,
}

/// The share of the choices that does not look at power.
const EVEN: f64 = 0.5;

impl Choice {
    /// The `weights` are how often each light is chosen beside others that are alike.
    pub(super) fn new<C: ColorModel>(
        lights: &[Light<C>],
        weights: &[f64],
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
            .map(|light| Some(light.power(color, radius)).filter(|p| p.is_finite()))
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
            lights,
        }
    }

    /// The light for `u` in [0, 1).
    pub(super) fn sample(&self, u: f32) -> Option<LightId> {
        Some(LightId(self.lights.as_ref()?.index(u) as u32))
    }

    /// How likely a light is.
    pub(super) fn probability(&self, light: LightId) -> f32 {
        self.probabilities[light.0 as usize]
    }
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
        assert!(Choice::by(&[0.0, 0.0], &[1.0; 2]).sample(0.3).is_none());
        assert!(Choice::by(&[], &[]).sample(0.3).is_none());
    }
}
