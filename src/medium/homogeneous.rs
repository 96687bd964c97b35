//! `homogeneous`: a medium whose extinction is the same everywhere; distances and transmittances are exact. Its albedo may
//! vary over space.

use super::{BlockMedium, COMMON, Common, Flight, Matter, Way};
use crate::color::ColorModel;
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::lanes::Lanes;
use crate::sampler::Draws;
use crate::texture::Palettes;

/// The same everywhere.
#[derive(Clone, Debug)]
pub struct Homogeneous<C: ColorModel> {
    common: Common<C>,
}

impl<C: ColorModel> Homogeneous<C> {
    pub(super) const PLUGIN: Plugin = Plugin {
        about: "a medium that is the same everywhere",
        properties: &[COMMON],
    };

    pub(super) fn build(properties: &Properties<'_>, palettes: &Palettes<C>) -> Result<Self> {
        let common = Common::build(properties, palettes)?;
        if common.sigma_t.constant().is_none() {
            let error = properties.error("sigma_t", "extinction must be the same everywhere");
            return Err(error.help("a medium of type \"heterogeneous\" takes a grid"));
        }
        Ok(Self { common })
    }
}

impl<C: ColorModel> Matter<C> for Homogeneous<C> {
    fn common(&self) -> &Common<C> {
        &self.common
    }
}

impl<C: ColorModel> BlockMedium<C> for Homogeneous<C> {
    #[inline(always)]
    fn fly<F: Lanes>(
        &self,
        way: &Way<'_, C, F>,
        first: F,
        _draws: Draws<F>,
    ) -> Flight<F, C::Columns<F>> {
        self.common.fly_evenly(way, F::zero(), first)
    }

    #[inline(always)]
    fn transmit<F: Lanes>(&self, way: &Way<'_, C, F>, _draws: Draws<F>) -> C::Columns<F> {
        self.common.transmit_evenly(way, way.end)
    }
}
