//! `retarder`: a sheet that delays one polarisation behind the other. All of the `transmittance` (1) passes; `theta` and
//! `delta` change nothing.

use super::sheet::{Kind, Sheet, THETA, TRANSMITTANCE};
use crate::description::declared::{Plugin, number};

/// A linear retarder.
pub(super) type Retarder<C> = Sheet<C, Delay>;

/// See [`Retarder`].
#[derive(Clone, Copy, Debug)]
pub struct Delay;

impl Kind for Delay {
    const PLUGIN: Plugin = Plugin {
        about: "a linear retarder, such as a quarter-wave plate: all light passes",
        properties: &[&[
            TRANSMITTANCE,
            THETA,
            number("delta", 90.0, "how far one polarisation is behind; degrees").without_effect(),
        ]],
    };
    const SHARE: f32 = 1.0;
}
