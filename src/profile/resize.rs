//! A mesh in more triangles or fewer, and as a file.

use std::collections::HashMap;

use crate::math::random;
use crate::mesh::Mesh;

/// About so many triangles of a mesh: some of them, drawn evenly, so that smaller parts lie within larger ones;
/// or all, each cut in four as often as it takes.
pub(super) fn resized(mesh: &Mesh, triangles: u32) -> Mesh {
    let own = mesh.triangles.len();
    let wanted = (triangles as usize).max(1);
    let bare = |positions, triangles| Mesh {
        positions,
        triangles,
        ..Mesh::default()
    };
    if wanted < own {
        let mut order: Vec<u32> = (0..own as u32).collect();
        order.sort_unstable_by_key(|i| random::key(0, u64::from(*i)));
        order.truncate(wanted);
        order.sort_unstable();
        let mut numbers = HashMap::new();
        let mut positions = Vec::new();
        let chosen = order.iter().map(|i| {
            mesh.triangles[*i as usize].map(|corner| {
                *numbers.entry(corner).or_insert_with(|| {
                    positions.push(mesh.positions[corner as usize]);
                    positions.len() as u32 - 1
                })
            })
        });
        let chosen = chosen.collect();
        return bare(positions, chosen);
    }
    let mut finer = bare(mesh.positions.clone(), mesh.triangles.clone());
    while finer.triangles.len() * 2 < wanted {
        finer = in_four(&finer);
    }
    finer
}

/// Each triangle cut in four through the middles of its edges.
fn in_four(mesh: &Mesh) -> Mesh {
    let mut positions = mesh.positions.clone();
    let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
    let mut triangles = Vec::with_capacity(4 * mesh.triangles.len());
    for &[a, b, c] in &mesh.triangles {
        let mut middle = |i: u32, j: u32| {
            *middles.entry([i.min(j), i.max(j)]).or_insert_with(|| {
                positions.push(0.5 * (positions[i as usize] + positions[j as usize]));
                positions.len() as u32 - 1
            })
        };
        let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
        triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    Mesh {
        positions,
        triangles,
        ..Mesh::default()
    }
}

/// The mesh as a binary PLY file.
pub(super) fn ply(mesh: &Mesh) -> Vec<u8> {
    let mut out = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\nelement face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        mesh.positions.len(),
        mesh.triangles.len()
    )
    .into_bytes();
    out.reserve(12 * mesh.positions.len() + 13 * mesh.triangles.len());
    for p in &mesh.positions {
        out.extend(p.to_array().iter().flat_map(|x| x.to_le_bytes()));
    }
    for triangle in &mesh.triangles {
        out.push(3);
        out.extend(triangle.iter().flat_map(|i| i.to_le_bytes()));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    use glam::Vec3;

    use crate::mesh::{ReadOptions, bumpy_sphere, read, terrain};

    #[test]
    fn meshes_come_in_nested_parts_and_in_finer_cuts_of_the_same_surface() {
        let mesh = bumpy_sphere(3, 1);
        let own = mesh.triangles.len() as u32;
        let [small, large] = [resized(&mesh, own / 8), resized(&mesh, own / 2)];
        assert_eq!(small.triangles.len() as u32, own / 8);
        let corners = |mesh: &Mesh| -> Vec<[Vec3; 3]> {
            mesh.triangles.iter().map(|t| mesh.corners(t)).collect()
        };
        let larger = corners(&large);
        assert!(corners(&small).iter().all(|t| larger.contains(t)));
        let finer = resized(&mesh, 16 * own);
        assert_eq!(finer.triangles.len() as u32, 16 * own);
        assert!((finer.area() / mesh.area() - 1.0).abs() < 1e-5);
        assert_eq!(finer.bounds(), mesh.bounds());
        // Closed: 3/2 edges a triangle, and Euler's formula.
        assert_eq!(finer.positions.len(), finer.triangles.len() / 2 + 2);
    }

    #[test]
    fn a_written_mesh_is_read_as_it_was() {
        let mesh = terrain(500, 2);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ply");
        fs::write(&path, ply(&mesh)).unwrap();
        let again = read(&path, &ReadOptions::default()).unwrap().mesh;
        assert_eq!(
            (again.positions, again.triangles),
            (mesh.positions, mesh.triangles)
        );
    }
}
