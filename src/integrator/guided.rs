//! `guided`: `path`, whose directions at surfaces that scatter are drawn toward where caustics come from by half. Before the
//! render `photons` are shot from the lights through mirrors and glass, and tell a guide of it (see [`super::guide`]). The
//! image is that of `path`, with less noise where small lights are seen through glass and in mirrors by way of other surfaces.
//!
//! `max_depth`, `rr_depth` and `hide_emitters`: see [`super::limits`].

use std::sync::OnceLock;

use super::guide::Guide;
use super::limits;
use super::path::Path;
use super::photons::{MAX_BOUNCES, Shooting};
use super::{Context, Cost, Estimates, Estimator, Start};
use crate::color::ColorModel;
use crate::description::Properties;
use crate::description::declared::{Plugin, integer};
use crate::error::Result;
use crate::sampler::Sampler;
use crate::scene::Scene;

/// The settings, and the guide once it is made.
#[derive(Debug)]
pub struct Guided {
    path: Path,
    photons: u32,
    shutter: (f32, f32),
    /// `None` in it: the scene has no caustics.
    guide: OnceLock<Option<Guide>>,
}

/// The most photons.
const MAX_PHOTONS: f64 = (1 << 22) as f64;

impl Guided {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "paths that photons guide to caustics",
        properties: &[
            limits::COMMON,
            limits::LIMITS,
            &[integer(
                "photons",
                65536,
                "photons that are shot before the render; 0 is path",
            )
            .between(0.0, MAX_PHOTONS)],
        ],
    };

    pub(super) fn build(properties: &Properties<'_>, context: &Context) -> Result<Self> {
        Ok(Self {
            path: Path::build(properties, context)?,
            photons: properties.integer("photons")? as u32,
            shutter: context.shutter,
            guide: OnceLock::new(),
        })
    }
}

impl<C: ColorModel> Estimator<C> for Guided {
    fn photon_bytes(&self) -> u64 {
        Guide::bytes(u64::from(self.photons))
    }

    fn prepare(&self, scene: &Scene<C>) {
        // Beside the edges between them a path has one to the camera and one to the light.
        let bounces = self.path.max_depth().saturating_sub(2).min(MAX_BOUNCES);
        self.guide.get_or_init(|| {
            let shooting = Shooting {
                scene,
                shutter: self.shutter,
                bounces,
            };
            match self.photons.min(bounces) {
                0 => None,
                _ => Guide::of(shooting.shoot(self.photons as usize)),
            }
        });
    }

    fn estimate(
        &self,
        scene: &Scene<C>,
        sampler: &Sampler,
        starts: &[Start<C>],
        estimates: &mut Estimates<C::Sample>,
        cost: &mut Cost,
    ) {
        let guide = self.guide.get().and_then(Option::as_ref);
        self.path
            .follow(scene, sampler, starts, guide, (estimates, cost));
    }
}
