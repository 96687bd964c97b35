//! `rectangle`: the square [−1, 1]² at z = 0 facing +z, with uv = (p + 1)/2, under `to_world` and `flip_normals`.

use glam::DMat4;

use super::{Shape, mesh::place};
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::mesh;

pub(super) const PLUGIN: Plugin = Plugin {
    about: "the square [−1, 1]² at z = 0, facing +z",
    properties: &[super::COMMON, super::MESH],
};

pub(super) fn build(properties: &Properties<'_>, to_world: &DMat4) -> Result<Shape> {
    place(mesh::rectangle(), properties, to_world)
}
