//! `polarizer`: a sheet that passes light of one linear polarisation. Of light that has none half passes, whatever the axis
//! (Malus's mean): half of its `transmittance` (1); `theta` and `polarizing` change nothing.

use super::sheet::{Kind, Sheet, THETA, TRANSMITTANCE};
use crate::description::declared::{Plugin, boolean};

/// A linear polarizer.
pub(super) type Polarizer<C> = Sheet<C, Linear>;

/// See [`Polarizer`].
#[derive(Clone, Copy, Debug)]
pub struct Linear;

impl Kind for Linear {
    const PLUGIN: Plugin = Plugin {
        about: "a linear polarizer: half the light passes",
        properties: &[&[
            TRANSMITTANCE,
            THETA,
            boolean("polarizing", true, "polarisation is not followed").without_effect(),
        ]],
    };
    const SHARE: f32 = 0.5;
}
