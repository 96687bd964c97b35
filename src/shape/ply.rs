//! `ply`: a mesh in the Stanford polygon format, from `filename`, with `to_world`, `face_normals`,
//! `flip_normals` and `flip_tex_coords`.

use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::mesh::ReadOptions;

pub(super) const PLUGIN: Plugin = Plugin {
    about: "a mesh in the Stanford polygon format",
    properties: &[super::COMMON, super::MESH, super::FILE],
};

pub(super) fn options(_properties: &Properties<'_>) -> Result<ReadOptions> {
    Ok(ReadOptions::default())
}
