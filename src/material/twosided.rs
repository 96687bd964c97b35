//! `twosided`: lets a one-sided material be seen from both sides; a second nested one covers the back.

use super::{
    BlockBsdf, Bsdf, BsdfSamples, BsdfValues, Lambertian, Lobes, Material, PhongTerms, nested,
    single_face,
};
use crate::color::{ColorModel, Spectra};
use crate::description::declared::{Plugin, boolean, nested as nested_row};
use crate::description::{Kind, Properties};
use crate::error::Result;
use crate::interaction::{Interaction, Points};
use crate::lanes::{Lanes, Mask as _, Vec2, Vec3};
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
    fn side(&self, wi: glam::Vec3) -> (&Material<C>, glam::Vec3) {
        match &self.back {
            _ if wi.z >= 0.0 => (&self.front, glam::Vec3::ONE),
            Some(back) => (back, FLIP),
            None => (&self.front, FLIP),
        }
    }
}

const FLIP: glam::Vec3 = glam::Vec3::new(1.0, 1.0, -1.0);

impl<C: ColorModel> Bsdf<C> for TwoSided<C> {
    fn lobes(&self) -> Lobes {
        let back = self.back.as_ref().map(|b| b.lobes());
        Lobes {
            smooth: self.front.is_smooth() || back.is_some_and(|b| b.smooth),
            transmission: false,
        }
    }

    fn is_matte(&self) -> bool {
        self.front.is_matte() && self.back.as_ref().is_none_or(|back| back.is_matte())
    }

    fn lambertian(&self) -> Option<Lambertian<'_, C>> {
        let front = self.front.lambertian().filter(|_| self.back.is_none())?;
        Some(Lambertian {
            twosided: true,
            ..front
        })
    }

    fn passes(&self) -> bool {
        self.front.passes() || self.back.as_ref().is_some_and(|back| back.passes())
    }

    single_face!();

    fn ambient(&self, at: &Interaction<'_>, wi: glam::Vec3, w: &C::Wavelengths) -> C::Sample {
        let (material, flip) = self.side(wi);
        material.ambient(at, wi * flip, w)
    }
}

/// Directions of which those at points seen from behind are turned over.
#[inline(always)]
pub(super) fn turned<F: Lanes>(behind: F::Mask, v: Vec3<F>) -> Vec3<F> {
    Vec3::new(v.x, v.y, F::select(behind, -v.z, v.z))
}

impl<C: ColorModel> BlockBsdf<C> for TwoSided<C> {
    #[inline(always)]
    fn eval_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        wo: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        let behind = wi.z.lt(F::zero());
        let (wi, wo) = (turned(behind, wi), turned(behind, wo));
        let front = self.front.eval_lanes(at, wi, wo, w);
        match &self.back {
            Some(back) if (behind & at.active).any() => {
                BsdfValues::select(behind, back.eval_lanes(at, wi, wo, w), front)
            }
            _ => front,
        }
    }

    #[inline(always)]
    fn passing_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        let behind = wi.z.lt(F::zero());
        let wi = turned(behind, wi);
        let front = self.front.passing_lanes(at, wi, w);
        match &self.back {
            Some(back) => BsdfValues::select(behind, back.passing_lanes(at, wi, w), front),
            None => front,
        }
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
        let behind = wi.z.lt(F::zero());
        let wi = turned(behind, wi);
        let front = self.front.sample_lanes(at, wi, u1, u2, w);
        let samples = match &self.back {
            Some(back) if (behind & at.active).any() => {
                BsdfSamples::select(behind, back.sample_lanes(at, wi, u1, u2, w), front)
            }
            _ => front,
        };
        BsdfSamples {
            wo: turned(behind, samples.wo),
            ..samples
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
        let behind = wi.z.lt(F::zero());
        let (wi, wo) = (turned(behind, wi), turned(behind, wo));
        let front = self.front.phong_lanes(at, wi, wo, w);
        let Some(back) = &self.back else {
            return Some(front);
        };
        let back = back.phong_lanes(at, wi, wo, w);
        Some(PhongTerms {
            diffuse: Spectra::select(behind, back.diffuse, front.diffuse),
            specular: Spectra::select(behind, back.specular, front.specular),
        })
    }
}
