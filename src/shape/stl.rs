//! `stl`: a mesh in the stereolithography format, from `filename`, with `to_world`, `face_normals` and
//! `flip_normals`. Étendue's own: Mitsuba has no such shape.

use glam::DMat4;

use super::{Shape, mesh};
use crate::description::Properties;
use crate::error::Result;
use crate::mesh::ReadOptions;

pub(super) fn build(properties: &Properties<'_>, outer: &DMat4) -> Result<Shape> {
    mesh::load(properties, outer, ReadOptions::default())
}
