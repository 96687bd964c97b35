//! `circular`: a sheet that passes light of one circular polarisation. Polarisation is not followed here: half of the
//! `transmittance` (1) passes, as through a `polarizer`, and `left_handed` changes nothing.

use super::polarizer::{LOBES, Sheet, TRANSMITTANCE};
use super::{BlockBsdf, Bsdf, BsdfSamples, BsdfValues, Lobes, single_face};
use crate::color::ColorModel;
use crate::description::Properties;
use crate::description::declared::{Plugin, boolean};
use crate::error::Result;
use crate::interaction::{Interaction, Points};
use crate::lanes::{Lanes, Vec2, Vec3};
use crate::texture::Palettes;

/// A circular polarizer.
#[derive(Clone, Debug)]
pub struct Circular<C: ColorModel>(Sheet<C>);

impl<C: ColorModel> Circular<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a circular polarizer: half the light passes",
        properties: &[&[
            TRANSMITTANCE,
            boolean("left_handed", false, "polarisation is not followed").without_effect(),
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        Ok(Self(Sheet::build(properties, palettes, 0.5)?))
    }
}

impl<C: ColorModel> Bsdf<C> for Circular<C> {
    fn lobes(&self) -> Lobes {
        LOBES
    }

    /// Mitsuba shows the transmittance.
    fn albedo(&self, at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> C::Sample {
        self.0.transmittance.eval(at, wavelengths)
    }

    fn passes(&self) -> bool {
        true
    }

    single_face!();
}

impl<C: ColorModel> BlockBsdf<C> for Circular<C> {
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
