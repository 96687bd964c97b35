//! `ply`: a mesh in the Stanford polygon format, from `filename`, with `to_world`, `face_normals`,
//! `flip_normals` and `flip_tex_coords`.

use super::{Shape, mesh};
use crate::description::Properties;
use crate::error::Result;
use crate::mesh::ReadOptions;

pub(super) fn build(properties: &Properties<'_>) -> Result<Shape> {
    mesh::load(properties, ReadOptions::default())
}
