//! `cylinder`: around the segment from `p0` (the origin) to `p1` (0, 0, 1) with `radius` 1, under `to_world`
//! (which may make it elliptic and slanted) and `flip_normals`. Texture coordinates are the angle φ/2π and the height
//! from 0 at `p0` to 1 at `p1`. It is open, as in Mitsuba; with Étendue's own `caps` (false) both ends are closed by a
//! `disk`, with a disk's texture coordinates.

use glam::DMat4;

use super::Shape;
use super::frustum::{self, Profile};
use crate::description::Properties;
use crate::description::declared::{Plugin, boolean, float, vector};
use crate::error::Result;

pub(super) const PLUGIN: Plugin = Plugin {
    about: "a cylinder, open as in Mitsuba",
    properties: &[
        super::COMMON,
        &[
            vector("p0", [0.0; 3], "centre of one end"),
            vector("p1", [0.0, 0.0, 1.0], "centre of the other"),
            float("radius", 1.0, "of both ends; scene units").positive(),
            super::FLIP_NORMALS,
            boolean("caps", false, "whether both ends are closed by disks").own(),
        ],
    ],
};

pub(super) fn build(properties: &Properties<'_>, to_world: &DMat4) -> Result<Shape> {
    let caps = properties.boolean("caps")?;
    let closed = if caps { vec![0.0, 1.0] } else { Vec::new() };
    let slope = 0.0;
    frustum::build(properties, to_world, Profile { slope, closed })
}
