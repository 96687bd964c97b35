//! `blendbsdf`: the first nested material times 1 − `weight` plus the second times `weight` (clamped to
//! [0, 1]). Mitsuba 3.9.1 mixes densities with probabilities where one of the two is a mirror and loses
//! energy; here a direction that only one of them can draw carries the weight of that one alone.

use glam::{Vec2, Vec3};

use super::{Bsdf, BsdfSample, BsdfValue, Lobes, Material, PhongTerms, fraction, nested};
use crate::color::{ColorModel, Mono};
use crate::description::declared::{Plugin, nested as nested_row, number};
use crate::description::{Kind, Properties};
use crate::error::Result;
use crate::interaction::Interaction;
use crate::texture::{Palettes, Texture};

/// Two materials, mixed.
#[derive(Clone, Debug)]
pub struct BlendBsdf<C: ColorModel> {
    weight: Texture<Mono>,
    nested: [Box<Material<C>>; 2],
}

impl<C: ColorModel> BlendBsdf<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "two materials, mixed",
        properties: &[&[
            number("weight", 0.5, "the share of the second, clamped to [0, 1]").required(),
            nested_row(Kind::Bsdf, "the two"),
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let mut nested = nested(properties, palettes, 2..=2)?;
        let second = Box::new(nested.remove(1));
        Ok(Self {
            weight: palettes.numbers.number(properties, "weight")?,
            nested: [Box::new(nested.remove(0)), second],
        })
    }
}

impl<C: ColorModel> Bsdf<C> for BlendBsdf<C> {
    fn lobes(&self) -> Lobes {
        let [a, b] = [self.nested[0].lobes(), self.nested[1].lobes()];
        Lobes {
            smooth: a.smooth || b.smooth,
            transmission: a.transmission || b.transmission,
        }
    }

    fn eval(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        wo: Vec3,
        w: &C::Wavelengths,
    ) -> Option<BsdfValue<C::Sample>> {
        let weight = fraction(&self.weight, at);
        let part = |i: usize, weight: f32| {
            let value = self.nested[i].eval(at, wi, wo, w)?;
            Some(BsdfValue {
                value: value.value * weight,
                pdf: value.pdf * weight,
            })
        };
        match (part(0, 1.0 - weight), part(1, weight)) {
            (Some(a), Some(b)) => Some(BsdfValue {
                value: a.value + b.value,
                pdf: a.pdf + b.pdf,
            }),
            (a, b) => a.or(b),
        }
    }

    fn sample(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        u1: f32,
        u2: Vec2,
        w: &C::Wavelengths,
    ) -> Option<BsdfSample<C::Sample>> {
        let weight = fraction(&self.weight, at);
        let (chosen, share, u1) = if u1 < weight {
            (1, weight, u1 / weight)
        } else {
            let rest = 1.0 - weight;
            (0, rest, ((u1 - weight) / rest).min(1f32.next_down()))
        };
        let sample = self.nested[chosen].sample(at, wi, u1, u2, w)?;
        if sample.delta {
            return Some(BsdfSample {
                pdf: sample.pdf * share,
                ..sample
            });
        }
        self.eval(at, wi, sample.wo, w)?
            .as_sample(sample.wo, sample.eta)
    }

    fn phong(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        wo: Vec3,
        w: &C::Wavelengths,
    ) -> Option<PhongTerms<C::Sample>> {
        let weight = fraction(&self.weight, at);
        let part = |i: usize, weight: f32| {
            let terms = self.nested[i].phong(at, wi, wo, w)?;
            Some(terms.weighted(weight))
        };
        match (part(0, 1.0 - weight), part(1, weight)) {
            (Some(a), Some(b)) => Some(PhongTerms {
                diffuse: a.diffuse + b.diffuse,
                specular: a.specular + b.specular,
            }),
            (a, b) => a.or(b),
        }
    }

    fn ambient(&self, at: &Interaction<'_>, wi: Vec3, w: &C::Wavelengths) -> C::Sample {
        let weight = fraction(&self.weight, at);
        let [first, second] = [0, 1].map(|i: usize| self.nested[i].ambient(at, wi, w));
        first * (1.0 - weight) + second * weight
    }
}
