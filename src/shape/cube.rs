//! `cube`: the cube [−1, 1]³ with a square of texture a face, under `to_world` and `flip_normals`.

use glam::DMat4;

use super::{Shape, mesh::place};
use crate::description::Properties;
use crate::error::Result;
use crate::mesh;

pub(super) fn build(properties: &Properties<'_>, outer: &DMat4) -> Result<Shape> {
    place(mesh::cube(), properties, outer)
}
