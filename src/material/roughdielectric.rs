//! `roughdielectric`: ground glass, a rough boundary of two media (Walter et al., *Microfacet models for
//! refraction through rough surfaces*, 2007). Parameters of the media as for a dielectric, of the
//! roughness as for a roughconductor.

use glam::{Vec2, Vec3};

use super::microfacet::{Distribution, Interface, Roughness};
use super::{Bsdf, BsdfSample, BsdfValue, Lobes, dielectric, fresnel, ior};
use crate::color::ColorModel;
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::interaction::Interaction;
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
fn drawn_from(distribution: Distribution<f32>, wi: Vec3) -> Distribution<f32> {
    if distribution.samples_visible() {
        distribution
    } else {
        distribution.scaled(1.2 - 0.2 * wi.z.abs().sqrt())
    }
}

impl<C: ColorModel> Bsdf<C> for RoughDielectric<C> {
    fn lobes(&self) -> Lobes {
        Lobes {
            smooth: true,
            transmission: true,
        }
    }

    fn eval(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        wo: Vec3,
        w: &C::Wavelengths,
    ) -> Option<BsdfValue<C::Sample>> {
        let interface = Interface::between(wi, wo, self.eta)?;
        let distribution = self.roughness.at(at);
        let m = interface.m;
        let reflectance = fresnel::dielectric(wi.dot(m), self.eta).reflectance;
        let dg = distribution.eval(m.into()) * distribution.g(wi.into(), wo.into(), m.into());
        if dg == 0.0 {
            return None;
        }
        let (share, factor, radiance) = if interface.reflection {
            (reflectance, &self.specular_reflectance, 1.0)
        } else {
            let compression = interface.eta * interface.eta;
            (
                1.0 - reflectance,
                &self.specular_transmittance,
                1.0 / compression,
            )
        };
        let scale = share * dg * radiance * interface.jacobian * (wi.dot(m) / wi.z).abs();
        let facets = drawn_from(distribution, wi).pdf((wi * wi.z.signum()).into(), m.into());
        Some(BsdfValue {
            value: factor.eval(at, w) * scale,
            pdf: facets * share * interface.jacobian,
        })
    }

    fn sample(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        u1: f32,
        u2: Vec2,
        w: &C::Wavelengths,
    ) -> Option<BsdfSample<C::Sample>> {
        if wi.z == 0.0 {
            return None;
        }
        let distribution = drawn_from(self.roughness.at(at), wi);
        let m = Vec3::from(distribution.sample((wi * wi.z.signum()).into(), u2.into()));
        let boundary = fresnel::dielectric(wi.dot(m), self.eta);
        let reflected = u1 < boundary.reflectance;
        let (wo, eta) = if reflected {
            (Vec3::from(fresnel::reflect((wi).into(), m.into())), 1.0)
        } else {
            (
                Vec3::from(fresnel::refract(wi.into(), m.into(), &boundary)),
                boundary.eta,
            )
        };
        if (wo.z * wi.z > 0.0) != reflected {
            return None; // the facet sends the light to the wrong side of the surface
        }
        self.eval(at, wi, wo, w)?.as_sample(wo, eta)
    }
}
