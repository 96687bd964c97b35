//! `serialized`: a mesh in Mitsuba's binary format, number `shape_index` (0) of the file `filename`, with `to_world`,
//! `face_normals`, `flip_normals` and `flip_tex_coords`.

use glam::DMat4;

use super::{Shape, mesh};
use crate::description::Properties;
use crate::error::Result;
use crate::mesh::ReadOptions;

pub(super) fn build(properties: &Properties<'_>, outer: &DMat4) -> Result<Shape> {
    let index = properties.integer("shape_index")?.unwrap_or(0);
    let Ok(shape_index) = usize::try_from(index) else {
        let message = format!("shape_index counts from 0, and {index} does not");
        return Err(properties.error("shape_index", message));
    };
    mesh::load(
        properties,
        outer,
        ReadOptions {
            shape_index,
            ..ReadOptions::default()
        },
    )
}
