//! What the two sides are told and what they answer: lines of JSON. The order is the first line on a
//! worker's standard input and a seed every further one; each line gets one answer on standard output. The
//! end of the input ends the worker, so that none outlives the program that started it.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::cost::Time;
use crate::render::Overrides;
use crate::sensor::Window;

/// What is to be rendered, and how. Both sides get the same order and leave aside what is the other's.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub(super) struct Order {
    /// The scene file.
    pub(super) scene: PathBuf,
    /// Values of the scene's parameters.
    pub(super) defines: Vec<(String, String)>,
    /// Whether Étendue refuses what Mitsuba would not read.
    pub(super) strict: bool,
    /// Width and height in place of the film's.
    pub(super) size: Option<(u32, u32)>,
    /// The part of the film: left, top, width, height.
    pub(super) crop: Option<[u32; 4]>,
    /// In place of the sampler's count.
    pub(super) spp: Option<u32>,
    /// In place of the sensor's `shutter_open` and `shutter_close`.
    pub(super) shutter: Option<(f64, f64)>,
    /// Sampler plugin.
    pub(super) sampler: Option<String>,
    /// Integrator plugin.
    pub(super) integrator: Option<String>,
    /// In place of the integrator's.
    pub(super) max_depth: Option<i64>,
    /// Id or number of the sensor; the first where absent.
    pub(super) sensor: Option<String>,
    /// One a processor where absent.
    pub(super) threads: Option<u32>,
    /// Étendue's colour model; RGB where absent.
    pub(super) bands: Option<u16>,
    /// Mitsuba's variant.
    pub(super) variant: String,
    /// A folder of Python files that register plugins with Mitsuba.
    pub(super) plugins: PathBuf,
    /// Whether they are Étendue's own: one that lacks a package of Python is passed over.
    pub(super) own_plugins: bool,
    /// Where images go.
    pub(super) folder: PathBuf,
}

impl Order {
    /// For Étendue.
    pub(super) fn overrides(&self) -> Overrides {
        let crop = |[x, y, width, height]: [u32; 4]| Window {
            x,
            y,
            width,
            height,
        };
        Overrides {
            denoise: false,
            spp: self.spp,
            sampler: self.sampler.clone(),
            size: self.size,
            crop: self.crop.map(crop),
            shutter: self.shutter,
            integrator: self.integrator.clone(),
            max_depth: self.max_depth,
        }
    }
}

/// What a worker answers.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Reply {
    /// The scene is in memory.
    Loaded(Loaded),
    /// The scene cannot be rendered here, and why.
    Refused(String),
    /// A seed's image is written.
    Rendered(Rendered),
}

/// A scene in memory.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub(super) struct Loaded {
    /// Name and version of the renderer.
    pub(super) renderer: String,
    /// Reading and building, without the program's own start.
    pub(super) time: Time,
    /// What was changed about the scene.
    pub(super) notes: Vec<String>,
}

/// An image in a file.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub(super) struct Rendered {
    /// The file.
    pub(super) image: PathBuf,
    /// Samples a pixel, as the sampler rounds them up.
    pub(super) spp: u32,
    /// From the call to the pixels in memory.
    pub(super) time: Time,
}
