//! How a render tells its caller where it is, and asks whether to go on. The library prints nothing and
//! listens to no signal.

use crate::image::{Image, Metadata, Window};

/// The image of a render that goes on.
#[derive(Clone, Debug)]
pub struct Picture {
    /// The crop of the film.
    pub image: Image,
    /// Where the crop lies on the film.
    pub window: Window,
    /// How it was made, for the file.
    pub metadata: Metadata,
}

/// What a render is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Reading meshes; steps are shapes.
    Load,
    /// Building trees; a single step.
    Build,
    /// Tracing; steps are samples.
    Render,
}

/// Somebody who watches a render, from several threads at once.
pub trait Progress: Sync {
    /// A phase begins that has `total` steps.
    fn begin(&self, phase: Phase, total: u64);
    /// `steps` more are done, which traced `rays` rays.
    fn advance(&self, steps: u64, rays: u64);
    /// Whether to show the image as it stands. It is asked often.
    fn wants_picture(&self) -> bool {
        false
    }
    /// The image as it stands.
    fn picture(&self, _picture: &Picture) {}
    /// Whether to stop: no further tile is begun, and what is complete becomes the image.
    fn stop(&self) -> bool {
        false
    }
}

/// Watches nothing.
#[derive(Clone, Copy, Debug)]
pub struct Silent;

impl Progress for Silent {
    fn begin(&self, _phase: Phase, _total: u64) {}
    fn advance(&self, _steps: u64, _rays: u64) {}
}
