//! `roughdielectric`: ground glass, a rough boundary of two media (Walter et al., *Microfacet models for
//! refraction through rough surfaces*, 2007). Parameters of the media as for a dielectric, of the
//! roughness as for a roughconductor.

use super::dispersion::Dispersion;
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
    /// The same over wavelength, where it depends on that.
    dispersion: Option<Box<Dispersion<C>>>,
    specular_reflectance: Texture<C>,
    specular_transmittance: Texture<C>,
}

impl<C: ColorModel> RoughDielectric<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "rough glass",
        properties: &[
            &super::ior::dispersive("bk7"),
            super::microfacet::STRETCHED,
            dielectric::FACTORS,
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let [specular_reflectance, specular_transmittance] =
            dielectric::factors(properties, palettes)?;
        Ok(Self {
            roughness: Roughness::build(properties, &palettes.numbers)?,
            eta: ior::different(properties, ior::relative_of_yellow(properties)?)?,
            dispersion: Dispersion::build(properties, palettes)?,
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
        if let Some(dispersion) = &self.dispersion {
            return self.eval_dispersed(dispersion, at, wi, wo, w);
        }
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
        let (boundary, u1) = match &self.dispersion {
            None => (fresnel::dielectric(wi.dot(m), self.eta), u1),
            Some(dispersion) => {
                let index = dispersion.chosen(dispersion.indices::<F>(w), dispersion.choose(u1));
                (
                    fresnel::dielectric_lanes(wi.dot(m), index),
                    dispersion.rest(u1),
                )
            }
        };
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

impl<C: ColorModel> RoughDielectric<C> {
    /// The values where each wavelength has its own index. The density is that of drawing with one of them, chosen evenly.
    #[inline(always)]
    fn eval_dispersed<F: Lanes>(
        &self,
        dispersion: &Dispersion<C>,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        wo: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        let (zero, one) = (F::zero(), F::one());
        let distribution = self.roughness.at_lanes(at);
        let drawn_from = drawn_from(distribution, wi);
        let front = microfacet::in_front(wi);
        let indices = dispersion.indices::<F>(w);
        let (mut values, mut densities) = (C::Columns::<F>::zero(), C::Columns::<F>::zero());
        for channel in 0..C::Columns::<F>::CHANNELS {
            let index = indices[channel];
            let interface = Interface::between_lanes(wi, wo, index);
            let m = interface.m;
            let cos = wi.dot(m);
            let reflectance = fresnel::dielectric_lanes(cos, index).reflectance;
            let dg = distribution.eval(m) * distribution.g(wi, wo, m);
            let share = F::select(interface.reflection, reflectance, one - reflectance);
            let radiance = one / (interface.eta * interface.eta);
            let value = share * dg * radiance * interface.jacobian * (cos / wi.z).abs();
            let density = drawn_from.pdf(front, m) * share * interface.jacobian;
            let there = interface.found & zero.lt(dg);
            values.set(channel, F::select(there, value, zero));
            densities.set(channel, F::select(there, density, zero));
        }
        let factor = C::Columns::<F>::select(
            zero.lt(wi.z * wo.z),
            self.specular_reflectance.eval_lanes(at, w),
            self.specular_transmittance.eval_lanes(at, w),
        );
        BsdfValues {
            value: factor * values,
            pdf: dispersion.mean(densities),
        }
    }
}
