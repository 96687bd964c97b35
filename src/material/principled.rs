//! `principled`: Disney's material of many parts (see [`super::disney`]): a diffuse lobe, a dielectric or
//! metallic GGX reflection, GGX refraction, a clear coat and sheen, mixed by `metallic`, `spec_trans`,
//! `clearcoat` (`clearcoat_gloss`) and `sheen`. The index of refraction is `eta`, or follows from
//! `specular` (0.5).

use super::disney::{
    Coat, Parameters, Point, Schlick, in_use, normal_reflectance, rate, sampling_rate,
};
use super::microfacet::{self, Interface};
use super::{BlockBsdf, Bsdf, BsdfSamples, BsdfValues, Lobes, fresnel, single_face};
use crate::color::{ColorModel, Mono, Spectra};
use crate::description::Properties;
use crate::description::declared::{Plugin, float, number};
use crate::error::Result;
use crate::interaction::Points;
use crate::lanes::{Lanes, Mask as _, Vec2, Vec3, warp};
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

/// How much there is of the parts at points.
#[derive(Clone, Copy, Debug)]
struct Mix<F> {
    metallic: F,
    /// Of the diffuse lobe.
    matte: F,
    /// Of the glass.
    glass: F,
    clearcoat: F,
}

/// Probabilities of sampling the lobes.
#[derive(Clone, Copy, Debug)]
struct Shares<F> {
    diffuse: F,
    clearcoat: F,
    /// Of reflection and refraction at the main facets.
    specular: F,
}

impl<C: ColorModel> Principled<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "Disney's material",
        properties: &[
            super::disney::PROPERTIES,
            &[
                number("metallic", 0.0, "0 is a dielectric, 1 a metal"),
                number("clearcoat", 0.0, "how strong a second, clear coat is"),
                number("clearcoat_gloss", 0.0, "how smooth it is"),
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

    #[inline(always)]
    fn mix<F: Lanes>(&self, at: &Points<'_, F>, spec_trans: F) -> Mix<F> {
        let one = F::one();
        let metallic = self.metallic.numbers(at);
        Mix {
            metallic,
            matte: (one - metallic) * (one - spec_trans),
            glass: (one - metallic) * spec_trans,
            clearcoat: self.clearcoat.numbers(at),
        }
    }

    /// The lobes seen from the front; from the inside it is the main facets alone.
    #[inline(always)]
    fn shares<F: Lanes>(&self, front: F::Mask, mix: &Mix<F>) -> Shares<F> {
        let (zero, one) = (F::zero(), F::one());
        let diffuse = mix.matte * F::splat(self.diffuse_rate);
        let clearcoat = F::splat(0.25) * mix.clearcoat * F::splat(self.clearcoat_rate);
        let total = diffuse + clearcoat + F::splat(self.specular_rate);
        Shares {
            diffuse: F::select(front, diffuse / total, zero),
            clearcoat: F::select(front, clearcoat / total, zero),
            specular: F::select(front, F::splat(self.specular_rate) / total, one),
        }
    }

    /// The main specular lobe's reflectance for light from the front: metal and tint by Schlick's
    /// approximation.
    #[inline(always)]
    fn reflectance<F: Lanes>(
        &self,
        point: &Point<F, C::Columns<F>>,
        mix: &Mix<F>,
        schlick: Schlick<F>,
        fresnel: F,
    ) -> C::Columns<F> {
        let one = F::one();
        let r0 = F::splat(normal_reflectance(self.eta));
        let dielectric = one - mix.metallic;
        let untinted = dielectric * (one - point.spec_tint) * fresnel;
        let tinted = dielectric * point.spec_tint;
        let mut reflectance = point.base_color;
        for c in 0..C::Columns::<F>::CHANNELS {
            let value = untinted
                + mix.metallic * schlick.reflectance(point.base_color[c])
                + tinted * schlick.reflectance(point.tint[c] * r0);
            reflectance.set(c, value);
        }
        reflectance
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

    single_face!();
}

impl<C: ColorModel> BlockBsdf<C> for Principled<C> {
    #[inline(always)]
    fn eval_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        wo: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        let (zero, one) = (F::zero(), F::one());
        let front = zero.lt(wi.z);
        let interface = Interface::between(wi, wo, self.eta);
        let (m, jacobian) = (interface.m, interface.jacobian);
        let point = self.parameters.at(at, w);
        let mix = self.mix(at, point.spec_trans);
        let shares = self.shares::<F>(front, &mix);
        let (cos_i, cos_o) = (wi.z.abs(), wo.z.abs());
        let (cos_m, cos_d) = (wi.dot(m), wo.dot(m));
        let fresnel = fresnel::dielectric(cos_m, self.eta).reflectance;
        let distribution = point.distribution(one);
        let dg = distribution.eval(m) * distribution.g(wi, wo, m);
        let scale = dg * jacobian * cos_m.abs() / cos_i;
        let facets = distribution.pdf(microfacet::in_front(wi), m) * jacobian;
        // Light refracted or reflected by the main facets; metal only reflects.
        let passing = one - fresnel;
        let transmitted = F::select(front, mix.glass * passing, passing);

        let schlick = Schlick::new(cos_m, F::splat(self.eta));
        let diffuse = point.diffuse(cos_i, cos_o, cos_d) * (mix.matte * cos_o);
        let sheen = point.sheen(cos_d) * ((one - mix.metallic) * cos_o);
        let matte = diffuse + sheen;
        let main = self.reflectance(&point, &mix, schlick, fresnel) * scale;
        let mut value = C::Columns::<F>::select(zero.lt(fresnel), matte + main, matte);
        let main_pdf = shares.specular * (one - transmitted) * facets;
        let mut pdf = main_pdf + shares.diffuse * warp::cosine_hemisphere_pdf(wo.z);
        let coated = zero.lt(mix.clearcoat);
        if (coated & at.active).any() {
            let coat = Coat::new(self.clearcoat_gloss.numbers(at));
            let share = schlick.reflectance(F::splat(0.04)) * coat.eval(m) * coat.g(wi, wo);
            let share = F::splat(0.25) * mix.clearcoat * share * cos_o;
            let with_coat = value + C::Columns::<F>::splat(share);
            value = C::Columns::<F>::select(coated, with_coat, value);
            let with_coat = pdf + shares.clearcoat * coat.pdf(m) * jacobian;
            pdf = F::select(coated, with_coat, pdf);
        }
        let outside = BsdfValues { value, pdf };
        let reflected = interface.found & interface.reflection;
        if !self.transmits {
            return outside.only(reflected & front);
        }

        let inside = BsdfValues {
            value: C::Columns::<F>::splat(mix.glass * fresnel * scale),
            pdf: main_pdf,
        };
        let scale = scale * mix.glass * passing / (interface.eta * interface.eta);
        let mut value = point.base_color;
        for c in 0..C::Columns::<F>::CHANNELS {
            value.set(c, value[c].max(zero).sqrt() * scale);
        }
        let refracted = BsdfValues {
            value,
            pdf: shares.specular * transmitted * facets,
        };
        let other = BsdfValues::select(interface.reflection, inside, refracted);
        // Only glass is seen from the inside.
        let seen = front | zero.lt(mix.glass);
        let other = other.only(interface.found & seen & zero.lt(other.pdf));
        BsdfValues::select(reflected & front, outside, other)
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
        let (zero, one) = (F::zero(), F::one());
        let front = zero.lt(wi.z);
        let point = self.parameters.at(at, w);
        let mix = self.mix(at, point.spec_trans);
        let shares = self.shares::<F>(front, &mix);
        let m = point.distribution(one).sample(microfacet::in_front(wi), u2);
        let boundary = fresnel::dielectric(wi.dot(m), self.eta);
        let passing = one - boundary.reflectance;
        let passing = F::select(front, mix.glass * passing, passing);
        let u = (u1 - shares.diffuse - shares.clearcoat) / shares.specular;
        let matte = u1.lt(shares.diffuse);
        let main = !u1.lt(shares.diffuse + shares.clearcoat);
        let refracted = main & !matte & u.lt(passing);
        let mut wo = Vec3::select(
            refracted,
            fresnel::refract(wi, m, &boundary),
            fresnel::reflect(wi, m),
        );
        if (!main & !matte & at.active).any() {
            let coat = Coat::new(self.clearcoat_gloss.numbers(at));
            wo = Vec3::select(main, wo, fresnel::reflect(wi, coat.sample(u2)));
        }
        wo = Vec3::select(matte, warp::cosine_hemisphere(u2), wo);
        let eta = F::select(refracted, boundary.eta, one);
        let samples = self.eval_lanes(at, wi, wo, w).as_samples(wo, eta);
        // Other facets send the light to the wrong side of the surface.
        let fits = refracted ^ zero.lt(wo.z * wi.z);
        BsdfSamples {
            drawn: samples.drawn & fits,
            ..samples
        }
    }
}
