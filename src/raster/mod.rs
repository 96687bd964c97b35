//! A z-buffer beside the rays: the same scene, seen by projecting its triangles. It is a picture within a moment where a tree
//! is not worth building, an oracle for what rays see, and the textbook's pipeline with its faults to show.
//!
//! The steps: `projection` takes places in the picture from the sensor's own rays; `drawn` makes triangles of all shapes, by
//! `runs`; `corners`, `sift`, `clip`, `setup` and `depth` bring them to samples of the picture, which `visibility` does for all
//! of them in parallel; `fragment` says what is seen at a sample, and `fragments` at many, `shade` what it looks like, with the help of `shadow`;
//! `agreement` holds fragments against rays.

mod projection;

mod clip;
mod corners;
mod depth;
mod pattern;
mod setup;
mod sift;

mod runs;

mod drawn;
mod fragment;
mod fragments;
mod visibility;

mod shade;
mod shadow;

mod agreement;

pub use agreement::{ALLOWED, Agreement, Quantity, TOLERANCE, agreement};
pub use depth::DepthFormat;
pub use drawn::Drawn;
pub use fragment::{Attributes, Fragment};
pub use fragments::{Fragments, Look, Seen};
pub use pattern::{COUNTS, Pattern};
pub use projection::{Line, Place, Projection};
pub use shade::{Batch, Blocked, Lighting, ShadeSettings, Shader, Shading};
pub use shadow::ShadowSettings;
pub use visibility::{Canvas, Cull, Visibility};

#[cfg(test)]
mod tests;
