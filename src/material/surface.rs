//! What a block of paths has met, for all that is asked of it in a bounce. Most materials are asked anew each time; one of
//! Lambert's law tells its reflectance once, for in bands that is most of what it takes.

use super::{BsdfSamples, BsdfValues, Material, diffuse, twosided};
use crate::color::ColorModel;
use crate::interaction::Points;
use crate::lanes::{Lanes, Mask as _, Vec2, Vec3};
use crate::texture::Texture;

/// What a material is made of that scatters by Lambert's law.
#[derive(Clone, Copy, Debug)]
pub struct Lambertian<'a, C: ColorModel> {
    pub(super) reflectance: &'a Texture<C>,
    /// Whether its back is like its front.
    pub(super) twosided: bool,
}

/// A material at points, each seen from where its path came from.
#[derive(Debug)]
pub struct Surface<'a, C: ColorModel, F: Lanes> {
    material: &'a Material<C>,
    at: &'a Points<'a, F>,
    /// From the first lane on.
    w: &'a [C::Wavelengths],
    /// Of a material of Lambert's law its reflectance, and which lanes see its back.
    lambertian: Option<(C::Columns<F>, F::Mask)>,
}

impl<C: ColorModel> Material<C> {
    /// The material at points, whose paths' wavelengths are given from the first lane on.
    #[inline(always)]
    pub fn surface<'a, F: Lanes>(
        &'a self,
        at: &'a Points<'a, F>,
        w: &'a [C::Wavelengths],
    ) -> Surface<'a, C, F> {
        let lambertian = match self.lambertian() {
            Some(found) => {
                let behind = at.wi.z.lt(F::zero()) & F::Mask::splat(found.twosided);
                Some((found.reflectance.eval_lanes(at, w), behind))
            }
            None => None,
        };
        Surface {
            material: self,
            at,
            w,
            lambertian,
        }
    }
}

impl<C: ColorModel, F: Lanes> Surface<'_, C, F> {
    /// [`Material::eval_lanes`].
    #[inline(always)]
    pub fn eval(&self, wo: Vec3<F>) -> BsdfValues<F, C::Columns<F>> {
        let wi = self.at.wi;
        match self.lambertian {
            Some((reflectance, behind)) => {
                let (wi, wo) = (twosided::turned(behind, wi), twosided::turned(behind, wo));
                diffuse::eval(reflectance, wi, wo)
            }
            None => self.material.eval_lanes(self.at, wi, wo, self.w),
        }
    }

    /// Whether there is but one lobe, so that no number is asked which it is.
    #[inline(always)]
    pub fn has_one_lobe(&self) -> bool {
        self.lambertian.is_some()
    }

    /// [`Material::sample_lanes`].
    #[inline(always)]
    pub fn sample(&self, u1: F, u2: Vec2<F>) -> BsdfSamples<F, C::Columns<F>> {
        let wi = self.at.wi;
        match self.lambertian {
            Some((reflectance, behind)) => {
                let samples = diffuse::sample(reflectance, twosided::turned(behind, wi), u2);
                BsdfSamples {
                    wo: twosided::turned(behind, samples.wo),
                    ..samples
                }
            }
            None => self.material.sample_lanes(self.at, wi, u1, u2, self.w),
        }
    }
}
