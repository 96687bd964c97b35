//! `plastic`: a matte base under a clear, smooth coat (`int_ior`, polypropylene by default, in `ext_ior`,
//! air). Light that the base throws back is partly reflected at the inside of the coat and meets the base
//! again: the sum over all these turns is diffuse / (1 − F_in), or with `nonlinear` diffuse /
//! (1 − diffuse·F_in), which shifts the hue. `diffuse_reflectance` (0.5) is the base's colour,
//! `specular_reflectance` (1) multiplies the mirror's part.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};

use super::{Bsdf, BsdfSample, BsdfValue, Lobes, fresnel, ior, mean};
use crate::color::{ColorModel, Role, Spectral};
use crate::description::Properties;
use crate::description::declared::{Plugin, Row, boolean, texture};
use crate::error::Result;
use crate::interaction::Interaction;
use crate::math::warp;
use crate::texture::{Palettes, Texture};

/// A matte base under a smooth coat.
#[derive(Clone, Debug)]
pub struct Plastic<C: ColorModel> {
    base: Base<C>,
    specular_reflectance: Texture<C>,
    specular_weight: f32,
}

/// What lies under a clear coat.
#[derive(Clone, Debug)]
pub(super) struct Base<C: ColorModel> {
    diffuse_reflectance: Texture<C>,
    /// Index of refraction, coat over surroundings.
    pub(super) eta: f32,
    /// The share of the base's light that the coat sends back to it.
    pub(super) internal_reflectance: f32,
    nonlinear: bool,
}

/// What both plastics read.
pub(super) const PROPERTIES: &[Row] = &[
    texture("diffuse_reflectance", 0.5, "of the base"),
    texture(
        "specular_reflectance",
        1.0,
        "factor on what the coat reflects",
    ),
    boolean(
        "nonlinear",
        false,
        "whether light that returns to the base takes on its colour again",
    ),
];

impl<C: ColorModel> Base<C> {
    pub(super) fn build(
        properties: &Properties<'_>,
        palettes: &Palettes<C>,
        eta: f32,
        internal_reflectance: f32,
    ) -> Result<Self> {
        Ok(Self {
            diffuse_reflectance: palettes.colors.texture(
                properties,
                "diffuse_reflectance",
                Role::Reflectance,
            )?,
            eta,
            internal_reflectance,
            nonlinear: properties.boolean("nonlinear")?,
        })
    }

    /// f·cos θ_o where the coat lets the shares `t_i` and `t_o` pass on the way in and out.
    pub(super) fn eval(
        &self,
        at: &Interaction<'_>,
        t_i: f32,
        t_o: f32,
        cos_o: f32,
        w: &C::Wavelengths,
    ) -> C::Sample {
        let scale = FRAC_1_PI * cos_o * t_i * t_o / (self.eta * self.eta);
        self.diffuse_reflectance.eval(at, w).map(|diffuse| {
            let again = if self.nonlinear { diffuse } else { 1.0 };
            scale * diffuse / (1.0 - again * self.internal_reflectance)
        })
    }

    /// With what weight in [0, 1] the coat's own reflection is sampled, rather than the base.
    pub(super) fn specular_weight(&self, palettes: &Palettes<C>, specular: &Texture<C>) -> f32 {
        let specular = mean(palettes, specular);
        let total = specular + mean(palettes, &self.diffuse_reflectance);
        if total > 0.0 { specular / total } else { 0.5 }
    }
}

/// The probability of sampling the coat, of which `reflectance` is reflected, rather than the base.
pub(super) fn coat_probability(reflectance: f32, specular_weight: f32) -> f32 {
    let specular = reflectance * specular_weight;
    let diffuse = (1.0 - reflectance) * (1.0 - specular_weight);
    if specular + diffuse > 0.0 {
        specular / (specular + diffuse)
    } else {
        1.0
    }
}

impl<C: ColorModel> Plastic<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a matte base under a clear, smooth coat",
        properties: &[&super::ior::dielectric("polypropylene"), PROPERTIES],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let eta = ior::relative(properties)?;
        let internal_reflectance = fresnel::diffuse_reflectance(1.0 / eta);
        let base = Base::build(properties, palettes, eta, internal_reflectance)?;
        let specular_reflectance =
            palettes
                .colors
                .texture(properties, "specular_reflectance", Role::Reflectance)?;
        Ok(Self {
            specular_weight: base.specular_weight(palettes, &specular_reflectance),
            base,
            specular_reflectance,
        })
    }

    fn fresnel(&self, cos: f32) -> f32 {
        fresnel::dielectric(cos, self.base.eta).reflectance
    }
}

impl<C: ColorModel> Bsdf<C> for Plastic<C> {
    fn lobes(&self) -> Lobes {
        Lobes::REFLECTION
    }

    fn eval(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        wo: Vec3,
        w: &C::Wavelengths,
    ) -> Option<BsdfValue<C::Sample>> {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return None;
        }
        let (f_i, f_o) = (self.fresnel(wi.z), self.fresnel(wo.z));
        let probability = 1.0 - coat_probability(f_i, self.specular_weight);
        Some(BsdfValue {
            value: self.base.eval(at, 1.0 - f_i, 1.0 - f_o, wo.z, w),
            pdf: probability * warp::cosine_hemisphere_pdf(wo.z),
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
        if wi.z <= 0.0 {
            return None;
        }
        let reflectance = self.fresnel(wi.z);
        let probability = coat_probability(reflectance, self.specular_weight);
        if u1 < probability {
            return Some(BsdfSample {
                wo: fresnel::mirror(wi),
                weight: self.specular_reflectance.eval(at, w) * (reflectance / probability),
                pdf: probability,
                eta: 1.0,
                delta: true,
                null: false,
            });
        }
        let wo = warp::cosine_hemisphere(u2);
        self.eval(at, wi, wo, w)?.as_sample(wo, 1.0)
    }
}
