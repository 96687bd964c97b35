//! `catmullrom`:

use super::Kernel;
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::lanes::Lanes;

/// A cubic of radius 2.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct CatmullRom;

impl CatmullRom {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "Catmull and Rom's cubic: sharp, with negative lobes",
        properties: &[],
    };

    pub(super) fn build(_properties: &Properties<'_>, _context: &()) -> Result<Self> {
        Ok(Self)
    }
}

impl CatmullRom {
    #[inline(always)]
    pub(super) fn weight<F: Lanes>(&self, x: F) -> F {
        super::cubic(0.0, 0.5, x)
    }
}

impl Kernel for CatmullRom {
    fn radius(&self) -> f32 {
        2.0
    }
}
