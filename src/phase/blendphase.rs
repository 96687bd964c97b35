//! `blendphase`: two nested phase functions, the second with the share `weight`, a number or a volume of numbers, which is
//! clamped to [0, 1].

use super::{BlockPhase, Phase, PhaseSamples, Scatter};
use crate::color::{Mono, Role};
use crate::description::declared::{Plugin, nested, volume};
use crate::description::{Kind, Properties};
use crate::error::Result;
use crate::lanes::{Lanes, MAX_LANES, Vec2, Vec3};
use crate::texture::Palette;
use crate::texture::volume::Volume;

/// Two phase functions.
#[derive(Clone, Debug)]
pub struct BlendPhase {
    weight: Volume<Mono>,
    nested: Box<[Phase; 2]>,
}

impl BlendPhase {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "two phase functions",
        properties: &[&[
            volume("weight", 0.0, "the share of the second, clamped to [0, 1]").required(),
            nested(Kind::Phase, "the two phase functions"),
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, numbers: &Palette<Mono>) -> Result<Self> {
        let nested = <[Phase; 2]>::try_from(Phase::nested(properties, numbers)?);
        let nested = nested.map_err(|nested| {
            let message = format!(
                "blendphase needs 2 nested phase functions, and has {}",
                nested.len()
            );
            properties.error("", message)
        })?;
        Ok(Self {
            weight: Volume::named(properties, "weight", numbers, Role::Quantity)?,
            nested: Box::new(nested),
        })
    }

    #[inline(always)]
    fn weight<F: Lanes>(&self, at: Vec3<F>) -> F {
        self.weight.eval_lanes(at, &[(); MAX_LANES])[0].clamp(0.0, 1.0)
    }
}

impl Scatter for BlendPhase {
    fn has_flakes(&self) -> bool {
        self.nested.iter().any(|phase| phase.has_flakes())
    }

    fn most_area(&self) -> f32 {
        self.nested
            .iter()
            .map(|phase| phase.most_area())
            .fold(0.0, f32::max)
    }
}

impl BlockPhase for BlendPhase {
    #[inline(always)]
    fn eval_lanes<F: Lanes>(&self, at: Vec3<F>, wi: Vec3<F>, wo: Vec3<F>) -> F {
        let [first, second] = &*self.nested;
        let weight = self.weight(at);
        first.eval_lanes(at, wi, wo) * (F::one() - weight) + second.eval_lanes(at, wi, wo) * weight
    }

    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        at: Vec3<F>,
        wi: Vec3<F>,
        u1: F,
        u2: Vec2<F>,
    ) -> PhaseSamples<F> {
        let [first, second] = &*self.nested;
        let weight = self.weight(at);
        let rest = F::one() - weight;
        let chosen = u1.lt(weight);
        // What the choice leaves of the number; a part without a share is never chosen.
        let one = first.sample_lanes(at, wi, ((u1 - weight) / rest).clamp(0.0, BELOW_ONE), u2);
        let other = second.sample_lanes(at, wi, (u1 / weight).clamp(0.0, BELOW_ONE), u2);
        let wo = Vec3::select(chosen, other.wo, one.wo);
        let drawn = F::select(chosen, other.pdf, one.pdf);
        let pdf = first.eval_lanes(at, wi, wo) * rest + second.eval_lanes(at, wi, wo) * weight;
        PhaseSamples {
            wo,
            pdf: F::select(F::zero().lt(drawn), pdf, F::zero()),
        }
    }

    /// The mean of both, as each has its own share of the particles.
    #[inline(always)]
    fn projected_area<F: Lanes>(&self, at: Vec3<F>, wi: Vec3<F>) -> F {
        let [first, second] = &*self.nested;
        let weight = self.weight(at);
        first.projected_area(at, wi) * (F::one() - weight) + second.projected_area(at, wi) * weight
    }
}

const BELOW_ONE: f32 = 1f32.next_down();
