//! Materials: how surfaces scatter light. Directions are local to the shading frame (z is the normal);
//! `wi` points to where the path came from, `wo` to where it goes on. Values include the cosine:
//! f(wi, wo)·|cos θ_o|.

mod diffuse;
mod twosided;

use glam::{Vec2, Vec3};

use crate::color::ColorModel;
use crate::description::{Kind, Properties};
use crate::error::Result;
use crate::family::family;
use crate::interaction::Interaction;
use crate::texture::Palettes;

/// A direction drawn from a BSDF.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample<S> {
    /// Local, unit length.
    pub wo: Vec3,
    /// f·|cos θ_o| over the density.
    pub weight: S,
    /// Density per solid angle in 1/sr; of a delta direction, the probability of its choice.
    pub pdf: f32,
    /// Index of refraction on the side of `wo` over that on the side of `wi`; 1 for a reflection.
    pub eta: f32,
    /// Whether no other direction would do: a mirror's or a clear glass's.
    pub delta: bool,
}

/// A BSDF's value for two directions, without its delta parts.
#[derive(Clone, Copy, Debug)]
pub struct BsdfValue<S> {
    /// f·|cos θ_o|.
    pub value: S,
    /// The density with which [`Bsdf::sample`] draws `wo`, in 1/sr.
    pub pdf: f32,
}

/// What every material does. `Option`: `None` is black with density 0.
pub trait Bsdf<C: ColorModel>: std::fmt::Debug + Send + Sync {
    /// Whether it scatters into more than single directions, so that sampling lights pays.
    fn is_smooth(&self) -> bool;

    /// The value and density of a pair of directions.
    fn eval(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        wo: Vec3,
        wavelengths: &C::Wavelengths,
    ) -> Option<BsdfValue<C::Sample>>;

    /// Draws `wo`: `u1` chooses the lobe, `u2` the direction.
    fn sample(
        &self,
        at: &Interaction<'_>,
        wi: Vec3,
        u1: f32,
        u2: Vec2,
        wavelengths: &C::Wavelengths,
    ) -> Option<BsdfSample<C::Sample>>;
}

family! {
    /// Every material there is.
    #[derive(Clone, Debug)]
    pub enum Material<C>: Bsdf, kind "bsdf", context Palettes<C> {
        "diffuse" => Diffuse(diffuse::Diffuse<C>),
        "twosided" => TwoSided(twosided::TwoSided<C>),
    }
}

impl<C: ColorModel> Material<C> {
    /// The material of a shape that names none: grey, or black where the shape gives light.
    pub fn default_of_shape(palettes: &Palettes<C>, gives_light: bool) -> Self {
        Self::Diffuse(diffuse::Diffuse::grey(
            palettes,
            if gives_light { 0.0 } else { 0.5 },
        ))
    }
}

/// The materials nested in another; `allowed` says how many there may be.
fn nested<C: ColorModel>(
    properties: &Properties<'_>,
    palettes: &Palettes<C>,
    allowed: std::ops::RangeInclusive<usize>,
) -> Result<Vec<Material<C>>> {
    let children = properties.children(Kind::Bsdf);
    if !allowed.contains(&children.len()) {
        let (least, most) = (allowed.start(), allowed.end());
        let wanted = if least == most {
            format!("{least}")
        } else {
            format!("{least} or {most}")
        };
        let plugin = properties.plugin();
        return Err(properties.error(
            "",
            format!(
                "{plugin} needs {wanted} nested bsdf, and has {}",
                children.len()
            ),
        ));
    }
    children
        .iter()
        .map(|child| Material::build(child, palettes))
        .collect()
}

#[cfg(test)]
mod tests;
