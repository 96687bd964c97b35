//! `null`: a surface that light passes as if it were not there.

use glam::{Vec2, Vec3};

use super::{Bsdf, BsdfSample, Lobes};
use crate::color::{ColorModel, Spectral};
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::interaction::Interaction;
use crate::texture::Palettes;

/// Nothing.
#[derive(Clone, Copy, Debug)]
pub struct Null;

impl Null {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "nothing: light passes",
        properties: &[],
    };

    pub(super) fn build<C: ColorModel>(
        _properties: &Properties<'_>,
        _palettes: &Palettes<C>,
    ) -> Result<Self> {
        Ok(Self)
    }
}

impl<C: ColorModel> Bsdf<C> for Null {
    fn lobes(&self) -> Lobes {
        Lobes {
            smooth: false,
            transmission: true,
        }
    }

    fn sample(
        &self,
        _at: &Interaction<'_>,
        wi: Vec3,
        _u1: f32,
        _u2: Vec2,
        _w: &C::Wavelengths,
    ) -> Option<BsdfSample<C::Sample>> {
        Some(BsdfSample::passing(wi, 1.0, C::Sample::splat(1.0)))
    }
}
