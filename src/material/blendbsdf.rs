//! `blendbsdf`: the first nested material times 1 − `weight` plus the second times `weight` (clamped to
//! [0, 1]). Mitsuba 3.9.1 mixes densities with probabilities where one of the two is a mirror and loses
//! energy; here a direction that only one of them can draw carries the weight of that one alone.

use super::{
    BlockBsdf, Bsdf, BsdfSamples, BsdfValues, Lobes, Material, PhongTerms, fraction, nested,
    single_face,
};
use crate::color::{ColorModel, Mono};
use crate::description::declared::{Plugin, nested as nested_row, number};
use crate::description::{Kind, Properties};
use crate::error::Result;
use crate::interaction::{Interaction, Points};
use crate::lanes::{Lanes, Mask as _, Vec2, Vec3};
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

    fn is_matte(&self) -> bool {
        self.nested.iter().all(|nested| nested.is_matte())
    }

    fn passes(&self) -> bool {
        self.nested.iter().any(|nested| nested.passes())
    }

    single_face!();

    fn ambient(&self, at: &Interaction<'_>, wi: glam::Vec3, w: &C::Wavelengths) -> C::Sample {
        let weight = fraction(&self.weight, at);
        let [first, second] = [0, 1].map(|i: usize| self.nested[i].ambient(at, wi, w));
        first * (1.0 - weight) + second * weight
    }
}

impl<C: ColorModel> BlockBsdf<C> for BlendBsdf<C> {
    #[inline(always)]
    fn eval_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        wo: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        let weight = self.weight.numbers(at).clamp(0.0, 1.0);
        let rest = F::one() - weight;
        let first = self.nested[0].eval_lanes(at, wi, wo, w);
        let second = self.nested[1].eval_lanes(at, wi, wo, w);
        BsdfValues {
            value: first.value * rest + second.value * weight,
            pdf: first.pdf * rest + second.pdf * weight,
        }
    }

    #[inline(always)]
    fn passing_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        let weight = self.weight.numbers(at).clamp(0.0, 1.0);
        let [first, second] = &self.nested;
        let second = second.passing_lanes(at, wi, w);
        let first = first.passing_lanes(at, wi, w);
        first.mixed(F::one() - weight, second, weight)
    }

    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        u1: F,
        u2: Vec2<F>,
        w: &[C::Wavelengths],
    ) -> BsdfSamples<F, C::Columns<F>> {
        let weight = self.weight.numbers(at).clamp(0.0, 1.0);
        let rest = F::one() - weight;
        let second = u1.lt(weight);
        let of_first = ((u1 - weight) / rest).min(F::splat(1f32.next_down()));
        let u1 = F::select(second, u1 / weight, of_first);
        let sample = self.sample_either(second, at, wi, (u1, u2), w);
        let delta = BsdfSamples {
            pdf: sample.pdf * F::select(second, weight, rest),
            ..sample
        };
        if !(sample.drawn & !sample.delta & at.active).any() {
            return delta;
        }
        let both = self.eval_lanes(at, wi, sample.wo, w);
        let both = both.as_samples(sample.wo, sample.eta);
        let either = BsdfSamples::select(sample.delta, delta, both);
        BsdfSamples {
            drawn: either.drawn & sample.drawn,
            ..either
        }
    }

    #[inline(always)]
    fn phong_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        wo: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> Option<PhongTerms<C::Columns<F>>> {
        let weight = self.weight.numbers(at).clamp(0.0, 1.0);
        let first = self.nested[0].phong_lanes(at, wi, wo, w);
        let second = self.nested[1].phong_lanes(at, wi, wo, w);
        let (first, second) = (first.weighted(F::one() - weight), second.weighted(weight));
        Some(PhongTerms {
            diffuse: first.diffuse + second.diffuse,
            specular: first.specular + second.specular,
        })
    }
}

impl<C: ColorModel> BlendBsdf<C> {
    /// Draws from the second material where the mask is set, else from the first.
    #[inline(always)]
    fn sample_either<F: Lanes>(
        &self,
        second: F::Mask,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        (u1, u2): (F, Vec2<F>),
        w: &[C::Wavelengths],
    ) -> BsdfSamples<F, C::Columns<F>> {
        let [a, b] = &self.nested;
        if !(second & at.active).any() {
            return a.sample_lanes(at, wi, u1, u2, w);
        }
        let of_second = b.sample_lanes(at, wi, u1, u2, w);
        if !(!second & at.active).any() {
            return of_second;
        }
        BsdfSamples::select(second, of_second, a.sample_lanes(at, wi, u1, u2, w))
    }
}
