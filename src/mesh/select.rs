//! Some triangles of a mesh as a mesh of their own.

use super::{Attribute, Mesh, Per};

/// Of a vertex that was not met yet.
pub(super) const NOWHERE: u32 = u32::MAX;

/// The mesh of these triangles alone, its vertices in the order of their first use. `places` has [`NOWHERE`] for each
/// vertex, before and after.
pub(super) fn select(mesh: &Mesh, triangles: &[u32], places: &mut [u32]) -> Mesh {
    let mut vertices = Vec::new();
    let mut part = Mesh::default();
    for &triangle in triangles {
        let corners = mesh.triangles[triangle as usize].map(|corner| {
            let place = &mut places[corner as usize];
            if *place == NOWHERE {
                *place = vertices.len() as u32;
                vertices.push(corner);
            }
            *place
        });
        part.triangles.push(corners);
    }
    for &vertex in &vertices {
        places[vertex as usize] = NOWHERE;
        let i = vertex as usize;
        part.positions.push(mesh.positions[i]);
        part.normals.extend(mesh.normals.get(i));
        part.uvs.extend(mesh.uvs.get(i));
    }
    for attribute in &mesh.attributes {
        let rows = match attribute.per {
            Per::Vertex => &vertices,
            Per::Face => triangles,
        };
        let rows = rows.iter().flat_map(|&i| attribute.row(i as usize));
        part.attributes.push(Attribute {
            values: rows.copied().collect(),
            name: attribute.name.clone(),
            ..*attribute
        });
    }
    part
}
