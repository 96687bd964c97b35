//! Everything that light meets, ready to be rendered: the tracer over all shapes, which material and
//! which light each shape has, and the questions that an integrator asks.

mod assets;
mod build;
mod choice;
mod displacement;
mod emission;
mod files;

use std::collections::HashMap;

use glam::Vec3;

use crate::accel::{Counts, Order, Recipe, Tracer};
use crate::color::{ColorModel, PerLane as _, Spectral};
use crate::description::NodeId;
use crate::error::Problem;
use crate::interaction::{Hit, Interaction, Points, Ray};
use crate::lanes::{self, Ints, Lanes, Mask as _};
use crate::light::{Light, LightSamples};
use crate::material::Material;
use crate::medium::Medium;

use choice::Choice;

pub use assets::Assets;
pub use build::{build, check_materials, light_names};

/// A material's place in its scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MaterialId(u32);

impl MaterialId {
    /// The material's place among the scene's.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A light's place in its scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct LightId(u32);

impl LightId {
    /// Of a light's place among [`Scene::lights`].
    pub(crate) fn new(index: u32) -> Self {
        Self(index)
    }

    /// The light's place among [`Scene::lights`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A medium's place in its scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MediumId(u32);

impl MediumId {
    /// The medium's place among the scene's.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// What lies on both sides of a surface where media meet: a medium, or nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Boundary {
    /// On the side of the geometric normal.
    pub exterior: Option<MediumId>,
    /// On the other.
    pub interior: Option<MediumId>,
}

impl Boundary {
    /// What lies in a direction from a point with that geometric normal.
    pub fn beyond(&self, normal: Vec3, direction: Vec3) -> Option<MediumId> {
        match normal.dot(direction) > 0.0 {
            true => self.exterior,
            false => self.interior,
        }
    }
}

/// What a shape is made of.
#[derive(Clone, Copy, Debug)]
struct Surfacing {
    material: MaterialId,
    light: Option<LightId>,
    boundary: Option<Boundary>,
}

/// An index a lane.
pub type Indices<F> = <<F as Lanes>::Int as Ints>::Row;

/// A scene whose colours are in the stored form of `C`.
#[derive(Debug)]
pub struct Scene<C: ColorModel> {
    color: C,
    tracer: Tracer,
    materials: Vec<Material<C>>,
    lights: Vec<Light<C>>,
    choice: Choice,
    /// Of lights that paths set out from.
    departures: Choice,
    /// Never chosen, for they are nowhere.
    ambients: Vec<Light<C>>,
    environment: Option<LightId>,
    media: Vec<Medium<C>>,
    /// The media by the nodes that describe them.
    known_media: HashMap<NodeId, MediumId>,
    /// By shape.
    surfacing: Vec<Surfacing>,
    /// Whether any shape's material lets light pass.
    has_passages: bool,
    /// Whether any texture has an image's levels.
    has_mipmaps: bool,
    warnings: Vec<Problem>,
}

impl<C: ColorModel> Scene<C> {
    /// The colour model.
    pub fn color(&self) -> &C {
        &self.color
    }

    /// What is right but worth knowing about its colours.
    pub fn warnings(&self) -> &[Problem] {
        &self.warnings
    }

    /// The shapes.
    pub fn tracer(&self) -> &Tracer {
        &self.tracer
    }

    /// The same, whose shapes are met in another way; what is seen is the same to the bit.
    #[must_use]
    pub fn rebuilt(self, recipe: impl Into<Recipe>) -> Self {
        Self {
            tracer: self.tracer.rebuilt(recipe),
            ..self
        }
    }

    /// How many lights there are.
    pub fn light_count(&self) -> usize {
        self.lights.len() + self.ambients.len()
    }

    /// The lights that are somewhere, as [`light_names`] names them.
    pub fn lights(&self) -> &[Light<C>] {
        &self.lights
    }

    /// The names of [`Scene::lights`] in their order.
    pub fn light_ids(&self) -> impl Iterator<Item = LightId> + use<C> {
        (0..self.lights.len() as u32).map(LightId)
    }

    /// The light all around, if there is one.
    pub fn environment(&self) -> Option<LightId> {
        self.environment
    }

    /// The light that the surface at a point is.
    pub fn light_at(&self, at: &Interaction<'_>) -> Option<LightId> {
        self.light_of(at.shape)
    }

    /// The light that a shape is.
    pub fn light_of(&self, shape: u32) -> Option<LightId> {
        self.surfacing[shape as usize].light
    }

    /// Whether the surface that was hit, if any, is a light.
    pub fn gives_light(&self, hit: &Hit) -> bool {
        !hit.is_miss() && self.shines(hit.shape)
    }

    /// Whether there is light all around.
    pub fn has_environment(&self) -> bool {
        self.environment.is_some()
    }

    /// The first hit of each ray.
    pub fn closest(&self, rays: &[Ray], order: Order, hits: &mut Vec<Hit>, counts: &mut Counts) {
        self.tracer.closest(rays, order, hits, counts);
    }

    /// Whether anything lies on each ray.
    pub fn occluded(
        &self,
        rays: &[Ray],
        order: Order,
        blocked: &mut Vec<bool>,
        counts: &mut Counts,
    ) {
        self.tracer.occluded(rays, order, blocked, counts);
    }

    /// What a hit looks like.
    pub fn interaction(&self, ray: &Ray, hit: &Hit) -> Interaction<'_> {
        self.tracer.interaction(ray, hit)
    }

    /// The material of the surface that was hit.
    pub fn material_of(&self, hit: &Hit) -> MaterialId {
        self.made_of(hit.shape)
    }

    /// What a shape is made of.
    pub fn made_of(&self, shape: u32) -> MaterialId {
        self.surfacing[shape as usize].material
    }

    /// Whether a shape is a light.
    pub fn shines(&self, shape: u32) -> bool {
        self.light_of(shape).is_some()
    }

    /// The material with that index.
    pub fn material_at(&self, index: usize) -> &Material<C> {
        &self.materials[index]
    }

    /// Whether light may go straight on through the surface that was hit as if nothing were there.
    pub fn passes(&self, hit: &Hit) -> bool {
        self.has_passages && self.material_at(self.material_of(hit).index()).passes()
    }

    /// Whether there is any such surface.
    pub fn has_passages(&self) -> bool {
        self.has_passages
    }

    /// Whether any texture asks for [`Interaction::footprint`].
    pub fn has_mipmaps(&self) -> bool {
        self.has_mipmaps
    }

    /// The media on both sides of the surface that was hit, if it parts media.
    pub fn boundary(&self, hit: &Hit) -> Option<&Boundary> {
        self.surfacing[hit.shape as usize].boundary.as_ref()
    }

    /// The medium with that index.
    pub fn medium_at(&self, index: usize) -> &Medium<C> {
        &self.media[index]
    }

    /// How many media there are.
    pub fn medium_count(&self) -> usize {
        self.media.len()
    }

    /// The medium that a node describes, if the scene has it.
    pub fn medium_of(&self, node: NodeId) -> Option<MediumId> {
        self.known_media.get(&node).copied()
    }

    /// How many materials there are.
    pub fn material_count(&self) -> usize {
        self.materials.len()
    }

    /// Whether there is light from nowhere.
    pub fn has_ambient(&self) -> bool {
        !self.ambients.is_empty()
    }

    /// The material at a point.
    pub fn material(&self, at: &Interaction<'_>) -> &Material<C> {
        &self.materials[self.surfacing[at.shape as usize].material.0 as usize]
    }

    fn light(&self, id: LightId) -> &Light<C> {
        &self.lights[id.0 as usize]
    }

    /// Directions from points in lanes toward one of the lights each, which `u1` chooses. Densities include the choice.
    #[inline(always)]
    pub fn sample_lights<F: Lanes>(
        &self,
        from: &Points<'_, F>,
        u1: F,
        u2: lanes::Vec2<F>,
        w: &[C::Wavelengths],
    ) -> LightSamples<F, C::Columns<F>> {
        self.sample_chosen_lights(from, u1, u2, w).0
    }

    /// The same, and the indices of the lights.
    #[inline(always)]
    pub fn sample_chosen_lights<F: Lanes>(
        &self,
        from: &Points<'_, F>,
        u1: F,
        u2: lanes::Vec2<F>,
        w: &[C::Wavelengths],
    ) -> (LightSamples<F, C::Columns<F>>, Indices<F>) {
        let mut samples = LightSamples::none();
        let mut radiance = C::PerLane::<F>::zero();
        let mut indices = F::Int::ROW;
        let Some(chosen) = self.choice.sample(u1) else {
            return (samples.with(radiance.evaluate(w)), indices);
        };
        chosen.store(&mut indices);
        // One light after another.
        let mut rest = from.active;
        while let Some(lane) = rest.lanes().next() {
            let light = LightId(indices[lane]);
            let mask = rest & chosen.eq(F::Int::splat(light.0));
            rest = rest & !mask;
            let mut drawn = self
                .light(light)
                .sample_among(from, u2, w, mask, &mut radiance);
            drawn.pdf = drawn.pdf * F::splat(self.choice.probability(light));
            samples = LightSamples::select(mask, drawn, samples);
        }
        (samples.with(radiance.evaluate(w)), indices)
    }

    /// Radiance that the surface at `at` emits toward `at.wi`, and the density with which
    /// [`Scene::sample_lights`] draws `at` from `from`; `None` where nothing is emitted.
    pub fn emitted(
        &self,
        at: &Interaction<'_>,
        from: Vec3,
        w: &C::Wavelengths,
    ) -> Option<(C::Sample, f32)> {
        let id = self.light_at(at)?;
        let light = self.light(id);
        let radiance = light.surface_radiance(at, w);
        (!radiance.is_black()).then(|| {
            let pdf = light.surface_pdf(from, at) * self.choice.probability(id);
            (radiance, pdf)
        })
    }

    /// The same for a ray that meets nothing.
    pub fn surrounding(&self, ray: &Ray, w: &C::Wavelengths) -> Option<(C::Sample, f32)> {
        let id = self.environment?;
        let light = self.light(id);
        let radiance = light.environment_radiance(ray.direction, ray.time, w);
        (!radiance.is_black()).then(|| {
            let pdf = light.environment_pdf(ray.direction, ray.time) * self.choice.probability(id);
            (radiance, pdf)
        })
    }

    /// What the surface at `at` returns of ambient light toward `at.wi`; `None` in a scene without any.
    pub fn ambient(&self, at: &Interaction<'_>, w: &C::Wavelengths) -> Option<C::Sample> {
        let brought = self.ambients.iter().map(|light| light.ambient_radiance(w));
        let radiance = brought.reduce(|a, b| a + b)?;
        Some(radiance * self.material(at).ambient(at, at.wi, w))
    }
}
