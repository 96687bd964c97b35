//! `serialized`: a mesh in Mitsuba's binary format, number `shape_index` (0) of the file `filename`, with `to_world`,
//! `face_normals`, `flip_normals` and `flip_tex_coords`.

use crate::description::Properties;
use crate::description::declared::{Plugin, integer};
use crate::error::Result;
use crate::mesh::ReadOptions;

pub(super) const PLUGIN: Plugin = Plugin {
    about: "a mesh in Mitsuba's binary format",
    properties: &[
        super::COMMON,
        super::MESH,
        super::FILE,
        &[integer("shape_index", 0, "which of the file's meshes").at_least(0.0)],
    ],
};

pub(super) fn options(properties: &Properties<'_>) -> Result<ReadOptions> {
    Ok(ReadOptions {
        shape_index: properties.integer("shape_index")? as usize,
        ..ReadOptions::default()
    })
}
