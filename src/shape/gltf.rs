//! `gltf`: the default scene of a glTF or GLB file `filename` as one mesh, with `to_world`, `face_normals`,
//! `flip_normals` and `flip_tex_coords`; the materials' base colours are its attribute `face_color`, or where the file
//! has colours of vertices `vertex_color`; with `bare` their other factors are `face_roughness`, `face_metallic`,
//! `face_emission` and `face_opacity`. Without normals it is flat. With `times` and no other file it deforms as the
//! file's first animation says: it is looked at at each of these times, in seconds. Étendue's own: Mitsuba has no such
//! shape.

use crate::description::Properties;
use crate::description::declared::Plugin;
use crate::error::Result;
use crate::mesh::ReadOptions;

pub(super) const PLUGIN: Plugin = Plugin {
    about: "the default scene of a glTF or GLB file as one mesh",
    properties: &[super::COMMON, super::MESH, super::FILE],
};

pub(super) fn options(properties: &Properties<'_>) -> Result<ReadOptions> {
    Ok(ReadOptions {
        time: super::deforming::Sets::of(properties)?.first_time(),
        ..ReadOptions::default()
    })
}
