//! `obj`: a mesh in Wavefront's text format, from `filename`, with `to_world`, `face_normals`,
//! `flip_normals` and `flip_tex_coords`; with Étendue's own `materials` (false), the colours of the materials that
//! the file names are its attribute `face_color`.

use crate::description::Properties;
use crate::description::declared::{Plugin, boolean};
use crate::error::Result;
use crate::mesh::ReadOptions;

pub(super) const PLUGIN: Plugin = Plugin {
    about: "a mesh in Wavefront's text format",
    properties: &[
        super::COMMON,
        super::MESH,
        super::FILE,
        &[boolean(
            "materials",
            false,
            "whether the colours of the file's materials are the attribute face_color",
        )
        .own()],
    ],
};

pub(super) fn options(properties: &Properties<'_>) -> Result<ReadOptions> {
    let materials = properties.boolean("materials")?;
    Ok(ReadOptions {
        materials,
        ..ReadOptions::default()
    })
}
