//! `obj`: a mesh in Wavefront's text format, from `filename`, with `to_world`, `face_normals`,
//! `flip_normals` and `flip_tex_coords`; with Étendue's own `materials` (false), the colours of the materials that
//! the file names are its attribute `face_color`.

use glam::DMat4;

use super::{Shape, mesh};
use crate::description::Properties;
use crate::error::Result;
use crate::mesh::ReadOptions;

pub(super) fn build(properties: &Properties<'_>, outer: &DMat4) -> Result<Shape> {
    let materials = properties.boolean("materials")?.unwrap_or(false);
    mesh::load(
        properties,
        outer,
        ReadOptions {
            materials,
            ..ReadOptions::default()
        },
    )
}
