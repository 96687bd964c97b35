//! `null`: a surface that light passes as if it were not there.

use super::{BlockBsdf, Bsdf, BsdfSamples, BsdfValues, Lobes, single_face};
use crate::color::{ColorModel, Spectra};
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::interaction::Points;
use crate::lanes::{Lanes, Vec2, Vec3};
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

    fn passes(&self) -> bool {
        true
    }

    single_face!();
}

impl<C: ColorModel> BlockBsdf<C> for Null {
    #[inline(always)]
    fn passing_lanes<F: Lanes>(
        &self,
        _at: &Points<'_, F>,
        _wi: Vec3<F>,
        _w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        BsdfValues {
            value: C::Columns::<F>::splat(F::one()),
            pdf: F::one(),
        }
    }

    #[inline(always)]
    fn sample_lanes<F: Lanes>(
        &self,
        _at: &Points<'_, F>,
        wi: Vec3<F>,
        _u1: F,
        _u2: Vec2<F>,
        _w: &[C::Wavelengths],
    ) -> BsdfSamples<F, C::Columns<F>> {
        BsdfSamples::passing(wi, F::one(), C::Columns::<F>::splat(F::one()))
    }
}
