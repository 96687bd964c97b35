//! What an image is of and how it was made, as its file tells it.

use glam::Mat4;
use serde::{Deserialize, Serialize};

use super::adaptive::AdaptiveReport;
use super::foveated::FoveatedReport;
use crate::image::Metadata;

/// What all parts of an image have in common.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Origin {
    /// The scene's name.
    pub(super) scene: String,
    pub(super) integrator: String,
    pub(super) seed: u64,
    /// What it was made on; several where parts were made on several.
    #[serde(default)]
    pub(super) machine: String,
    /// Column by column.
    pub(super) world_to_camera: [f32; 16],
    pub(super) world_to_ndc: [f32; 16],
    /// Whether it has bands of the spectrum.
    pub(super) spectral: bool,
}

/// What came of the samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outcome<'a> {
    /// Samples a pixel, on average where not all pixels get the same number.
    pub(super) spp: u32,
    /// Samples that every pixel has.
    pub(super) samples_complete: u32,
    pub(super) adaptive: Option<&'a AdaptiveReport>,
    pub(super) foveated: Option<&'a FoveatedReport>,
}

impl Origin {
    /// For the image's file.
    pub(super) fn metadata(&self, outcome: &Outcome<'_>) -> Metadata {
        let metadata = Metadata::default()
            .with("software", concat!("etendue ", env!("CARGO_PKG_VERSION")))
            .with("scene", self.scene.as_str())
            .with("integrator", self.integrator.as_str())
            .with("spp", outcome.spp)
            .with("samples_complete", outcome.samples_complete)
            .with("seed", i64::try_from(self.seed).unwrap_or(i64::MAX))
            .with("machine", self.machine.as_str())
            .with(
                "world_to_camera",
                Mat4::from_cols_array(&self.world_to_camera),
            )
            .with("world_to_ndc", Mat4::from_cols_array(&self.world_to_ndc));
        // Fichet, Pacanowski and Wilkie 2021, section 4.
        let metadata = match self.spectral {
            true => (metadata.with("spectralLayoutVersion", "1.0"))
                .with("emissiveUnits", "W.m^-2.sr^-1"),
            false => metadata,
        };
        let metadata = match outcome.foveated {
            None => metadata,
            Some(foveated) => metadata
                .with("gaze_x", foveated.gaze[0])
                .with("gaze_y", foveated.gaze[1])
                .with("min_spp", foveated.limits[0])
                .with("max_spp", foveated.limits[1]),
        };
        match outcome.adaptive {
            None => metadata,
            Some(adaptive) => metadata
                .with("noise_threshold", adaptive.noise_threshold)
                .with("min_spp", adaptive.limits[0])
                .with("max_spp", adaptive.limits[1]),
        }
    }
}
