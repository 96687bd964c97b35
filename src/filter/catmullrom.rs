//! `catmullrom`:

use super::Kernel;
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;

/// A cubic of radius 2.
#[derive(Clone, Debug)]
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

impl Kernel for CatmullRom {
    fn radius(&self) -> f32 {
        2.0
    }

    fn eval(&self, x: f32) -> f32 {
        super::cubic(0.0, 0.5, x)
    }
}
