//! What `circular`, `polarizer` and `retarder` share: a sheet that light passes straight on, weakened. Polarisation is not
//! followed here, so that how a sheet is turned changes nothing, as in Mitsuba's variants without polarisation.

use std::fmt::Debug;
use std::marker::PhantomData;

use super::{BlockBsdf, Bsdf, BsdfSamples, BsdfValues, Lobes, single_face};
use crate::color::{ColorModel, Role, Spectral as _};
use crate::description::Properties;
use crate::description::declared::{Plugin, Row, number, texture};
use crate::error::Result;
use crate::interaction::{Interaction, Points};
use crate::lanes::{Lanes, Vec2, Vec3};
use crate::texture::{Palettes, Texture};

/// Which sheet it is.
pub trait Kind: Clone + Debug + Send + Sync + 'static {
    /// What its plugin declares.
    const PLUGIN: Plugin;
    /// What the transmittance is multiplied by, in [0, 1].
    const SHARE: f32;
    /// Whether the transmittance is the albedo that is shown, as in Mitsuba; else that is black.
    const SHOWN: bool = false;
}

/// A sheet that light passes straight on, weakened.
#[derive(Clone, Debug)]
pub struct Sheet<C: ColorModel, K> {
    transmittance: Texture<C>,
    kind: PhantomData<K>,
}

/// What passes.
pub(super) const TRANSMITTANCE: Row =
    texture("transmittance", 1.0, "the share of light that passes");
/// How the sheet is turned.
pub(super) const THETA: Row =
    number("theta", 0.0, "how its axis is turned; degrees").without_effect();

impl<C: ColorModel, K: Kind> Sheet<C, K> {
    pub(super) const PLUGIN: Plugin = K::PLUGIN;

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let colors = &palettes.colors;
        Ok(Self {
            transmittance: colors.texture(properties, "transmittance", Role::Reflectance)?,
            kind: PhantomData,
        })
    }

    /// The share that passes.
    #[inline(always)]
    fn share<F: Lanes>(&self, at: &Points<'_, F>, w: &[C::Wavelengths]) -> C::Columns<F> {
        self.transmittance.eval_lanes(at, w) * F::splat(K::SHARE)
    }
}

impl<C: ColorModel, K: Kind> Bsdf<C> for Sheet<C, K> {
    fn lobes(&self) -> Lobes {
        Lobes {
            smooth: false,
            transmission: true,
        }
    }

    fn albedo(&self, at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> C::Sample {
        match K::SHOWN {
            true => self.transmittance.eval(at, wavelengths),
            false => C::Sample::zero(),
        }
    }

    fn passes(&self) -> bool {
        true
    }

    single_face!();
}

impl<C: ColorModel, K: Kind> BlockBsdf<C> for Sheet<C, K> {
    #[inline(always)]
    fn passing_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        _wi: Vec3<F>,
        w: &[C::Wavelengths],
    ) -> BsdfValues<F, C::Columns<F>> {
        BsdfValues {
            value: self.share(at, w),
            pdf: F::one(),
        }
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
        BsdfSamples::passing(wi, F::one(), self.share(at, w))
    }
}
