//! `diffuse`: Lambert's law, f = reflectance / π on the front side; `reflectance` 0.5 by default.

use super::{BlockBsdf, Bsdf, BsdfSamples, BsdfValues, Lobes, PhongTerms, single_face};
use crate::color::{Color, ColorModel, Role, Spectra};
use crate::description::Properties;
use crate::description::declared::{Plugin, texture};
use crate::error::Result;
use crate::interaction::Points;
use crate::lanes::{Lanes, Vec2, Vec3, warp};
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

impl<C: ColorModel> BlockBsdf<C> for Diffuse<C> {
    #[inline(always)]
    fn eval_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        wo: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        let seen = F::zero().lt(wi.z) & F::zero().lt(wo.z);
        let pdf = warp::cosine_hemisphere_pdf(wo.z);
        let value = self.reflectance.eval_lanes(at, w) * pdf;
        BsdfValues { value, pdf }.only(seen)
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
        let wo = warp::cosine_hemisphere(u2);
        let pdf = warp::cosine_hemisphere_pdf(wo.z);
        let weight = self.reflectance.eval_lanes(at, w);
        let values = BsdfValues {
            value: weight * pdf,
            pdf,
        };
        let samples = values.as_samples(wo, F::one());
        BsdfSamples {
            drawn: samples.drawn & F::zero().lt(wi.z) & !weight.is_black(),
            weight,
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

    single_face!();
}
