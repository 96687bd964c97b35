//! What a ray's end adds to a path: emission, weighted against light sampling by multiple importance sampling; ambient
//! light; the surroundings where it meets nothing; and the opacity of what the camera sees.
//!
//! A path is opaque once it met something that gives light, or was scattered by more than a passage straight on, and
//! everywhere in surroundings that give light; so a hole is as clear as nothing. Where emitters are hidden the camera
//! looks through surfaces that give light, and sees no surroundings, through holes either.

use glam::Vec3;

use super::mis::power;
use super::{Cost, Estimate};
use crate::color::ColorModel;
use crate::interaction::{Hit, Interaction, Ray};
use crate::scene::{LightId, Scene};

/// Where a ray was scattered.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scattered {
    /// World space.
    pub(super) from: Vec3,
    /// The density of its direction in 1/sr, times the share of samples that are drawn so.
    pub(super) pdf: f32,
    /// The share of samples that are drawn of lights.
    pub(super) light_share: f32,
}

/// A ray's end.
#[derive(Debug)]
pub(super) struct Arrival<'a, 's, C: ColorModel> {
    pub(super) scene: &'s Scene<C>,
    pub(super) ray: &'a Ray,
    /// The point that it meets, or the surroundings.
    pub(super) at: Option<&'a Interaction<'s>>,
    pub(super) wavelengths: &'a C::Wavelengths,
    /// What light that comes along the ray is multiplied by.
    pub(super) throughput: C::Sample,
    /// `None` where light sampling would not have found it: at the camera, or behind a delta lobe.
    pub(super) scattered: Option<Scattered>,
    /// Whether the surroundings are not seen.
    pub(super) hides_surroundings: bool,
}

impl<C: ColorModel> Arrival<'_, '_, C> {
    /// The light that is met, if any.
    pub(super) fn light(&self) -> Option<LightId> {
        match self.at {
            Some(at) => self.scene.light_at(at),
            None => self.scene.environment(),
        }
    }

    /// Radiance that is emitted toward the ray's start, and the density with which light sampling finds it.
    pub(super) fn emitted(&self) -> Option<(C::Sample, f32)> {
        let (scene, w) = (self.scene, self.wavelengths);
        let from = self.scattered.map_or(self.ray.origin, |s| s.from);
        match self.at {
            Some(at) => scene.emitted(at, from, w),
            None if self.hides_surroundings => None,
            None => scene.surrounding(self.ray, w),
        }
    }

    /// What comes of it, by a weight that depends on the density with which light sampling finds it.
    pub(super) fn emission(&self, weight: impl FnOnce(f32) -> f32) -> Option<C::Sample> {
        let (radiance, light_pdf) = self.emitted()?;
        Some(self.throughput * radiance * weight(light_pdf))
    }

    /// The weight against light sampling.
    pub(super) fn weight(&self, light_pdf: f32) -> f32 {
        self.scattered
            .map_or(1.0, |s| power(s.pdf, light_pdf * s.light_share))
    }

    /// What is returned of ambient light.
    pub(super) fn ambient(&self) -> Option<C::Sample> {
        let ambient = self.scene.ambient(self.at?, self.wavelengths)?;
        Some(self.throughput * ambient)
    }

    /// Whether it is a surface that gives light, which no path shines through.
    pub(super) fn is_opaque(&self) -> bool {
        self.at.is_some() && self.light().is_some()
    }

    /// Adds emission, ambient light and opacity.
    pub(super) fn add_to(&self, estimate: &mut Estimate<C::Sample>) {
        self.add_weighted(estimate, |light_pdf| self.weight(light_pdf));
    }

    /// The same, with emission by another weight.
    pub(super) fn add_weighted(
        &self,
        estimate: &mut Estimate<C::Sample>,
        weight: impl FnOnce(f32) -> f32,
    ) {
        if let Some(emission) = self.emission(weight) {
            estimate.radiance += emission;
        }
        if let Some(ambient) = self.ambient() {
            estimate.radiance += ambient;
        }
        if self.is_opaque() {
            estimate.alpha = 1.0;
        }
    }
}

/// Takes those rays that `looks` names on to what lies behind surfaces that give light.
pub(super) fn look_through_emitters<C: ColorModel>(
    scene: &Scene<C>,
    rays: &mut [Ray],
    hits: &mut [Hit],
    looks: impl Fn(usize) -> bool,
    cost: &mut Cost,
) {
    let mut through: Vec<usize> = (0..hits.len())
        .filter(|i| scene.gives_light(&hits[*i]) && looks(*i))
        .collect();
    let (mut behind, mut found) = (Vec::new(), Vec::new());
    while !through.is_empty() {
        behind.clear();
        behind.extend(through.iter().map(|&i| {
            Ray {
                t_max: rays[i].t_max - hits[i].t,
                ..scene
                    .interaction(&rays[i], &hits[i])
                    .spawn(rays[i].direction)
            }
        }));
        cost.closest(scene, 1, &behind, &mut found);
        for ((&i, ray), hit) in through.iter().zip(&behind).zip(&found) {
            (rays[i], hits[i]) = (*ray, *hit);
        }
        through.retain(|i| scene.gives_light(&hits[*i]));
    }
}
