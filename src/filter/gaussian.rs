//! `gaussian`:

use super::Kernel;
use crate::description::Properties;
use crate::description::declared::{Plugin, float};
use crate::error::Result;

use crate::lanes::{Lanes, exp};

/// A truncated Gaussian.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Gaussian {
    stddev: f32,
    /// The bell where it is cut off.
    floor: f32,
}

impl Gaussian {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a bell, cut off at four standard deviations",
        properties: &[&[float("stddev", 0.5, "standard deviation in pixels")
            .between(0.01, super::MAX_RADIUS / 4.0)]],
    };

    pub(super) fn build(properties: &Properties<'_>, _context: &()) -> Result<Self> {
        Ok(Self::new(properties.float("stddev")? as f32))
    }

    fn new(stddev: f32) -> Self {
        Self {
            stddev,
            floor: bell(4.0),
        }
    }
}

/// exp(−x²/2).
#[inline(always)]
fn bell<F: Lanes>(x: F) -> F {
    exp(F::splat(-0.5) * x * x)
}

impl Default for Gaussian {
    fn default() -> Self {
        Self::new(0.5)
    }
}

impl Gaussian {
    #[inline(always)]
    pub(super) fn weight<F: Lanes>(&self, x: F) -> F {
        let bell = bell(x / F::splat(self.stddev)) - F::splat(self.floor);
        bell.max(F::zero())
    }
}

impl Kernel for Gaussian {
    fn radius(&self) -> f32 {
        4.0 * self.stddev
    }
}
