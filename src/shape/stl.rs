//! `stl`: a mesh in the stereolithography format, from `filename`, with `to_world`, `face_normals` and
//! `flip_normals`. Étendue's own: Mitsuba has no such shape.

use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::mesh::ReadOptions;

pub(super) const PLUGIN: Plugin = Plugin {
    about: "a mesh in the stereolithography format",
    properties: &[super::COMMON, super::MESH, super::FILE],
};

pub(super) fn options(_properties: &Properties<'_>) -> Result<ReadOptions> {
    Ok(ReadOptions::default())
}
