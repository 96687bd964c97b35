//! `depth`: the distance from the camera to what it sees, as a grey; 0 where it sees nothing.

use super::limits;
use super::{Context, Cost, Estimate, Estimates, Estimator, Start};
use crate::color::{ColorModel, Spectral};
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::interaction::Ray;
use crate::sampler::Sampler;
use crate::scene::Scene;

/// No settings.
#[derive(Clone, Copy, Debug)]
pub struct Depth;

impl Depth {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "the distance to what the camera sees",
        properties: &[limits::UNUSED],
    };

    pub(super) fn build(_properties: &Properties<'_>, _context: &Context) -> Result<Self> {
        Ok(Self)
    }
}

impl<C: ColorModel> Estimator<C> for Depth {
    fn estimate(
        &self,
        scene: &Scene<C>,
        _sampler: &Sampler,
        starts: &[Start<C>],
        estimates: &mut Estimates<C::Sample>,
        cost: &mut Cost,
    ) {
        let rays: Vec<Ray> = starts.iter().map(|s| s.ray).collect();
        let mut hits = Vec::new();
        cost.closest(scene, 0, &rays, &mut hits);
        estimates.values.clear();
        estimates.values.extend(hits.iter().map(|hit| {
            let (depth, alpha) = if hit.is_miss() {
                (0.0, 0.0)
            } else {
                (hit.t, 1.0)
            };
            Estimate {
                radiance: C::Sample::splat(depth),
                alpha,
            }
        }));
    }
}
