//! `tent`:

use super::Kernel;
use crate::description::Properties;
use crate::error::Result;

/// A triangle.
#[derive(Clone, Debug)]
pub struct Tent {
    radius: f32,
}

impl Tent {
    pub(super) fn build(properties: &Properties<'_>, _context: &()) -> Result<Self> {
        Ok(Self {
            radius: super::radius(properties, 1.0)?,
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
