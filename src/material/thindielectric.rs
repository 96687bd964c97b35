//! `thindielectric`: a clear pane so thin that light leaves it where it entered: all the reflections
//! inside add up, R = 2F / (1 + F) (Born and Wolf, *Principles of Optics*), and what passes goes straight
//! on. `int_ior` is bk7 glass and `ext_ior` air by default; `specular_reflectance` and
//! `specular_transmittance` (1) multiply.

use super::{BlockBsdf, Bsdf, BsdfSamples, Lobes, dielectric, fresnel, ior, single_face};
use crate::color::ColorModel;
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::interaction::Points;
use crate::lanes::{Lanes, Mask as _, Vec2, Vec3};
use crate::texture::{Palettes, Texture};

/// A thin clear pane.
#[derive(Clone, Debug)]
pub struct ThinDielectric<C: ColorModel> {
    /// Index of refraction, inside over outside.
    eta: f32,
    specular_reflectance: Texture<C>,
    specular_transmittance: Texture<C>,
}

impl<C: ColorModel> ThinDielectric<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a thin pane of glass",
        properties: &[&super::ior::dielectric("bk7"), dielectric::FACTORS],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let [specular_reflectance, specular_transmittance] =
            dielectric::factors(properties, palettes)?;
        Ok(Self {
            eta: ior::relative(properties)?,
            specular_reflectance,
            specular_transmittance,
        })
    }
}

impl<C: ColorModel> Bsdf<C> for ThinDielectric<C> {
    fn lobes(&self) -> Lobes {
        Lobes {
            smooth: false,
            transmission: true,
        }
    }

    single_face!();
}

impl<C: ColorModel> BlockBsdf<C> for ThinDielectric<C> {
    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        u1: F,
        _u2: Vec2<F>,
        w: &[C::Wavelengths],
    ) -> BsdfSamples<F, C::Columns<F>> {
        let once = fresnel::dielectric(wi.z.abs(), self.eta).reflectance;
        let reflectance = (once + once) / (F::one() + once);
        let reflected = BsdfSamples::delta(
            F::Mask::splat(true),
            fresnel::mirror(wi),
            self.specular_reflectance.eval_lanes(at, w),
            reflectance,
        );
        let transmittance = self.specular_transmittance.eval_lanes(at, w);
        let passing = BsdfSamples::passing(wi, F::one() - reflectance, transmittance);
        BsdfSamples::select(u1.lt(reflectance), reflected, passing)
    }
}
