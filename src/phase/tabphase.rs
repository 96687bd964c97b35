//! `tabphase`: a table of `values` at cosines that are evenly spaced from −1 (light goes back) to 1 (forward), linear
//! between them and scaled so that the whole is 1.

use std::f32::consts::{FRAC_1_PI, PI};
use std::sync::Arc;

use super::{BlockPhase, PhaseSamples, Scatter, around};
use crate::color::Mono;
use crate::description::Properties;
use crate::description::declared::{Plugin, string};
use crate::error::Result;
use crate::lanes::{Ints as _, Lanes, Vec2, Vec3};
use crate::texture::Palette;

/// A table.
#[derive(Clone, Debug)]
pub struct TabPhase {
    /// Densities of the cosine.
    values: Arc<[f32]>,
    /// The shares below each cosine, from 0 to 1.
    shares: Arc<[f32]>,
}

/// The most values of a table.
const MOST: usize = 1 << 20;

impl TabPhase {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a table over the cosine",
        properties: &[&[string(
            "values",
            "",
            "at evenly spaced cosines from −1 (back) to 1 (forward), two or more",
        )
        .required()]],
    };

    pub(super) fn build(properties: &Properties<'_>, _numbers: &Palette<Mono>) -> Result<Self> {
        let text = properties.string("values")?;
        let wrong = |message: String| {
            let error = properties.error("values", message);
            error.help("a table is such as \"0.5, 1, 1.5\"")
        };
        let words = text
            .split([' ', ',', '\n', '\t'])
            .filter(|word| !word.is_empty());
        let mut values: Vec<f64> = Vec::new();
        for word in words {
            match word.parse() {
                Ok(value) if f64::is_finite(value) && value >= 0.0 => values.push(value),
                _ => return Err(wrong(format!("{word:?} is no number from 0 up"))),
            }
            if values.len() > MOST {
                return Err(wrong(format!("a table has at most {MOST} values")));
            }
        }
        let step = 2.0 / (values.len().max(2) - 1) as f64;
        let mut sum = 0.0;
        let mut shares = vec![0.0];
        for pair in values.windows(2) {
            sum += step * (pair[0] + pair[1]) / 2.0;
            shares.push(sum);
        }
        if values.len() < 2 || sum <= 0.0 || !f64::is_finite(sum) {
            return Err(wrong(
                "a table needs two values or more, and one above 0".to_owned(),
            ));
        }
        Ok(Self {
            values: values.iter().map(|value| (value / sum) as f32).collect(),
            shares: shares.iter().map(|share| (share / sum) as f32).collect(),
        })
    }

    /// The values at both ends of an interval.
    #[inline(always)]
    fn ends<F: Lanes>(&self, interval: F) -> [F; 2] {
        let index = interval.to_int();
        let next = index + F::Int::splat(1);
        [
            F::gather(&self.values, index),
            F::gather(&self.values, next),
        ]
    }

    /// The density of a cosine.
    #[inline(always)]
    fn value<F: Lanes>(&self, cosine: F) -> F {
        let intervals = (self.values.len() - 1) as f32;
        let place = (cosine + F::one()) * F::splat(intervals / 2.0);
        let interval = place.floor().clamp(0.0, intervals - 1.0);
        let [low, high] = self.ends(interval);
        let part = (place - interval).clamp(0.0, 1.0);
        low + (high - low) * part
    }

    /// Draws cosines.
    #[inline(always)]
    fn cosine<F: Lanes>(&self, u: F) -> F {
        // The last share that is not above u: halving, for all lanes together.
        let intervals = self.values.len() - 1;
        let (mut first, mut size) = (F::zero(), intervals);
        while size > 1 {
            let half = size / 2;
            let middle = first + F::splat(half as f32);
            let below = F::gather(&self.shares, middle.to_int()).le(u);
            first = F::select(below, middle, first);
            size -= half;
        }
        let step = F::splat(2.0 / intervals as f32);
        let [low, high] = self.ends(first);
        let rest = (u - F::gather(&self.shares, first.to_int())).max(F::zero()) / step;
        // Of x in [0, 1]: low·x + (high − low)·x²/2 = rest.
        let root = (low * low + (high - low) * (rest + rest))
            .max(F::zero())
            .sqrt();
        let part = ((rest + rest) / (low + root)).clamp(0.0, 1.0);
        (first + part) * step - F::one()
    }
}

impl Scatter for TabPhase {}

impl BlockPhase for TabPhase {
    #[inline(always)]
    fn eval_lanes<F: Lanes>(&self, _at: Vec3<F>, wi: Vec3<F>, wo: Vec3<F>) -> F {
        self.value(-wo.dot(wi)) * F::splat(FRAC_1_PI / 2.0)
    }

    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        _at: Vec3<F>,
        wi: Vec3<F>,
        _u1: F,
        u2: Vec2<F>,
    ) -> PhaseSamples<F> {
        let cosine = self.cosine(u2.x).clamp(-1.0, 1.0);
        PhaseSamples {
            wo: around(wi, cosine, u2.y),
            pdf: self.value(cosine) / F::splat(2.0 * PI),
        }
    }
}
