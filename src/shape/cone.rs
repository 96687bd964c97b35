//! `cone`, Étendue's own: from the circle of `radius` 1 around `p0` (the origin) to the apex `p1` (0, 0, 1), under
//! `to_world` (which may make it elliptic and slanted) and `flip_normals`. Texture coordinates are a `cylinder`'s:
//! the angle φ/2π and the height from 0 at `p0` to 1 at the apex. With `base` (true) the circle is closed by a `disk`,
//! with a disk's texture coordinates.

use glam::DMat4;

use super::Shape;
use super::frustum::{self, Profile};
use crate::description::Properties;
use crate::description::declared::{Plugin, boolean, float, vector};
use crate::error::Result;

pub(super) const PLUGIN: Plugin = Plugin {
    about: "a cone, closed or open",
    properties: &[
        super::COMMON,
        &[
            vector("p0", [0.0; 3], "centre of the base"),
            vector("p1", [0.0, 0.0, 1.0], "apex"),
            float("radius", 1.0, "of the base; scene units").positive(),
            super::FLIP_NORMALS,
            boolean("base", true, "whether the base is closed by a disk"),
        ],
    ],
};

pub(super) fn build(properties: &Properties<'_>, to_world: &DMat4) -> Result<Shape> {
    let base = properties.boolean("base")?;
    let closed = if base { vec![0.0] } else { Vec::new() };
    let slope = -1.0;
    frustum::build(properties, to_world, Profile { slope, closed })
}
