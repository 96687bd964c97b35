//! `dielectric`: the clear boundary of two media, such as glass (`int_ior`, bk7 by default) in air
//! (`ext_ior`). It reflects the Fresnel share and refracts the rest, whose radiance changes by 1/η².
//! `specular_reflectance` and `specular_transmittance` (1) multiply. Where an index is a spectrum, an extension, bands are
//! refracted apart ([`dispersion`](super::dispersion)).

use super::dispersion::Dispersion;
use super::{BlockBsdf, Bsdf, BsdfSamples, Lobes, fresnel, ior, single_face};
use crate::color::{ColorModel, Role};
use crate::description::Properties;
use crate::description::declared::{Plugin, Row, texture};
use crate::error::Result;
use crate::interaction::Points;
use crate::lanes::{Lanes, Mask as _, Vec2, Vec3};
use crate::texture::{Palettes, Texture};

/// A clear boundary.
#[derive(Clone, Debug)]
pub struct Dielectric<C: ColorModel> {
    /// Index of refraction, inside over outside.
    eta: f32,
    /// The same over wavelength, where it depends on that.
    dispersion: Option<Box<Dispersion<C>>>,
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
        properties: &[&super::ior::dispersive("bk7"), FACTORS],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let [specular_reflectance, specular_transmittance] = factors(properties, palettes)?;
        Ok(Self {
            eta: ior::relative_of_yellow(properties)?,
            dispersion: Dispersion::build(properties, palettes)?,
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

    single_face!();
}

impl<C: ColorModel> BlockBsdf<C> for Dielectric<C> {
    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        u1: F,
        u2: Vec2<F>,
        w: &[C::Wavelengths],
    ) -> BsdfSamples<F, C::Columns<F>> {
        if let Some(dispersion) = &self.dispersion {
            let factors = [
                self.specular_reflectance.eval_lanes(at, w),
                self.specular_transmittance.eval_lanes(at, w),
            ];
            return dispersion.sample(wi, [u1, u2.x], factors, w);
        }
        let boundary = fresnel::dielectric(wi.z, self.eta);
        let all = F::Mask::splat(true);
        let reflected = BsdfSamples::delta(
            all,
            fresnel::mirror(wi),
            self.specular_reflectance.eval_lanes(at, w),
            boundary.reflectance,
        );
        let normal = Vec3::all(glam::Vec3::Z);
        let spread = F::one() / (boundary.eta * boundary.eta);
        let refracted = BsdfSamples {
            eta: boundary.eta,
            ..BsdfSamples::delta(
                all,
                fresnel::refract(wi, normal, &boundary),
                self.specular_transmittance.eval_lanes(at, w) * spread,
                F::one() - boundary.reflectance,
            )
        };
        BsdfSamples::select(u1.lt(boundary.reflectance), reflected, refracted)
    }
}
