//! `tent`:

use super::Kernel;
use crate::description::Properties;
use crate::description::declared::{Plugin, float};
use crate::error::Result;

/// A triangle.
#[derive(Clone, Debug)]
pub struct Tent {
    radius: f32,
}

impl Tent {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "weight that falls linearly to 0",
        properties: &[&[float("radius", 1.0, "where the weight is 0, in pixels")
            .between(0.1, super::MAX_RADIUS)]],
    };

    pub(super) fn build(properties: &Properties<'_>, _context: &()) -> Result<Self> {
        Ok(Self {
            radius: properties.float("radius")? as f32,
        })
    }
}

impl Kernel for Tent {
    fn radius(&self) -> f32 {
        self.radius
    }

    fn eval(&self, x: f32) -> f32 {
        (1.0 - x.abs() / self.radius).max(0.0)
    }
}
