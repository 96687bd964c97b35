//! `lanczos`:

use super::Kernel;
use crate::description::Properties;
use crate::description::declared::{Plugin, integer};
use crate::error::Result;

/// A windowed sinc.
#[derive(Clone, Debug)]
pub struct Lanczos {
    lobes: f32,
}

impl Lanczos {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a windowed sinc: the sharpest, with ringing",
        properties: &[&[
            integer("lobes", 3, "lobes of the sinc; the radius in pixels")
                .between(1.0, super::MAX_RADIUS),
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, _context: &()) -> Result<Self> {
        Ok(Self {
            lobes: properties.integer("lobes")? as f32,
        })
    }
}

impl Kernel for Lanczos {
    fn radius(&self) -> f32 {
        self.lobes
    }

    fn eval(&self, x: f32) -> f32 {
        let x = std::f32::consts::PI * x.abs();
        let window = x / self.lobes;
        if window > std::f32::consts::PI {
            0.0
        } else if x < 1e-4 {
            1.0
        } else {
            (x.sin() / x) * (window.sin() / window)
        }
    }
}
