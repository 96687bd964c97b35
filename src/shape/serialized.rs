//! `serialized`: a mesh in Mitsuba's binary format, number `shape_index` (0) of the file `filename`, with `to_world`,
//! `face_normals`, `flip_normals` and `flip_tex_coords`.

use crate::description::Properties;
use crate::error::Result;
use crate::mesh::ReadOptions;

pub(super) fn options(properties: &Properties<'_>) -> Result<ReadOptions> {
    let index = properties.integer("shape_index")?.unwrap_or(0);
    let Ok(shape_index) = usize::try_from(index) else {
        let message = format!("shape_index counts from 0, and {index} does not");
        return Err(properties.error("shape_index", message));
    };
    Ok(ReadOptions {
        shape_index,
        ..ReadOptions::default()
    })
}
