//! `volume`: what a volume has where the surface is, looked up in the world. A surface needs no texture coordinates for
//! it. The family of volumes stands in the folder beside it; media have them too.

mod constvolume;
mod field;
mod gridvolume;

use std::any::TypeId;

use super::{Palette, Pattern};
use crate::color::{ColorModel, Mono, Spectra};
use crate::description::Properties;
use crate::description::declared::{Plugin, volume};
use crate::error::Result;
use crate::interaction::{Interaction, Points};
use crate::lanes::Lanes;

pub use field::{Field, Volume};

/// A volume, where it meets a surface.
#[derive(Clone, Debug)]
pub struct Cut<C: ColorModel> {
    volume: Volume<C>,
}

impl<C: ColorModel> Cut<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a volume where the surface meets it",
        properties: &[&[volume("volume", 0.75, "looked up in the world")]],
    };

    pub(super) fn build(properties: &Properties<'_>, palette: &Palette<C>) -> Result<Self> {
        let role = palette.inner_role();
        let volume = Volume::named(properties, "volume", palette, role)?;
        // As a number a matrix is the mean of its entries, as in Mitsuba.
        let numbers = TypeId::of::<C>() == TypeId::of::<Mono>();
        if volume.holds_matrices() && !numbers {
            let message = "a colour needs a grid of 1 or 3 channels, and this one holds matrices";
            return Err(properties.error("volume", message));
        }
        Ok(Self { volume })
    }

    /// The values at points.
    #[inline(always)]
    pub(super) fn eval_lanes<F: Lanes>(
        &self,
        at: &Points<'_, F>,
        wavelengths: &[C::Wavelengths],
    ) -> C::Columns<F> {
        self.volume.eval_lanes(at.position, wavelengths)
    }
}

impl<C: ColorModel> Pattern<C> for Cut<C> {
    fn eval(&self, at: &Interaction<'_>, wavelengths: &C::Wavelengths) -> C::Sample {
        let wavelengths = std::slice::from_ref(wavelengths);
        let value = self
            .volume
            .eval_lanes::<f32>(at.position.into(), wavelengths);
        value.sample(0)
    }

    fn constant(&self) -> Option<&C::Stored> {
        self.volume.constant()
    }
}

#[cfg(test)]
mod tests;
