//! `ply`: a mesh in the Stanford polygon format, from `filename`, with `to_world`, `face_normals`,
//! `flip_normals` and `flip_tex_coords`.

use glam::DMat4;

use super::{Shape, mesh};
use crate::description::Properties;
use crate::error::Result;
use crate::mesh::ReadOptions;

pub(super) fn build(properties: &Properties<'_>, outer: &DMat4) -> Result<Shape> {
    mesh::load(properties, outer, ReadOptions::default())
}
