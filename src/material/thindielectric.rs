//! `thindielectric`: a clear pane so thin that light leaves it where it entered: all the reflections
//! inside add up, R = 2F / (1 + F) (Born and Wolf, *Principles of Optics*), and what passes goes straight
//! on. `int_ior` is bk7 glass and `ext_ior` air by default; `specular_reflectance` and
//! `specular_transmittance` (1) multiply.

use glam::{Vec2, Vec3};

use super::{Bsdf, BsdfSample, Lobes, dielectric, fresnel, ior};
use crate::color::ColorModel;
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::interaction::Interaction;
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

    fn sample(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        u1: f32,
        _u2: Vec2,
        w: &C::Wavelengths,
    ) -> Option<BsdfSample<C::Sample>> {
        let once = fresnel::dielectric(wi.z.abs(), self.eta).reflectance;
        let reflectance = once * 2.0 / (1.0 + once);
        if u1 < reflectance {
            return Some(BsdfSample {
                wo: fresnel::mirror::<f32>(wi.into()).into(),
                weight: self.specular_reflectance.eval(at, w),
                pdf: reflectance,
                eta: 1.0,
                delta: true,
                null: false,
            });
        }
        let weight = self.specular_transmittance.eval(at, w);
        Some(BsdfSample::passing(wi, 1.0 - reflectance, weight))
    }
}
