//! `gltf`: the default scene of a glTF or GLB file `filename` as one mesh, with `to_world`, `face_normals`,
//! `flip_normals` and `flip_tex_coords`; the materials' base colours are its attribute `face_color`, or where the file
//! has colours of vertices `vertex_color`. Without normals it is flat. Étendue's own: Mitsuba has no such shape.

use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::mesh::ReadOptions;

pub(super) const PLUGIN: Plugin = Plugin {
    about: "the default scene of a glTF or GLB file as one mesh",
    properties: &[super::COMMON, super::MESH, super::FILE],
};

pub(super) fn options(_properties: &Properties<'_>) -> Result<ReadOptions> {
    Ok(ReadOptions::default())
}
