//! `stl`: a mesh in the stereolithography format, from `filename`, with `to_world`, `face_normals` and
//! `flip_normals`. Étendue's own: Mitsuba has no such shape.

use super::{Shape, mesh};
use crate::description::Properties;
use crate::error::Result;
use crate::mesh::ReadOptions;

pub(super) fn build(properties: &Properties<'_>) -> Result<Shape> {
    mesh::load(properties, ReadOptions::default())
}
