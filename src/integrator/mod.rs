//! Integrators: from camera samples to radiance, a batch at a time.
//!
//! A batch goes bounce by bounce: all its rays are traced, then all its hits shaded, then all its shadow
//! rays traced. Contributions reach a path's slot in a fixed order (emission, then light samples, bounce
//! by bounce), so that the sum's bits do not depend on the batch.

mod cost;

mod aov;
mod bdpt;
mod depth;
mod direct;
mod guided;
mod moment;
mod path;
mod phong;
mod ptracer;
mod raster;
mod volpath;
mod volpathmis;

mod arrival;
mod bounce;
mod cones;
mod directions;
mod footprint;
mod guide;
mod layers;
mod lens;
mod light_paths;
mod limits;
mod mis;
mod photons;
mod runs;
mod volumetric;
mod wave;

use glam::Vec2;

use crate::color::ColorModel;
use crate::description::NodeId;
use crate::family::family;
use crate::interaction::Ray;
use crate::sampler::{Sampler, Stream};
use crate::scene::Scene;

pub use cost::{Cost, Stats};
pub use footprint::Footprint;
pub use lens::Lens;
pub use limits::timeout_note;
pub(crate) use raster::Raster;

/// A camera sample.
#[derive(Clone, Copy, Debug)]
pub struct Start<C: ColorModel> {
    /// The camera's ray.
    pub ray: Ray,
    /// Which of the sample's paths it is, where colours take several.
    pub pass: u32,
    /// The path's wavelengths.
    pub wavelengths: C::Wavelengths,
    /// The path's random numbers.
    pub stream: Stream,
}

/// What a camera sample came to.
#[derive(Clone, Copy, Debug)]
pub struct Estimate<S> {
    /// Radiance toward the camera.
    pub radiance: S,
    /// Opacity: whether the sample met anything but what lets it pass as if it were not there.
    pub alpha: f32,
}

/// Light that came to the film along a path from a light.
#[derive(Clone, Copy, Debug)]
pub struct Splat<S> {
    /// On the film, as in [`crate::sensor::Camera::ray`].
    pub film: Vec2,
    /// What it adds to the mean over the film of a sample a pixel.
    pub value: S,
    /// The start that it shares its wavelengths with.
    pub start: u32,
}

/// What the starts of a batch came to.
#[derive(Clone, Debug)]
pub struct Estimates<S> {
    /// One a start.
    pub values: Vec<Estimate<S>>,
    /// For each start the values of [`Estimator::extra_channels`].
    pub extra: Vec<f32>,
    /// Of integrators that [trace light](Estimator::traces_light).
    pub splats: Vec<Splat<S>>,
}

impl<S> Default for Estimates<S> {
    fn default() -> Self {
        Self {
            values: Vec::new(),
            extra: Vec::new(),
            splats: Vec::new(),
        }
    }
}

/// What every integrator does.
pub trait Estimator<C: ColorModel>: std::fmt::Debug + Send + Sync {
    /// Names of the values that it estimates beside radiance and opacity.
    fn extra_channels(&self) -> Vec<String> {
        Vec::new()
    }

    /// Whether light is scattered by participating media.
    fn renders_media(&self) -> bool {
        false
    }

    /// What it leaves out of the scene, in words, if anything.
    fn leaves_out(&self, _scene: &Scene<C>) -> Option<String> {
        None
    }

    /// Whether paths also set out from lights, one a start, so that light comes to any place of the film.
    fn traces_light(&self) -> bool {
        false
    }

    /// The most bytes of what [`Estimator::prepare`] makes.
    fn photon_bytes(&self) -> u64 {
        0
    }

    /// What is to be done once before the scene is rendered, on all threads.
    fn prepare(&self, _scene: &Scene<C>) {}

    /// Estimates each start, in the order of the starts, in place of what `estimates` held.
    fn estimate(
        &self,
        scene: &Scene<C>,
        sampler: &Sampler,
        starts: &[Start<C>],
        estimates: &mut Estimates<C::Sample>,
        cost: &mut Cost,
    );
}

/// What integrators are built with.
#[derive(Clone, Debug, Default)]
pub struct Context {
    /// The names of the scene's lights in their order, as [`crate::scene::light_names`] gives them; the
    /// integrator then serves scenes with these lights.
    pub lights: Vec<String>,
    /// Of the camera, for channels that show how its rays spread; without, these are 0.
    pub footprint: Option<Footprint>,
    /// Whether there is a sensor that projects nothing, over whose film nothing is displaced.
    pub unprojected: bool,
    /// The node of the medium that the camera stands in.
    pub medium: Option<NodeId>,
    /// The sensor, where light finds it.
    pub lens: Option<Lens>,
    /// When the shutter opens and closes.
    pub shutter: (f32, f32),
}

family! {
    /// Every integrator there is.
    #[derive(Debug)]
    pub enum Integrator<C>: Estimator, context Context {
        "aov" => Aov(aov::Aov<C>),
        "bdpt" => Bdpt(bdpt::Bdpt),
        "depth" => Depth(depth::Depth),
        "direct" => Direct(direct::Direct),
        "guided" => Guided(guided::Guided),
        "moment" => Moment(moment::Moment<C>),
        "path" => Path(path::Path),
        "phong" => Phong(phong::Phong),
        "ptracer" => PTracer(ptracer::PTracer),
        "raster" => Raster(raster::Raster),
        "volpath" => VolPath(volpath::VolPath),
        "volpathmis" => VolPathMis(volpathmis::VolPathMis),
    }
}

impl<C: ColorModel> Integrator<C> {
    /// Mitsuba's where a scene has none: `path` without a limit.
    pub fn preset(context: &Context) -> Self {
        Self::Path(path::Path::seen_by(context.footprint.clone()))
    }
}

/// The first dimension that an integrator may use; those before are the camera's, and two to spare.
pub const FIRST_DIMENSION: u32 = 8;

impl<C: ColorModel> Estimator<C> for Integrator<C> {
    fn extra_channels(&self) -> Vec<String> {
        (**self).extra_channels()
    }

    fn renders_media(&self) -> bool {
        (**self).renders_media()
    }

    fn leaves_out(&self, scene: &Scene<C>) -> Option<String> {
        (**self).leaves_out(scene)
    }

    fn traces_light(&self) -> bool {
        (**self).traces_light()
    }

    fn photon_bytes(&self) -> u64 {
        (**self).photon_bytes()
    }

    fn prepare(&self, scene: &Scene<C>) {
        (**self).prepare(scene);
    }

    fn estimate(
        &self,
        scene: &Scene<C>,
        sampler: &Sampler,
        starts: &[Start<C>],
        estimates: &mut Estimates<C::Sample>,
        cost: &mut Cost,
    ) {
        (**self).estimate(scene, sampler, starts, estimates, cost);
    }
}
