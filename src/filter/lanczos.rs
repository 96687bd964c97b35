//! `lanczos`:

use super::Kernel;
use crate::description::Properties;
use crate::error::Result;

/// A windowed sinc.
#[derive(Clone, Debug)]
pub struct Lanczos {
    lobes: f32,
}

impl Lanczos {
    pub(super) fn build(properties: &Properties<'_>, _context: &()) -> Result<Self> {
        let lobes = properties.integer("lobes")?.unwrap_or(3);
        if !(1..=super::MAX_RADIUS as i64).contains(&lobes) {
            return Err(properties.error(
                "lobes",
                format!("{lobes} lobes; 1 to {} are possible", super::MAX_RADIUS),
            ));
        }
        Ok(Self {
            lobes: lobes as f32,
        })
    }
}

impl Kernel for Lanczos {
    fn radius(&self) -> f32 {
        self.lobes
    }

    fn eval(&self, x: f32) -> f32 {
        let x = std::f32::consts::PI * x.abs();
        let window = x / self.lobes;
        if window > std::f32::consts::PI {
            0.0
        } else if x < 1e-4 {
            1.0
        } else {
            (x.sin() / x) * (window.sin() / window)
        }
    }
}
