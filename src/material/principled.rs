//! `principled`: Disney's material of many parts (see [`super::disney`]): a diffuse lobe, a dielectric or
//! metallic GGX reflection, GGX refraction, a clear coat and sheen, mixed by `metallic`, `spec_trans`,
//! `clearcoat` (`clearcoat_gloss`) and `sheen`. The index of refraction is `eta`, or follows from
//! `specular` (0.5).

use glam::{Vec2, Vec3};

use super::disney::{
    Coat, Parameters, Point, in_use, normal_reflectance, number, rate, sampling_rate, schlick,
};
use super::microfacet::Interface;
use super::{Bsdf, BsdfSample, BsdfValue, Lobes, fresnel};
use crate::color::{ColorModel, Mono, Spectral};
use crate::description::Properties;
use crate::description::declared::{Plugin, float, number as number_row};
use crate::error::Result;
use crate::interaction::Interaction;
use crate::lanes::warp;
use crate::texture::{Palettes, Texture};

/// Disney's material.
#[derive(Clone, Debug)]
pub struct Principled<C: ColorModel> {
    parameters: Parameters<C>,
    metallic: Texture<Mono>,
    clearcoat: Texture<Mono>,
    clearcoat_gloss: Texture<Mono>,
    eta: f32,
    transmits: bool,
    specular_rate: f32,
    clearcoat_rate: f32,
    diffuse_rate: f32,
}

/// How much there is of the parts at a point.
#[derive(Clone, Copy, Debug)]
struct Mix {
    metallic: f32,
    /// Of the diffuse lobe.
    matte: f32,
    /// Of the glass.
    glass: f32,
    clearcoat: f32,
}

/// Probabilities of sampling the lobes.
#[derive(Clone, Copy, Debug)]
struct Shares {
    diffuse: f32,
    clearcoat: f32,
    /// Of reflection and refraction at the main facets.
    specular: f32,
}

impl<C: ColorModel> Principled<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "Disney's material",
        properties: &[
            super::disney::PROPERTIES,
            &[
                number_row("metallic", 0.0, "0 is a dielectric, 1 a metal"),
                number_row("clearcoat", 0.0, "how strong a second, clear coat is"),
                number_row("clearcoat_gloss", 0.0, "how smooth it is"),
                float("eta", 1.5, "index of refraction, inside over outside")
                    .positive()
                    .absent("from specular"),
                float(
                    "specular",
                    0.5,
                    "reflectance along the normal, over 0.08; not beside eta",
                )
                .between(0.0, 12.49),
                sampling_rate("main_specular_sampling_rate"),
                sampling_rate("clearcoat_sampling_rate"),
                sampling_rate("diffuse_reflectance_sampling_rate"),
            ],
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let transmits = in_use(properties, "spec_trans");
        let number = |name| palettes.numbers.number(properties, name);
        Ok(Self {
            parameters: Parameters::build(properties, palettes)?,
            metallic: number("metallic")?,
            clearcoat: number("clearcoat")?,
            clearcoat_gloss: number("clearcoat_gloss")?,
            eta: index(properties, transmits)?,
            transmits,
            specular_rate: rate(properties, "main_specular_sampling_rate")?,
            clearcoat_rate: rate(properties, "clearcoat_sampling_rate")?,
            diffuse_rate: rate(properties, "diffuse_reflectance_sampling_rate")?,
        })
    }

    fn mix(&self, at: &Interaction<'_>, point: &Point<C::Sample>) -> Mix {
        let metallic = number(&self.metallic, at);
        Mix {
            metallic,
            matte: (1.0 - metallic) * (1.0 - point.spec_trans),
            glass: (1.0 - metallic) * point.spec_trans,
            clearcoat: number(&self.clearcoat, at),
        }
    }

    /// `None` where nothing is seen: from the inside of what is not glass.
    fn shares(&self, front: bool, mix: &Mix) -> Option<Shares> {
        if !front {
            return (mix.glass > 0.0).then_some(Shares {
                diffuse: 0.0,
                clearcoat: 0.0,
                specular: 1.0,
            });
        }
        let diffuse = mix.matte * self.diffuse_rate;
        let clearcoat = 0.25 * mix.clearcoat * self.clearcoat_rate;
        let total = diffuse + clearcoat + self.specular_rate;
        Some(Shares {
            diffuse: diffuse / total,
            clearcoat: clearcoat / total,
            specular: self.specular_rate / total,
        })
    }

    /// The main specular lobe's reflectance for light from the front: metal and tint by Schlick's
    /// approximation.
    fn reflectance(
        &self,
        point: &Point<C::Sample>,
        mix: &Mix,
        cos: f32,
        fresnel: f32,
    ) -> C::Sample {
        let r0 = normal_reflectance(self.eta);
        let dielectric = 1.0 - mix.metallic;
        C::Sample::from_fn(|c| {
            dielectric * (1.0 - point.spec_tint) * fresnel
                + mix.metallic * schlick(point.base_color[c], cos, self.eta)
                + dielectric * point.spec_tint * schlick(point.tint[c] * r0, cos, self.eta)
        })
    }
}

/// The index of refraction, inside over outside.
fn index(properties: &Properties<'_>, transmits: bool) -> Result<f32> {
    let eta = properties.given::<f64>("eta")?;
    let specular = properties.given::<f64>("specular")?;
    Ok(match (eta, specular) {
        (Some(_), Some(_)) => {
            return Err(properties.error("specular", "give either eta or specular"));
        }
        // Equal indices would leave a refraction without facets.
        (Some(1.0), None) if transmits => 1.001,
        (Some(eta), None) => eta as f32,
        (None, _) => {
            let specular = properties.float("specular")?;
            let least = if transmits { 1e-3 } else { 0.0 };
            (2.0 / (1.0 - (0.08 * specular.max(least)).sqrt()) - 1.0) as f32
        }
    })
}

impl<C: ColorModel> Bsdf<C> for Principled<C> {
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
        let front = wi.z > 0.0;
        let interface = Interface::<f32>::between(wi.into(), wo.into(), self.eta);
        if !interface.found {
            return None;
        }
        let point = self.parameters.at(at, w);
        let mix = self.mix(at, &point);
        let shares = self.shares(front, &mix)?;
        let m = Vec3::from(interface.m);
        let (cos_i, cos_o) = (wi.z.abs(), wo.z.abs());
        let (cos_m, cos_d) = (wi.dot(m), wo.dot(m));
        let fresnel = fresnel::dielectric(cos_m, self.eta).reflectance;
        let distribution = point.distribution(1.0);
        let scale = distribution.eval(m.into())
            * distribution.g(wi.into(), wo.into(), m.into())
            * interface.jacobian
            * cos_m.abs()
            / cos_i;
        let facets = distribution.pdf((wi * wi.z.signum()).into(), m.into()) * interface.jacobian;
        // Light refracted or reflected by the main facets; metal only reflects.
        let transmitted = if front {
            mix.glass * (1.0 - fresnel)
        } else {
            1.0 - fresnel
        };
        if !interface.reflection {
            let scale = scale * mix.glass * (1.0 - fresnel) / (interface.eta * interface.eta);
            let pdf = shares.specular * transmitted * facets;
            return (pdf > 0.0).then(|| BsdfValue {
                value: point.base_color.map(|v| v.max(0.0).sqrt() * scale),
                pdf,
            });
        }
        let mut pdf = shares.specular * (1.0 - transmitted) * facets;
        if !front {
            let value = C::Sample::splat(mix.glass * fresnel * scale);
            return (pdf > 0.0).then_some(BsdfValue { value, pdf });
        }
        let mut value = point.diffuse(cos_i, cos_o, cos_d) * (mix.matte * cos_o)
            + point.sheen(cos_d) * ((1.0 - mix.metallic) * cos_o);
        if fresnel > 0.0 {
            value += self.reflectance(&point, &mix, cos_m, fresnel) * scale;
        }
        pdf += shares.diffuse * warp::cosine_hemisphere_pdf(wo.z);
        if mix.clearcoat > 0.0 {
            let coat = Coat::new(number(&self.clearcoat_gloss, at));
            let coated = schlick(0.04, cos_m, self.eta) * coat.eval(m) * coat.g(wi, wo);
            value += C::Sample::splat(0.25 * mix.clearcoat * coated * cos_o);
            pdf += shares.clearcoat * coat.pdf(m) * interface.jacobian;
        }
        Some(BsdfValue { value, pdf })
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
        let point = self.parameters.at(at, w);
        let mix = self.mix(at, &point);
        let front = wi.z > 0.0;
        let shares = self.shares(front, &mix)?;
        let (mut eta, mut reflected) = (1.0, true);
        let wo = if u1 < shares.diffuse {
            Vec3::from(warp::cosine_hemisphere(u2.into()))
        } else if u1 < shares.diffuse + shares.clearcoat {
            let coat = Coat::new(number(&self.clearcoat_gloss, at));
            Vec3::from(fresnel::reflect(wi.into(), coat.sample(u2).into()))
        } else {
            let m = Vec3::from(
                point
                    .distribution(1.0)
                    .sample((wi * wi.z.signum()).into(), u2.into()),
            );
            let boundary = fresnel::dielectric(wi.dot(m), self.eta);
            let passing = 1.0 - boundary.reflectance;
            let passing = if front { mix.glass * passing } else { passing };
            let u = (u1 - shares.diffuse - shares.clearcoat) / shares.specular;
            if u < passing {
                eta = boundary.eta;
                reflected = false;
                Vec3::from(fresnel::refract(wi.into(), m.into(), &boundary))
            } else {
                Vec3::from(fresnel::reflect((wi).into(), m.into()))
            }
        };
        if (wo.z * wi.z > 0.0) != reflected {
            return None; // the facet sends the light to the wrong side of the surface
        }
        self.eval(at, wi, wo, w)?.as_sample(wo, eta)
    }
}
