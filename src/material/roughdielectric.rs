//! `roughdielectric`: ground glass, a rough boundary of two media (Walter et al., *Microfacet models for
//! refraction through rough surfaces*, 2007). Parameters of the media as for a dielectric, of the
//! roughness as for a roughconductor.

use super::microfacet::{self, Distribution, Interface, Roughness};
use super::{
    BlockBsdf, Bsdf, BsdfSamples, BsdfValues, Lobes, dielectric, fresnel, ior, single_face,
};
use crate::color::{ColorModel, Spectra};
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::interaction::Points;
use crate::lanes::{Lanes, Vec2, Vec3};
use crate::texture::{Palettes, Texture};

/// A rough clear boundary.
#[derive(Clone, Debug)]
pub struct RoughDielectric<C: ColorModel> {
    roughness: Roughness,
    /// Index of refraction, inside over outside.
    eta: f32,
    specular_reflectance: Texture<C>,
    specular_transmittance: Texture<C>,
}

impl<C: ColorModel> RoughDielectric<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "rough glass",
        properties: &[
            &super::ior::dielectric("bk7"),
            super::microfacet::STRETCHED,
            dielectric::FACTORS,
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let [specular_reflectance, specular_transmittance] =
            dielectric::factors(properties, palettes)?;
        Ok(Self {
            roughness: Roughness::build(properties, &palettes.numbers)?,
            eta: ior::relative_and_different(properties)?,
            specular_reflectance,
            specular_transmittance,
        })
    }
}

/// The distribution to draw from: broader where facets are drawn by area, which keeps weights small
/// (Walter et al., §5.3).
#[inline(always)]
fn drawn_from<F: Lanes>(distribution: Distribution<F>, wi: Vec3<F>) -> Distribution<F> {
    if distribution.samples_visible() {
        distribution
    } else {
        distribution.scaled(F::splat(1.2) - F::splat(0.2) * wi.z.abs().sqrt())
    }
}

impl<C: ColorModel> Bsdf<C> for RoughDielectric<C> {
    fn lobes(&self) -> Lobes {
        Lobes {
            smooth: true,
            transmission: true,
        }
    }

    single_face!();
}

impl<C: ColorModel> BlockBsdf<C> for RoughDielectric<C> {
    #[inline(always)]
    fn eval_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        wo: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        let one = F::one();
        let interface = Interface::between(wi, wo, self.eta);
        let (m, reflection) = (interface.m, interface.reflection);
        let distribution = self.roughness.at_lanes(at);
        let cos = wi.dot(m);
        let reflectance = fresnel::dielectric(cos, self.eta).reflectance;
        let dg = distribution.eval(m) * distribution.g(wi, wo, m);
        let share = F::select(reflection, reflectance, one - reflectance);
        let factor = C::Columns::<F>::select(
            reflection,
            self.specular_reflectance.eval_lanes(at, w),
            self.specular_transmittance.eval_lanes(at, w),
        );
        // That of refracted light; 1 for what is reflected.
        let radiance = one / (interface.eta * interface.eta);
        let scale = share * dg * radiance * interface.jacobian * (cos / wi.z).abs();
        let facets = drawn_from(distribution, wi).pdf(microfacet::in_front(wi), m);
        let values = BsdfValues {
            value: factor * scale,
            pdf: facets * share * interface.jacobian,
        };
        values.only(interface.found & F::zero().lt(dg))
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
        let distribution = drawn_from(self.roughness.at_lanes(at), wi);
        let m = distribution.sample(microfacet::in_front(wi), u2);
        let boundary = fresnel::dielectric(wi.dot(m), self.eta);
        let reflected = u1.lt(boundary.reflectance);
        let wo = Vec3::select(
            reflected,
            fresnel::reflect(wi, m),
            fresnel::refract(wi, m, &boundary),
        );
        let eta = F::select(reflected, F::one(), boundary.eta);
        let samples = self.eval_lanes(at, wi, wo, w).as_samples(wo, eta);
        // Other facets send the light to the wrong side of the surface.
        let fits = !(reflected ^ F::zero().lt(wo.z * wi.z));
        BsdfSamples {
            drawn: samples.drawn & fits,
            ..samples
        }
    }
}
