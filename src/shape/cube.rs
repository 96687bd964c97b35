//! `cube`: the cube [−1, 1]³ with a square of texture a face, under `to_world` and `flip_normals`.

use glam::DMat4;

use super::{Shape, mesh::place};
use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::mesh;

pub(super) const PLUGIN: Plugin = Plugin {
    about: "the cube [−1, 1]³",
    properties: &[super::COMMON, super::MESH],
};

pub(super) fn build(properties: &Properties<'_>, to_world: &DMat4) -> Result<Shape> {
    place(mesh::cube(), properties, to_world)
}
