//! `dielectric`: the clear boundary of two media, such as glass (`int_ior`, bk7 by default) in air
//! (`ext_ior`). It reflects the Fresnel share and refracts the rest, whose radiance changes by 1/η².
//! `specular_reflectance` and `specular_transmittance` (1) multiply.

use glam::{Vec2, Vec3};

use super::{Bsdf, BsdfSample, Lobes, fresnel, ior};
use crate::color::{ColorModel, Role};
use crate::description::Properties;
use crate::description::declared::{Plugin, Row, texture};
use crate::error::Result;
use crate::interaction::Interaction;
use crate::texture::{Palettes, Texture};

/// A clear boundary.
#[derive(Clone, Debug)]
pub struct Dielectric<C: ColorModel> {
    /// Index of refraction, inside over outside.
    eta: f32,
    specular_reflectance: Texture<C>,
    specular_transmittance: Texture<C>,
}

/// What light is multiplied by at all clear boundaries.
pub(super) const FACTORS: &[Row] = &[
    texture("specular_reflectance", 1.0, "factor on what is reflected"),
    texture(
        "specular_transmittance",
        1.0,
        "factor on what is let through",
    ),
];

/// The properties [`FACTORS`].
pub(super) fn factors<C: ColorModel>(
    properties: &Properties<'_>,
    palettes: &Palettes<C>,
) -> Result<[Texture<C>; 2]> {
    let factor = |name| palettes.colors.texture(properties, name, Role::Reflectance);
    Ok([
        factor("specular_reflectance")?,
        factor("specular_transmittance")?,
    ])
}

impl<C: ColorModel> Dielectric<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "smooth glass",
        properties: &[&super::ior::dielectric("bk7"), FACTORS],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let [specular_reflectance, specular_transmittance] = factors(properties, palettes)?;
        Ok(Self {
            eta: ior::relative(properties)?,
            specular_reflectance,
            specular_transmittance,
        })
    }
}

impl<C: ColorModel> Bsdf<C> for Dielectric<C> {
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
        let boundary = fresnel::dielectric(wi.z, self.eta);
        Some(if u1 < boundary.reflectance {
            BsdfSample {
                wo: fresnel::mirror(wi),
                weight: self.specular_reflectance.eval(at, w),
                pdf: boundary.reflectance,
                eta: 1.0,
                delta: true,
                null: false,
            }
        } else {
            BsdfSample {
                wo: fresnel::refract(wi, Vec3::Z, &boundary),
                weight: self.specular_transmittance.eval(at, w) / (boundary.eta * boundary.eta),
                pdf: 1.0 - boundary.reflectance,
                eta: boundary.eta,
                delta: true,
                null: false,
            }
        })
    }
}
