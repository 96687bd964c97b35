//! The images that MeshLab notes in the comments of a PLY file. Which of them a face has, its property `texnumber` says.

use std::collections::HashMap;
use std::path::Path;

use glam::{Mat3, Vec2};

use crate::mesh::read::Decoded;
use crate::mesh::surface::{Map, Maps, Surface, Surfaces};

/// Makes surfaces of the images `named`, which lie beside the file `path`. Triangles have those of these numbers, or without
/// any all the first.
pub(super) fn show(decoded: &mut Decoded, named: &[String], texnumbers: &[f64], path: &Path) {
    if decoded.mesh.uvs.is_empty() {
        let picture = &named[0];
        decoded.warnings.push(format!(
            "the picture {picture:?} is not shown: the mesh has no texture coordinates"
        ));
        return;
    }
    let mut surfaces = Surfaces::default();
    // Of each image; below the first and beyond the last there is none.
    let mut known: HashMap<Option<usize>, u32> = HashMap::new();
    let mut of = |number: f64| {
        let place = (number >= 0.0).then_some(number as usize);
        let place = place.filter(|place| *place < named.len());
        *known.entry(place).or_insert_with(|| {
            surfaces.number(match place {
                Some(place) => pictured(&path.with_file_name(&named[place])),
                None => Surface::MATTE,
            })
        })
    };
    let runs: Vec<(usize, u32)> = match texnumbers {
        [] => vec![(decoded.mesh.triangles.len(), of(0.0))],
        numbers => numbers.iter().map(|&number| (1, of(number))).collect(),
    };
    decoded.surfaces = surfaces.of_faces(&mut decoded.mesh, &runs);
}

/// Matte, with an image for its colours; texture coordinates run from the bottom.
fn pictured(path: &Path) -> Surface {
    let from_bottom = Mat3::from_translation(Vec2::Y) * Mat3::from_scale(Vec2::new(1.0, -1.0));
    let color = Map {
        to_uv: from_bottom,
        ..Map::of(path.to_owned())
    };
    let maps = Maps {
        color: Some(color),
        ..Maps::NONE
    };
    Surface {
        maps,
        ..Surface::MATTE
    }
}
