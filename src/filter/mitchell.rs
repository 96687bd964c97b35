//! `mitchell`:

use super::Kernel;
use crate::description::Properties;
use crate::description::declared::{Plugin, float};
use crate::error::Result;
use crate::lanes::Lanes;

/// A cubic of radius 2.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Mitchell {
    b: f32,
    c: f32,
}

impl Mitchell {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "Mitchell and Netravali's cubics",
        properties: &[&[
            float("B", 1.0 / 3.0, "blur"),
            float("C", 1.0 / 3.0, "ringing"),
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, _context: &()) -> Result<Self> {
        Ok(Self {
            b: properties.float("B")? as f32,
            c: properties.float("C")? as f32,
        })
    }
}

impl Mitchell {
    #[inline(always)]
    pub(super) fn weight<F: Lanes>(&self, x: F) -> F {
        super::cubic(self.b, self.c, x)
    }
}

impl Kernel for Mitchell {
    fn radius(&self) -> f32 {
        2.0
    }
}
