//! `obj`: a mesh in Wavefront's text format, from `filename`, with `to_world`, `face_normals`,
//! `flip_normals` and `flip_tex_coords`; with Étendue's own `materials` (false), the colours of the materials that
//! the file names are its attribute `face_color`.

use crate::description::Properties;
use crate::error::Result;
use crate::mesh::ReadOptions;

pub(super) fn options(properties: &Properties<'_>) -> Result<ReadOptions> {
    let materials = properties.boolean("materials")?.unwrap_or(false);
    Ok(ReadOptions {
        materials,
        ..ReadOptions::default()
    })
}
