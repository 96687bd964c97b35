//! `mitchell`:

use super::Kernel;
use crate::description::Properties;
use crate::error::Result;

/// A cubic of radius 2.
#[derive(Clone, Debug)]
pub struct Mitchell {
    b: f32,
    c: f32,
}

impl Mitchell {
    pub(super) fn build(properties: &Properties<'_>, _context: &()) -> Result<Self> {
        let parameter = |name| Ok(properties.float(name)?.unwrap_or(1.0 / 3.0) as f32);
        Ok(Self {
            b: parameter("B")?,
            c: parameter("C")?,
        })
    }
}

impl Kernel for Mitchell {
    fn radius(&self) -> f32 {
        2.0
    }

    fn eval(&self, x: f32) -> f32 {
        super::cubic(self.b, self.c, x)
    }
}
