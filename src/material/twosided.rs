//! `twosided`: lets a one-sided material be seen from both sides; a second nested one covers the back.

use glam::{Vec2, Vec3};

use super::{Bsdf, BsdfSample, BsdfValue, Lobes, Material, PhongTerms, nested};
use crate::color::ColorModel;
use crate::description::declared::{Plugin, boolean, nested as nested_row};
use crate::description::{Kind, Properties};
use crate::error::Result;
use crate::interaction::Interaction;
use crate::texture::Palettes;

/// A material for each side.
#[derive(Clone, Debug)]
pub struct TwoSided<C: ColorModel> {
    front: Box<Material<C>>,
    /// The front's where absent.
    back: Option<Box<Material<C>>>,
}

impl<C: ColorModel> TwoSided<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a material on both sides, or one on each",
        properties: &[&[
            nested_row(Kind::Bsdf, "the material, or the front's and the back's"),
            boolean(
                "allow_transmission",
                false,
                "whether materials may let light through",
            ),
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let sides = nested(properties, palettes, 1..=2)?;
        let allowed = properties.boolean("allow_transmission")?;
        if !allowed && sides.iter().any(|side| side.lobes().transmission) {
            let message =
                "twosided takes materials that only reflect, and one of these transmits light";
            return Err(properties
                .error("", message)
                .help("put the twosided inside the mask or blendbsdf, not around it"));
        }
        let mut sides = sides.into_iter().map(Box::new);
        let front = sides.next().expect("there is at least one");
        Ok(Self {
            front,
            back: sides.next(),
        })
    }

    /// The material on the side of `wi`, and the factor that brings it to the front.
    fn side(&self, wi: Vec3) -> (&Material<C>, Vec3) {
        match &self.back {
            _ if wi.z >= 0.0 => (&self.front, Vec3::ONE),
            Some(back) => (back, FLIP),
            None => (&self.front, FLIP),
        }
    }
}

const FLIP: Vec3 = Vec3::new(1.0, 1.0, -1.0);

impl<C: ColorModel> Bsdf<C> for TwoSided<C> {
    fn lobes(&self) -> Lobes {
        let back = self.back.as_ref().map(|b| b.lobes());
        Lobes {
            smooth: self.front.is_smooth() || back.is_some_and(|b| b.smooth),
            transmission: false,
        }
    }

    fn eval(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        wo: Vec3,
        w: &C::Wavelengths,
    ) -> Option<BsdfValue<C::Sample>> {
        let (material, flip) = self.side(wi);
        material.eval(at, wi * flip, wo * flip, w)
    }

    fn sample(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        u1: f32,
        u2: Vec2,
        w: &C::Wavelengths,
    ) -> Option<BsdfSample<C::Sample>> {
        let (material, flip) = self.side(wi);
        let sample = material.sample(at, wi * flip, u1, u2, w)?;
        Some(BsdfSample {
            wo: sample.wo * flip,
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
        let (material, flip) = self.side(wi);
        material.phong(at, wi * flip, wo * flip, w)
    }

    fn ambient(&self, at: &Interaction<'_>, wi: Vec3, w: &C::Wavelengths) -> C::Sample {
        let (material, flip) = self.side(wi);
        material.ambient(at, wi * flip, w)
    }
}
