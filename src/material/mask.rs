//! `mask`: the nested material with probability `opacity` (0.5; clamped to [0, 1]), nothing otherwise. With Étendue's own
//! `cutoff` there is nothing where the opacity is below that, and all of the material elsewhere.

use super::{
    BlockBsdf, Bsdf, BsdfSamples, BsdfValues, Lobes, Material, PhongTerms, nested, single_face,
};
use crate::color::{ColorModel, Mono, Spectra};
use crate::description::declared::{Plugin, float, nested as nested_row, number};
use crate::description::{Kind, Properties};
use crate::error::Result;
use crate::interaction::{Interaction, Points};
use crate::lanes::{Lanes, Mask as _, Vec2, Vec3};
use crate::texture::{Palettes, Texture};

/// A material with holes.
#[derive(Clone, Debug)]
pub struct Mask<C: ColorModel> {
    opacity: Texture<Mono>,
    cutoff: Option<f32>,
    nested: Box<Material<C>>,
}

impl<C: ColorModel> Mask<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a material with holes",
        properties: &[&[
            number(
                "opacity",
                0.5,
                "the share of light that meets the material, clamped to [0, 1]",
            ),
            float(
                "cutoff",
                0.5,
                "the opacity below which there is nothing, and all from there on",
            )
            .absent("as much as the opacity says")
            .own(),
            nested_row(Kind::Bsdf, "the material"),
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let mut nested = nested(properties, palettes, 1..=1)?;
        Ok(Self {
            opacity: palettes.numbers.number(properties, "opacity")?,
            cutoff: properties
                .given::<f64>("cutoff")?
                .map(|cutoff| cutoff as f32),
            nested: Box::new(nested.remove(0)),
        })
    }
}

impl<C: ColorModel> Mask<C> {
    /// The share of light that meets the material.
    #[inline(always)]
    fn opacity<F: Lanes>(&self, at: &Points<'_, F>) -> F {
        let opacity = self.opacity.numbers(at);
        match self.cutoff {
            Some(cutoff) => F::select(opacity.lt(F::splat(cutoff)), F::zero(), F::one()),
            None => opacity.clamp(0.0, 1.0),
        }
    }
}

impl<C: ColorModel> Bsdf<C> for Mask<C> {
    fn lobes(&self) -> Lobes {
        Lobes {
            transmission: true,
            ..self.nested.lobes()
        }
    }

    fn is_matte(&self) -> bool {
        self.nested.is_matte()
    }

    fn passes(&self) -> bool {
        true
    }

    single_face!();

    fn ambient(&self, at: &Interaction<'_>, wi: glam::Vec3, w: &C::Wavelengths) -> C::Sample {
        self.nested.ambient(at, wi, w) * self.opacity::<f32>(&Points::one(at))
    }
}

impl<C: ColorModel> BlockBsdf<C> for Mask<C> {
    #[inline(always)]
    fn eval_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        wo: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        let opacity = self.opacity(at);
        let values = self.nested.eval_lanes(at, wi, wo, w);
        BsdfValues {
            value: values.value * opacity,
            pdf: values.pdf * opacity,
        }
    }

    #[inline(always)]
    fn passing_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        let opacity = self.opacity(at);
        let all = BsdfValues {
            value: C::Columns::<F>::splat(F::one()),
            pdf: F::one(),
        };
        let nested = self.nested.passing_lanes(at, wi, w);
        nested.mixed(opacity, all, F::one() - opacity)
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
        let opacity = self.opacity(at);
        let met = u1.lt(opacity);
        let one = C::Columns::<F>::splat(F::one());
        let passing = BsdfSamples::passing(wi, F::one() - opacity, one);
        if !(met & at.active).any() {
            return passing;
        }
        let nested = self.nested.sample_lanes(at, wi, u1 / opacity, u2, w);
        let nested = BsdfSamples {
            pdf: nested.pdf * opacity,
            ..nested
        };
        BsdfSamples::select(met, nested, passing)
    }

    #[inline(always)]
    fn phong_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        wo: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> Option<PhongTerms<C::Columns<F>>> {
        let opacity = self.opacity(at);
        let terms = self.nested.phong_lanes(at, wi, wo, w);
        Some(terms.weighted(opacity))
    }
}
