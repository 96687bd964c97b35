//! `principledthin`: Disney's material for sheets without thickness (see [`super::disney`]): light is
//! reflected or passes without being bent, by GGX lobes as far as `spec_trans` goes and diffusely
//! otherwise, on either side by `diff_trans` (0 to 2, where 1 is half). `eta` (1.5) may be a texture.

use glam::{Vec2, Vec3};

use super::disney::{
    Parameters, Point, in_use, lerp, normal_reflectance, number, rate, sampling_rate, schlick,
};
use super::microfacet::Distribution;
use super::{Bsdf, BsdfSample, BsdfValue, Lobes, fresnel};
use crate::color::{ColorModel, Mono, Spectral};
use crate::description::Properties;
use crate::description::declared::{Plugin, number as number_row};
use crate::error::Result;
use crate::interaction::Interaction;
use crate::lanes::warp;
use crate::texture::{Palettes, Texture};

/// Disney's thin material.
#[derive(Clone, Debug)]
pub struct PrincipledThin<C: ColorModel> {
    parameters: Parameters<C>,
    eta: Texture<Mono>,
    diff_trans: Texture<Mono>,
    specular_reflectance_rate: f32,
    specular_transmittance_rate: f32,
    diffuse_reflectance_rate: f32,
    diffuse_transmittance_rate: f32,
    transmits: bool,
}

/// Probabilities of sampling the lobes.
#[derive(Clone, Copy, Debug)]
struct Shares {
    specular_reflection: f32,
    specular_transmission: f32,
    diffuse_reflection: f32,
    diffuse_transmission: f32,
}

impl<C: ColorModel> PrincipledThin<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "Disney's material for thin sheets",
        properties: &[
            super::disney::PROPERTIES,
            &[
                number_row("eta", 1.5, "index of refraction, inside over outside"),
                number_row("diff_trans", 0.0, "matte transmission: 0 is none, 2 is all"),
                sampling_rate("specular_reflectance_sampling_rate"),
                sampling_rate("specular_transmittance_sampling_rate"),
                sampling_rate("diffuse_reflectance_sampling_rate"),
                sampling_rate("diffuse_transmittance_sampling_rate"),
            ],
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let number = |name| palettes.numbers.number(properties, name);
        Ok(Self {
            parameters: Parameters::build(properties, palettes)?,
            eta: number("eta")?,
            diff_trans: number("diff_trans")?,
            specular_reflectance_rate: rate(properties, "specular_reflectance_sampling_rate")?,
            specular_transmittance_rate: rate(properties, "specular_transmittance_sampling_rate")?,
            diffuse_reflectance_rate: rate(properties, "diffuse_reflectance_sampling_rate")?,
            diffuse_transmittance_rate: rate(properties, "diffuse_transmittance_sampling_rate")?,
            transmits: in_use(properties, "spec_trans") || in_use(properties, "diff_trans"),
        })
    }

    /// The diffusely transmitted part, in [0, 1].
    fn diff_trans(&self, at: &Interaction<'_>) -> f32 {
        0.5 * number(&self.diff_trans, at)
    }

    fn shares(&self, spec_trans: f32, diff_trans: f32) -> Shares {
        let specular = 0.5 * spec_trans;
        let diffuse = 1.0 - spec_trans;
        let [a, b, c, d] = [
            specular * self.specular_reflectance_rate,
            specular * self.specular_transmittance_rate,
            diffuse * (1.0 - diff_trans) * self.diffuse_reflectance_rate,
            diffuse * diff_trans * self.diffuse_transmittance_rate,
        ];
        let total = a + b + c + d;
        Shares {
            specular_reflection: a / total,
            specular_transmission: b / total,
            diffuse_reflection: c / total,
            diffuse_transmission: d / total,
        }
    }

    /// The facets at which light passes, which the two boundaries make rougher or smoother.
    fn passing(point: &Point<C::Sample>, eta: f32) -> Distribution<f32> {
        point.distribution(0.65 * eta - 0.35)
    }
}

/// The mirror image on the other side of the surface.
fn through(wo: Vec3) -> Vec3 {
    Vec3::new(wo.x, wo.y, -wo.z)
}

impl<C: ColorModel> Bsdf<C> for PrincipledThin<C> {
    fn lobes(&self) -> Lobes {
        Lobes {
            smooth: true,
            transmission: self.transmits,
        }
    }

    fn eval(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        wo: Vec3,
        w: &C::Wavelengths,
    ) -> Option<BsdfValue<C::Sample>> {
        if wi.z * wo.z == 0.0 {
            return None;
        }
        // Both sides are alike.
        let (wi, wo) = (wi * wi.z.signum(), wo * wi.z.signum());
        let point = self.parameters.at(at, w);
        let (eta, diff_trans) = (number(&self.eta, at), self.diff_trans(at));
        let shares = self.shares(point.spec_trans, diff_trans);
        let reflection = wo.z > 0.0;
        let mirrored = if reflection { wo } else { through(wo) };
        let m = (wi + mirrored).normalize();
        let cos_o = mirrored.z;
        let fresnel = fresnel::dielectric(wi.dot(m), eta).reflectance;
        let jacobian = 0.25 / mirrored.dot(m);
        let matte = 1.0 - point.spec_trans;
        if reflection {
            let distribution = point.distribution(1.0);
            let dg = distribution.eval(m.into()) * distribution.g(wi.into(), wo.into(), m.into());
            let specular = point.spec_trans * dg / (4.0 * wi.z);
            let r0 = normal_reflectance(eta);
            let reflected = point.tint.map(|tint| {
                let tinted = schlick(tint * r0, wi.dot(m), eta);
                specular * lerp(fresnel, tinted, point.spec_tint)
            });
            let cos_d = wo.dot(m);
            let diffuse = point.diffuse(wi.z, cos_o, cos_d) + point.sheen(cos_d);
            return Some(BsdfValue {
                value: reflected + diffuse * (matte * (1.0 - diff_trans) * cos_o),
                pdf: shares.specular_reflection * distribution.pdf(wi.into(), m.into()) * jacobian
                    + shares.diffuse_reflection * warp::cosine_hemisphere_pdf(cos_o),
            });
        }
        let cosine_pdf = warp::cosine_hemisphere_pdf(cos_o);
        let mut value = matte * diff_trans * cosine_pdf;
        let mut pdf = shares.diffuse_transmission * cosine_pdf;
        // Mitsuba leaves out facets that would be seen from behind on the other side.
        if wo.dot(m) < 0.0 {
            let distribution = Self::passing(&point, eta);
            let dg = distribution.eval(m.into()) * distribution.g(wi.into(), wo.into(), m.into());
            value += point.spec_trans * (1.0 - fresnel) * dg / (4.0 * wi.z);
            pdf += shares.specular_transmission * distribution.pdf(wi.into(), m.into()) * jacobian;
        }
        (pdf > 0.0).then(|| BsdfValue {
            value: point.base_color * value,
            pdf,
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
        let up = wi.z.signum();
        let point = self.parameters.at(at, w);
        let shares = self.shares(point.spec_trans, self.diff_trans(at));
        let passed = shares.specular_reflection + shares.specular_transmission;
        // Whether light comes out on the side of the surface, and of its facet, that it should.
        let (wo, fits) = if u1 < shares.specular_reflection {
            let m = Vec3::from(point.distribution(1.0).sample((wi * up).into(), u2.into()));
            let wo = Vec3::from(fresnel::reflect((wi * up).into(), m.into()));
            (wo, wo.z > 0.0)
        } else if u1 < passed {
            let m = Vec3::from(
                Self::passing(&point, number(&self.eta, at)).sample((wi * up).into(), u2.into()),
            );
            let wo = through(Vec3::from(fresnel::reflect((wi * up).into(), m.into())));
            (wo, wo.z < 0.0 && wo.dot(m) < 0.0)
        } else if u1 < passed + shares.diffuse_reflection {
            (Vec3::from(warp::cosine_hemisphere(u2.into())), true)
        } else {
            (-Vec3::from(warp::cosine_hemisphere(u2.into())), true)
        };
        if !fits {
            return None;
        }
        let wo = wo * up;
        self.eval(at, wi, wo, w)?.as_sample(wo, 1.0)
    }
}
