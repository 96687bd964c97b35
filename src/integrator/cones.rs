//! The cones around the rays of a wave, by slot: how much of a texture each looks up. A scene none of whose textures asks for
//! that has none, and pays for none.

use super::Footprint;
use crate::interaction::{Cone, Interaction, Ray};

/// Cones now, and of those paths that are next.
#[derive(Clone, Debug, Default)]
pub(super) struct Cones {
    now: Vec<Cone>,
    next: Vec<Cone>,
    /// How much of a lobe a sample stands for, as a length.
    share: f32,
}

impl Cones {
    /// At the camera, of rays by slot.
    pub(super) fn of(footprint: &Footprint, rays: &[Ray]) -> Self {
        let now: Vec<Cone> = rays.iter().map(|ray| footprint.cone(ray)).collect();
        Self {
            next: now.clone(),
            now,
            share: footprint.share(),
        }
    }

    /// Whether there are any.
    pub(super) fn are_told(&self) -> bool {
        !self.now.is_empty()
    }

    /// The diameter of a path's cone at a distance.
    pub(super) fn width(&self, slot: u32, distance: f32) -> f32 {
        self.now
            .get(slot as usize)
            .map_or(0.0, |cone| cone.at(distance))
    }

    /// A point that a path has met, as textures see it.
    pub(super) fn seen<'s>(&self, slot: u32, at: Interaction<'s>) -> Interaction<'s> {
        match self.are_told() {
            true => {
                let width = self.width(slot, at.t);
                at.seen_within(width)
            }
            false => at,
        }
    }

    /// The path goes on from what lies at a distance, see [`Cone::scattered`].
    pub(super) fn scatter(&mut self, slot: u32, distance: f32, pdf: Option<f32>) {
        let slot = slot as usize;
        if let (Some(now), Some(next)) = (self.now.get(slot), self.next.get_mut(slot)) {
            *next = now.scattered(distance, pdf, self.share);
        }
    }

    /// Those that are next are now.
    pub(super) fn advance(&mut self) {
        std::mem::swap(&mut self.now, &mut self.next);
    }
}
