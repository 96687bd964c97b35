//! `gaussian`:

use super::Kernel;
use crate::description::Properties;
use crate::error::Result;
use crate::math::exp::exp;

/// A truncated Gaussian.
#[derive(Clone, Debug)]
pub struct Gaussian {
    stddev: f32,
    /// The bell where it is cut off.
    floor: f32,
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
        Ok(Self::new(stddev as f32))
    }

    fn new(stddev: f32) -> Self {
        Self {
            stddev,
            floor: bell(4.0),
        }
    }
}

/// exp(−x²/2).
#[inline]
fn bell(x: f32) -> f32 {
    exp(-0.5 * x * x)
}

impl Default for Gaussian {
    fn default() -> Self {
        Self::new(0.5)
    }
}

impl Kernel for Gaussian {
    fn radius(&self) -> f32 {
        4.0 * self.stddev
    }

    fn eval(&self, x: f32) -> f32 {
        (bell(x / self.stddev) - self.floor).max(0.0)
    }
}
