//! `box`: weight 1 on the pixel's own square, so that each sample counts in one pixel only.

use super::Kernel;
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;

/// Half a pixel to each side.
#[derive(Clone, Debug)]
pub struct Box;

impl Box {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "weight 1 on the pixel alone",
        properties: &[],
    };

    pub(super) fn build(_properties: &Properties<'_>, _context: &()) -> Result<Self> {
        Ok(Self)
    }
}

impl Kernel for Box {
    fn radius(&self) -> f32 {
        0.5
    }

    fn eval(&self, x: f32) -> f32 {
        if x.abs() <= 0.5 { 1.0 } else { 0.0 }
    }
}
