//! `mask`: the nested material with probability `opacity` (0.5; clamped to [0, 1]), nothing otherwise.

use glam::{Vec2, Vec3};

use super::{Bsdf, BsdfSample, BsdfValue, Lobes, Material, PhongTerms, fraction, nested};
use crate::color::{ColorModel, Mono, Spectral};
use crate::description::declared::{Plugin, nested as nested_row, number};
use crate::description::{Kind, Properties};
use crate::error::Result;
use crate::interaction::Interaction;
use crate::texture::{Palettes, Texture};

/// A material with holes.
#[derive(Clone, Debug)]
pub struct Mask<C: ColorModel> {
    opacity: Texture<Mono>,
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
            nested_row(Kind::Bsdf, "the material"),
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let mut nested = nested(properties, palettes, 1..=1)?;
        Ok(Self {
            opacity: palettes.numbers.number(properties, "opacity")?,
            nested: Box::new(nested.remove(0)),
        })
    }
}

impl<C: ColorModel> Bsdf<C> for Mask<C> {
    fn lobes(&self) -> Lobes {
        Lobes {
            transmission: true,
            ..self.nested.lobes()
        }
    }

    fn eval(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        wo: Vec3,
        w: &C::Wavelengths,
    ) -> Option<BsdfValue<C::Sample>> {
        let opacity = fraction(&self.opacity, at);
        let value = self.nested.eval(at, wi, wo, w)?;
        Some(BsdfValue {
            value: value.value * opacity,
            pdf: value.pdf * opacity,
        })
    }

    fn sample(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        u1: f32,
        u2: Vec2,
        w: &C::Wavelengths,
    ) -> Option<BsdfSample<C::Sample>> {
        let opacity = fraction(&self.opacity, at);
        if u1 >= opacity {
            let one = C::Sample::splat(1.0);
            return Some(BsdfSample::passing(wi, 1.0 - opacity, one));
        }
        let sample = self.nested.sample(at, wi, u1 / opacity, u2, w)?;
        Some(BsdfSample {
            pdf: sample.pdf * opacity,
            ..sample
        })
    }

    fn phong(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        wo: Vec3,
        w: &C::Wavelengths,
    ) -> Option<PhongTerms<C::Sample>> {
        let terms = self.nested.phong(at, wi, wo, w)?;
        Some(terms.weighted(fraction(&self.opacity, at)))
    }

    fn ambient(&self, at: &Interaction<'_>, wi: Vec3, w: &C::Wavelengths) -> C::Sample {
        self.nested.ambient(at, wi, w) * fraction(&self.opacity, at)
    }
}
