//! `retarder`: a sheet that delays one polarisation behind the other. Polarisation is not followed here, so that all of
//! the `transmittance` (1) passes, and `theta` and `delta` change nothing, as in Mitsuba's variants without polarisation.

use super::polarizer::{LOBES, Sheet, THETA, TRANSMITTANCE};
use super::{BlockBsdf, Bsdf, BsdfSamples, BsdfValues, Lobes, single_face};
use crate::color::ColorModel;
use crate::description::Properties;
use crate::description::declared::{Plugin, number};
use crate::error::Result;
use crate::interaction::Points;
use crate::lanes::{Lanes, Vec2, Vec3};
use crate::texture::Palettes;

/// A linear retarder.
#[derive(Clone, Debug)]
pub struct Retarder<C: ColorModel>(Sheet<C>);

impl<C: ColorModel> Retarder<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a linear retarder, such as a quarter-wave plate: all light passes",
        properties: &[&[
            TRANSMITTANCE,
            THETA,
            number("delta", 90.0, "how far one polarisation is behind; degrees").without_effect(),
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        Ok(Self(Sheet::build(properties, palettes, 1.0)?))
    }
}

impl<C: ColorModel> Bsdf<C> for Retarder<C> {
    fn lobes(&self) -> Lobes {
        LOBES
    }

    fn passes(&self) -> bool {
        true
    }

    single_face!();
}

impl<C: ColorModel> BlockBsdf<C> for Retarder<C> {
    #[inline(always)]
    fn passing_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        _wi: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        self.0.passing(at, w)
    }

    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        _u1: F,
        _u2: Vec2<F>,
        w: &[C::Wavelengths],
    ) -> BsdfSamples<F, C::Columns<F>> {
        self.0.sample(at, wi, w)
    }
}
