//! `gaussian`:

use super::Kernel;
use crate::description::Properties;
use crate::error::Result;

/// A truncated Gaussian.
#[derive(Clone, Debug)]
pub struct Gaussian {
    stddev: f32,
}

impl Gaussian {
    pub(super) fn build(properties: &Properties<'_>, _context: &()) -> Result<Self> {
        let stddev = properties.float("stddev")?.unwrap_or(0.5);
        if !(0.01..=super::MAX_RADIUS / 4.0).contains(&stddev) {
            let message = format!(
                "a standard deviation of {stddev} pixels is not between 0.01 and {}",
                super::MAX_RADIUS / 4.0
            );
            return Err(properties.error("stddev", message));
        }
        Ok(Self {
            stddev: stddev as f32,
        })
    }

    fn bell(&self, x: f32) -> f32 {
        (-0.5 * (x / self.stddev).powi(2)).exp()
    }
}

impl Default for Gaussian {
    fn default() -> Self {
        Self { stddev: 0.5 }
    }
}

impl Kernel for Gaussian {
    fn radius(&self) -> f32 {
        4.0 * self.stddev
    }

    fn eval(&self, x: f32) -> f32 {
        (self.bell(x) - self.bell(self.radius())).max(0.0)
    }
}
