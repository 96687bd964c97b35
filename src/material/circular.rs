//! `circular`: a sheet that passes light of one circular polarisation: half of the `transmittance` (1), as through a
//! `polarizer`; `left_handed` changes nothing.

use super::sheet::{Kind, Sheet, TRANSMITTANCE};
use crate::description::declared::{Plugin, boolean};

/// A circular polarizer.
pub(super) type Circular<C> = Sheet<C, Handed>;

/// See [`Circular`].
#[derive(Clone, Copy, Debug)]
pub struct Handed;

impl Kind for Handed {
    const PLUGIN: Plugin = Plugin {
        about: "a circular polarizer: half the light passes",
        properties: &[&[
            TRANSMITTANCE,
            boolean("left_handed", false, "polarisation is not followed").without_effect(),
        ]],
    };
    const SHARE: f32 = 0.5;
    const SHOWN: bool = true;
}
