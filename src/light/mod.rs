//! Lights: what emits, how much arrives from where, and how to draw a direction toward it.

mod area;
mod constant;
mod directional;
mod point;

use std::sync::Arc;

use glam::{DMat4, Vec2, Vec3};

use crate::color::{ColorModel, Spectral};
use crate::description::Properties;
use crate::error::Result;
use crate::family::family;
use crate::interaction::Interaction;
use crate::math::Transform;
use crate::shape::Geometry;
use crate::texture::Palettes;

/// A direction drawn toward a light.
#[derive(Clone, Copy, Debug)]
pub struct LightSample<S> {
    /// World space, unit length.
    pub direction: Vec3,
    /// Where the light is; `None` where it is infinitely far.
    pub target: Option<Vec3>,
    /// Radiance from there (of a delta light: the irradiance at right angles), not divided by the density.
    pub radiance: S,
    /// Density per solid angle in 1/sr; 1 for a delta light.
    pub pdf: f32,
    /// Whether the light is a point or a direction that no path meets by chance.
    pub delta: bool,
}

/// What every light does.
pub trait Emitter<C: ColorModel>: std::fmt::Debug + Send + Sync {
    /// A direction from the point `from` toward the light; `None` where none of its light arrives.
    fn sample(
        &self,
        from: Vec3,
        u: Vec2,
        wavelengths: &C::Wavelengths,
    ) -> Option<LightSample<C::Sample>>;

    /// Radiance that leaves the light's surface at `at` toward `at.wi`.
    fn surface_radiance(&self, _at: &Interaction<'_>, _wavelengths: &C::Wavelengths) -> C::Sample {
        C::Sample::zero()
    }
    /// The density with which [`Emitter::sample`] draws the surface point `at` from `from`.
    fn surface_pdf(&self, _from: Vec3, _at: &Interaction<'_>) -> f32 {
        0.0
    }

    /// Whether it is an environment: what a ray meets that meets nothing.
    fn is_environment(&self) -> bool {
        false
    }
    /// Radiance of the environment from a world direction.
    fn environment_radiance(&self, _direction: Vec3, _wavelengths: &C::Wavelengths) -> C::Sample {
        C::Sample::zero()
    }
    /// The density with which [`Emitter::sample`] draws an environment's direction.
    fn environment_pdf(&self, _direction: Vec3) -> f32 {
        0.0
    }
}

/// What lights are built with.
#[derive(Debug)]
pub struct LightContext<'a, C: ColorModel> {
    /// Colours and numbers.
    pub palettes: &'a Palettes<C>,
    /// The shape that an area light stands on.
    pub shape: Option<&'a Arc<Geometry>>,
}

family! {
    /// Every light there is.
    #[derive(Clone, Debug)]
    pub enum Light<C>: Emitter, kind "emitter", context LightContext<'_, C> {
        "area" => Area(area::Area<C>),
        "constant" => Constant(constant::Constant<C>),
        "directional" => Directional(directional::Directional<C>),
        "point" => Point(point::Point<C>),
    }
}

/// The property `to_world`.
fn to_world(properties: &Properties<'_>) -> Result<Transform> {
    let matrix = properties.transform("to_world")?.unwrap_or(DMat4::IDENTITY);
    Transform::new(&matrix)
        .ok_or_else(|| properties.error("to_world", "the transform must be affine and invertible"))
}
