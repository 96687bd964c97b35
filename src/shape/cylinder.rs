//! `cylinder`: around the segment from `p0` (the origin) to `p1` (0, 0, 1) with `radius` 1, under `to_world`
//! (which may make it elliptic and slanted) and `flip_normals`. Texture coordinates are the angle φ/2π and the height
//! from 0 at `p0` to 1 at `p1`. It is open, as in Mitsuba; with Étendue's own `caps` (false) both ends are closed by a
//! `disk`, with a disk's texture coordinates.

use glam::DMat4;

use super::Shape;
use super::frustum::{self, Profile};
use crate::description::Properties;
use crate::error::Result;

pub(super) fn build(properties: &Properties<'_>, outer: &DMat4) -> Result<Shape> {
    properties.own(&["caps"])?;
    let caps = properties.boolean("caps")?.unwrap_or(false);
    let closed = if caps { vec![0.0, 1.0] } else { Vec::new() };
    let slope = 0.0;
    frustum::build(properties, outer, Profile { slope, closed })
}
