//! Everything that light meets, ready to be rendered: the tracer over all shapes, which material and
//! which light each shape has, and the questions that an integrator asks.

mod assets;
mod build;

use glam::{Vec2, Vec3};

use crate::accel::{Counts, Tracer};
use crate::color::{ColorModel, Spectral};
use crate::interaction::{Hit, Interaction, Ray};
use crate::light::{Light, LightSample};
use crate::material::Material;

pub use assets::Assets;
pub use build::{build, check_materials};

/// A material's place in its scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MaterialId(u32);

/// A light's place in its scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct LightId(u32);

/// What a shape is made of.
#[derive(Clone, Copy, Debug)]
struct Surfacing {
    material: MaterialId,
    light: Option<LightId>,
}

/// A scene whose colours are in the stored form of `C`.
#[derive(Debug)]
pub struct Scene<C: ColorModel> {
    color: C,
    tracer: Tracer,
    materials: Vec<Material<C>>,
    lights: Vec<Light<C>>,
    environment: Option<LightId>,
    /// By shape.
    surfacing: Vec<Surfacing>,
}

impl<C: ColorModel> Scene<C> {
    /// The colour model.
    pub fn color(&self) -> &C {
        &self.color
    }

    /// The shapes.
    pub fn tracer(&self) -> &Tracer {
        &self.tracer
    }

    /// How many lights there are.
    pub fn light_count(&self) -> usize {
        self.lights.len()
    }

    /// Whether there is light all around.
    pub fn has_environment(&self) -> bool {
        self.environment.is_some()
    }

    /// The first hit of each ray.
    pub fn closest(&self, rays: &[Ray], hits: &mut Vec<Hit>, counts: &mut Counts) {
        self.tracer.closest(rays, hits, counts);
    }

    /// Whether anything lies on each ray.
    pub fn occluded(
        &self,
        rays: impl Iterator<Item = Ray>,
        blocked: &mut Vec<bool>,
        counts: &mut Counts,
    ) {
        let rays: Vec<Ray> = rays.collect();
        self.tracer.occluded(&rays, blocked, counts);
    }

    /// What a hit looks like.
    pub fn interaction(&self, ray: &Ray, hit: &Hit) -> Interaction<'_> {
        self.tracer.interaction(ray, hit)
    }

    /// The material at a point.
    pub fn material(&self, at: &Interaction<'_>) -> &Material<C> {
        &self.materials[self.surfacing[at.shape as usize].material.0 as usize]
    }

    /// The light that a point belongs to.
    fn light_at(&self, at: &Interaction<'_>) -> Option<&Light<C>> {
        self.surfacing[at.shape as usize]
            .light
            .map(|id| self.light(id))
    }

    fn light(&self, id: LightId) -> &Light<C> {
        &self.lights[id.0 as usize]
    }

    /// The probability with which a light is chosen: all alike.
    fn choice(&self) -> f32 {
        1.0 / self.lights.len() as f32
    }

    /// A direction toward one of the lights from `from`; `u1` chooses the light. The density includes
    /// the choice.
    pub fn sample_light(
        &self,
        from: Vec3,
        u1: f32,
        u2: Vec2,
        w: &C::Wavelengths,
    ) -> Option<LightSample<C::Sample>> {
        let chosen = (u1 * self.lights.len() as f32) as usize;
        let light = self
            .lights
            .get(chosen.min(self.lights.len().checked_sub(1)?))?;
        let sample = light.sample(from, u2, w)?;
        Some(LightSample {
            pdf: sample.pdf * self.choice(),
            ..sample
        })
    }

    /// Radiance that the surface at `at` emits toward `at.wi`, and the density with which
    /// [`Scene::sample_light`] draws `at` from `from`; `None` where nothing is emitted.
    pub fn emitted(
        &self,
        at: &Interaction<'_>,
        from: Vec3,
        w: &C::Wavelengths,
    ) -> Option<(C::Sample, f32)> {
        let light = self.light_at(at)?;
        let radiance = light.surface_radiance(at, w);
        (!radiance.is_black()).then(|| (radiance, light.surface_pdf(from, at) * self.choice()))
    }

    /// The same for a direction in which a ray meets nothing.
    pub fn surrounding(&self, direction: Vec3, w: &C::Wavelengths) -> Option<(C::Sample, f32)> {
        let light = self.light(self.environment?);
        let radiance = light.environment_radiance(direction, w);
        (!radiance.is_black()).then(|| (radiance, light.environment_pdf(direction) * self.choice()))
    }
}
