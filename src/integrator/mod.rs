//! Integrators: from camera samples to radiance, a batch at a time.
//!
//! A batch goes bounce by bounce: all its rays are traced, then all its hits shaded, then all its shadow
//! rays traced. Contributions reach a path's slot in a fixed order (emission, then light samples, bounce
//! by bounce), so that the sum's bits do not depend on the batch.

mod cost;

mod aov;
mod depth;
mod direct;
mod moment;
mod path;
mod phong;
mod raster;
mod volpath;
mod volpathmis;

mod arrival;
mod bounce;
mod footprint;
mod layers;
mod limits;
mod mis;
mod runs;
mod volumetric;
mod wave;

use crate::color::ColorModel;
use crate::description::NodeId;
use crate::family::family;
use crate::interaction::Ray;
use crate::sampler::{Sampler, Stream};
use crate::scene::Scene;

pub use cost::{Cost, Stats};
pub use footprint::Footprint;
pub use limits::timeout_note;
pub(crate) use raster::Raster;

/// A camera sample.
#[derive(Clone, Copy, Debug)]
pub struct Start<C: ColorModel> {
    /// The camera's ray.
    pub ray: Ray,
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

/// What the starts of a batch came to.
#[derive(Clone, Debug)]
pub struct Estimates<S> {
    /// One a start.
    pub values: Vec<Estimate<S>>,
    /// For each start the values of [`Estimator::extra_channels`].
    pub extra: Vec<f32>,
}

impl<S> Default for Estimates<S> {
    fn default() -> Self {
        Self {
            values: Vec::new(),
            extra: Vec::new(),
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
    /// The node of the medium that the camera stands in.
    pub medium: Option<NodeId>,
}

family! {
    /// Every integrator there is.
    #[derive(Debug)]
    pub enum Integrator<C>: Estimator, context Context {
        "aov" => Aov(aov::Aov<C>),
        "depth" => Depth(depth::Depth),
        "direct" => Direct(direct::Direct),
        "moment" => Moment(moment::Moment<C>),
        "path" => Path(path::Path),
        "phong" => Phong(phong::Phong),
        "raster" => Raster(raster::Raster),
        "volpath" => VolPath(volpath::VolPath),
        "volpathmis" => VolPathMis(volpathmis::VolPathMis),
    }
}

impl<C: ColorModel> Default for Integrator<C> {
    /// Mitsuba's: `path` without a limit.
    fn default() -> Self {
        Self::Path(path::Path::default())
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
