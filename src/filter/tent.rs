//! `tent`:

use super::Kernel;
use crate::description::Properties;
use crate::description::declared::{Plugin, float};
use crate::error::Result;
use crate::lanes::Lanes;

/// A triangle.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
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

impl Tent {
    #[inline(always)]
    pub(super) fn weight<F: Lanes>(&self, x: F) -> F {
        (F::one() - x.abs() / F::splat(self.radius)).max(F::zero())
    }
}

impl Kernel for Tent {
    fn radius(&self) -> f32 {
        self.radius
    }
}
