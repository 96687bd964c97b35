//! `box`: weight 1 on the pixel's own square, so that each sample counts in one pixel only.

use super::Kernel;
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::lanes::Lanes;

/// Half a pixel to each side.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
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

impl Box {
    #[inline(always)]
    pub(super) fn weight<F: Lanes>(&self, x: F) -> F {
        F::select(x.abs().le(F::splat(0.5)), F::one(), F::zero())
    }
}

impl Kernel for Box {
    fn radius(&self) -> f32 {
        0.5
    }
}
