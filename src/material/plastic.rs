//! `plastic`: a matte base under a clear, smooth coat (`int_ior`, polypropylene by default, in `ext_ior`,
//! air). Light that the base throws back is partly reflected at the inside of the coat and meets the base
//! again: the sum over all these turns is diffuse / (1 − F_in), or with `nonlinear` diffuse /
//! (1 − diffuse·F_in), which shifts the hue. `diffuse_reflectance` (0.5) is the base's colour,
//! `specular_reflectance` (1) multiplies the mirror's part.

use std::f32::consts::FRAC_1_PI;

use super::{BlockBsdf, Bsdf, BsdfSamples, BsdfValues, Lobes, fresnel, ior, mean, single_face};
use crate::color::{ColorModel, Role, Spectra};
use crate::description::Properties;
use crate::description::declared::{Plugin, Row, boolean, texture};
use crate::error::Result;
use crate::interaction::Points;
use crate::lanes::{Lanes, Vec2, Vec3, warp};
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
    #[inline(always)]
    pub(super) fn eval<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        t_i: F,
        t_o: F,
        cos_o: F,
        w: &[C::Wavelengths],
    ) -> C::Columns<F> {
        let scale = cos_o * t_i * t_o * F::splat(FRAC_1_PI / (self.eta * self.eta));
        let mut value = self.diffuse_reflectance.eval_lanes(at, w);
        let internal = F::splat(self.internal_reflectance);
        for c in 0..C::Columns::<F>::CHANNELS {
            let diffuse = value[c];
            let again = if self.nonlinear { diffuse } else { F::one() };
            value.set(c, scale * diffuse / (F::one() - again * internal));
        }
        value
    }

    /// With what weight in [0, 1] the coat's own reflection is sampled, rather than the base.
    pub(super) fn specular_weight(&self, palettes: &Palettes<C>, specular: &Texture<C>) -> f32 {
        let specular = mean(palettes, specular);
        let total = specular + mean(palettes, &self.diffuse_reflectance);
        if total > 0.0 { specular / total } else { 0.5 }
    }
}

/// The probability of sampling the coat, of which `reflectance` is reflected, rather than the base.
#[inline(always)]
pub(super) fn coat_probability<F: Lanes>(reflectance: F, specular_weight: f32) -> F {
    let specular = reflectance * F::splat(specular_weight);
    let diffuse = (F::one() - reflectance) * F::splat(1.0 - specular_weight);
    let either = specular + diffuse;
    F::select(F::zero().lt(either), specular / either, F::one())
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
}

impl<C: ColorModel> Bsdf<C> for Plastic<C> {
    fn lobes(&self) -> Lobes {
        Lobes::REFLECTION
    }

    single_face!();
}

impl<C: ColorModel> BlockBsdf<C> for Plastic<C> {
    #[inline(always)]
    fn eval_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        wo: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        let (zero, one) = (F::zero(), F::one());
        let reflectance = fresnel::dielectric(wi.z, self.base.eta).reflectance;
        let t_o = one - fresnel::dielectric(wo.z, self.base.eta).reflectance;
        let base = one - coat_probability(reflectance, self.specular_weight);
        let values = BsdfValues {
            value: self.base.eval(at, one - reflectance, t_o, wo.z, w),
            pdf: base * warp::cosine_hemisphere_pdf(wo.z),
        };
        values.only(zero.lt(wi.z) & zero.lt(wo.z))
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
        let reflectance = fresnel::dielectric(wi.z, self.base.eta).reflectance;
        let probability = coat_probability(reflectance, self.specular_weight);
        let factor = self.specular_reflectance.eval_lanes(at, w);
        let coat = BsdfSamples::delta(
            F::zero().lt(wi.z),
            fresnel::mirror(wi),
            factor * (reflectance / probability),
            probability,
        );
        let wo = warp::cosine_hemisphere(u2);
        let base = self.eval_lanes(at, wi, wo, w).as_samples(wo, F::one());
        BsdfSamples::select(u1.lt(probability), coat, base)
    }
}
