//! `polarizer`: a sheet that passes light of one linear polarisation. Polarisation is not followed here, and of light
//! that has none half passes, whatever the axis (Malus's mean): as in Mitsuba's variants without polarisation, a sheet
//! passes half of its `transmittance` (1), and `theta` and `polarizing` change nothing.

use super::{BlockBsdf, Bsdf, BsdfSamples, BsdfValues, Lobes, single_face};
use crate::color::{ColorModel, Role};
use crate::description::Properties;
use crate::description::declared::{Plugin, Row, boolean, number, texture};
use crate::error::Result;
use crate::interaction::Points;
use crate::lanes::{Lanes, Vec2, Vec3};
use crate::texture::{Palettes, Texture};

/// A linear polarizer.
#[derive(Clone, Debug)]
pub struct Polarizer<C: ColorModel>(Sheet<C>);

/// A sheet that light passes straight on, weakened.
#[derive(Clone, Debug)]
pub(super) struct Sheet<C: ColorModel> {
    pub(super) transmittance: Texture<C>,
    /// What the transmittance is multiplied by.
    share: f32,
}

/// What passes.
pub(super) const TRANSMITTANCE: Row =
    texture("transmittance", 1.0, "the share of light that passes");
/// How the sheet is turned.
pub(super) const THETA: Row =
    number("theta", 0.0, "how its axis is turned; degrees").without_effect();

/// How the sheets scatter.
pub(super) const LOBES: Lobes = Lobes {
    smooth: false,
    transmission: true,
};

impl<C: ColorModel> Sheet<C> {
    pub(super) fn build(
        properties: &Properties<'_>,
        palettes: &Palettes<C>,
        share: f32,
    ) -> Result<Self> {
        let colors = &palettes.colors;
        Ok(Self {
            transmittance: colors.texture(properties, "transmittance", Role::Reflectance)?,
            share,
        })
    }

    #[inline(always)]
    pub(super) fn passing<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        BsdfValues {
            value: self.transmittance.eval_lanes(at, w) * F::splat(self.share),
            pdf: F::one(),
        }
    }

    #[inline(always)]
    pub(super) fn sample<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wi: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfSamples<F, C::Columns<F>> {
        let weight = self.transmittance.eval_lanes(at, w) * F::splat(self.share);
        BsdfSamples::passing(wi, F::one(), weight)
    }
}

impl<C: ColorModel> Polarizer<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a linear polarizer: half the light passes",
        properties: &[&[
            TRANSMITTANCE,
            THETA,
            boolean("polarizing", true, "polarisation is not followed").without_effect(),
        ]],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        Ok(Self(Sheet::build(properties, palettes, 0.5)?))
    }
}

impl<C: ColorModel> Bsdf<C> for Polarizer<C> {
    fn lobes(&self) -> Lobes {
        LOBES
    }

    fn passes(&self) -> bool {
        true
    }

    single_face!();
}

impl<C: ColorModel> BlockBsdf<C> for Polarizer<C> {
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
