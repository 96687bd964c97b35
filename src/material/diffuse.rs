//! `diffuse`: Lambert's law, f = reflectance / π on the front side; `reflectance` 0.5 by default.

use super::{BlockBsdf, Bsdf, BsdfSamples, BsdfValues, Lambertian, Lobes, PhongTerms, single_face};
use crate::color::{Color, ColorModel, Role, Spectra};
use crate::description::Properties;
use crate::description::declared::{Plugin, texture};
use crate::error::Result;
use crate::interaction::Points;
use crate::lanes::{Lanes, Mask as _, Vec2, Vec3, warp};
use crate::texture::{Palettes, Texture};

/// An ideal matte surface.
#[derive(Clone, Debug)]
pub struct Diffuse<C: ColorModel> {
    reflectance: Texture<C>,
}

impl<C: ColorModel> Diffuse<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "matte",
        properties: &[&[texture(
            "reflectance",
            0.5,
            "the share of light that is reflected",
        )]],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        Ok(Self {
            reflectance: palettes
                .colors
                .texture(properties, "reflectance", Role::Reflectance)?,
        })
    }

    /// The same grey, in [0, 1], everywhere.
    pub(super) fn grey(palettes: &Palettes<C>, value: f64) -> Self {
        let palette = palettes.colors.with_role(Role::Reflectance);
        Self {
            reflectance: palette
                .uniform(&Color::Grey(value))
                .expect("a fraction is a reflectance"),
        }
    }
}

/// Lambert's law for a reflectance.
#[inline(always)]
pub(super) fn eval<F: Lanes, S: Spectra<F>>(
    reflectance: S,
    wi: Vec3<F>,
    wo: Vec3<F>,
) -> BsdfValues<F, S> {
    let seen = F::zero().lt(wi.z) & F::zero().lt(wo.z);
    let pdf = warp::cosine_hemisphere_pdf(wo.z);
    let pdf = F::select(seen, pdf, F::zero());
    BsdfValues {
        value: reflectance * pdf,
        pdf,
    }
}

/// Draws directions by the cosine, where any light is reflected.
#[inline(always)]
pub(super) fn sample<F: Lanes, S: Spectra<F>>(
    reflectance: S,
    wi: Vec3<F>,
    u2: Vec2<F>,
) -> BsdfSamples<F, S> {
    let wo = warp::cosine_hemisphere(u2);
    let pdf = warp::cosine_hemisphere_pdf(wo.z);
    let possible = F::zero().lt(pdf) & pdf.is_finite();
    let none = F::Mask::splat(false);
    BsdfSamples {
        drawn: possible & F::zero().lt(wi.z) & !reflectance.is_black(),
        wo,
        weight: reflectance,
        pdf,
        eta: F::one(),
        delta: none,
        null: none,
    }
}

impl<C: ColorModel> BlockBsdf<C> for Diffuse<C> {
    #[inline(always)]
    fn eval_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        wo: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        eval(self.reflectance.eval_lanes(at, w), wi, wo)
    }

    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        _u1: F,
        u2: Vec2<F>,
        w: &[C::Wavelengths],
    ) -> BsdfSamples<F, C::Columns<F>> {
        sample(self.reflectance.eval_lanes(at, w), wi, u2)
    }

    #[inline(always)]
    fn phong_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        wo: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> Option<PhongTerms<C::Columns<F>>> {
        let terms = PhongTerms {
            diffuse: self.reflectance.eval_lanes(at, w) * wo.z,
            specular: Spectra::zero(),
        };
        Some(terms.only(F::zero().lt(wi.z) & F::zero().lt(wo.z)))
    }
}

impl<C: ColorModel> Bsdf<C> for Diffuse<C> {
    fn lobes(&self) -> Lobes {
        Lobes::REFLECTION
    }

    fn is_matte(&self) -> bool {
        true
    }

    fn lambertian(&self) -> Option<Lambertian<'_, C>> {
        Some(Lambertian {
            reflectance: &self.reflectance,
            twosided: false,
        })
    }

    single_face!();
}
