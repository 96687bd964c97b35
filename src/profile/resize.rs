//! A mesh in more triangles or fewer, and as a file.

use std::collections::{HashMap, HashSet};

use glam::DVec3;

use crate::mesh::Mesh;

/// A mesh of about so many triangles that covers what this one covers: vertices that lie together become one, or each
/// triangle is cut in four as often as it takes.
pub(super) fn resized(mesh: &Mesh, triangles: u32) -> Mesh {
    let own = mesh.triangles.len();
    let wanted = (triangles as usize).max(1);
    let bare = |positions, triangles| Mesh {
        positions,
        triangles,
        ..Mesh::default()
    };
    if wanted < own {
        return coarser(mesh, wanted);
    }
    let mut finer = bare(mesh.positions.clone(), mesh.triangles.clone());
    while finer.triangles.len() * 2 < wanted {
        finer = in_four(&finer);
    }
    finer
}

/// The mesh with vertices joined that lie in one cell of a grid, whose cells are as large as leaves most triangles that
/// are no more than `wanted`.
fn coarser(mesh: &Mesh, wanted: usize) -> Mesh {
    /// Cells along the box's longest side.
    const MOST: u32 = 1 << 16;
    let (mut few, mut many) = (1, MOST);
    let mut best = clustered(mesh, few);
    while few + 1 < many {
        // Triangles grow with the square of the cells.
        let ratio = (wanted as f64 / best.triangles.len().max(1) as f64)
            .sqrt()
            .clamp(1.01, 4.0);
        let guess = ((f64::from(few) * ratio) as u32).clamp(few + 1, many - 1);
        let middle = if many == MOST {
            guess
        } else {
            few.midpoint(many)
        };
        let mesh = clustered(mesh, middle);
        if mesh.triangles.len() <= wanted {
            (few, best) = (middle, mesh);
        } else {
            many = middle;
        }
    }
    if best.triangles.is_empty() {
        return clustered(mesh, many);
    }
    best
}

/// The mesh with one vertex in each cell of a grid of so many cells along the longest side: the mean of those that were
/// in it. Triangles that lose their area, and those that are there already, are left out.
fn clustered(mesh: &Mesh, cells: u32) -> Mesh {
    let (low, high) = mesh.bounds().unwrap_or_default();
    let cell = ((high - low).max_element() / cells as f32).max(f32::MIN_POSITIVE);
    let mut numbers: HashMap<[u32; 3], u32> = HashMap::new();
    let mut sums: Vec<(DVec3, u32)> = Vec::new();
    let joined = mesh.positions.iter().map(|position| {
        let place = ((*position - low) / cell).to_array().map(|x| x as u32);
        let number = *numbers.entry(place).or_insert_with(|| {
            sums.push((DVec3::ZERO, 0));
            sums.len() as u32 - 1
        });
        let (sum, count) = &mut sums[number as usize];
        *sum += position.as_dvec3();
        *count += 1;
        number
    });
    let joined: Vec<u32> = joined.collect();
    let mut seen = HashSet::new();
    let triangles = mesh
        .triangles
        .iter()
        .map(|t| t.map(|corner| joined[corner as usize]));
    let triangles = triangles.filter(|&[a, b, c]| {
        let mut sorted = [a, b, c];
        sorted.sort_unstable();
        a != b && b != c && c != a && seen.insert(sorted)
    });
    let triangles = triangles.collect();
    let means = sums
        .iter()
        .map(|(sum, count)| (*sum / f64::from(*count)).as_vec3());
    Mesh {
        triangles,
        positions: means.collect(),
        ..Mesh::default()
    }
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
    use crate::budget::Budget;
    use std::fs;

    use crate::mesh::{ReadOptions, bumpy_sphere, read, terrain};

    #[test]
    fn meshes_come_coarser_and_finer_and_cover_what_they_covered() {
        let mesh = bumpy_sphere(5, 1);
        let own = mesh.triangles.len() as u32;
        for part in [4, 16, 64] {
            let small = resized(&mesh, own / part);
            let count = small.triangles.len() as u32;
            assert!(
                count <= own / part && count > own / part / 2,
                "{part}: {count} of {own}"
            );
            let (low, high) = small.bounds().unwrap();
            let (low_of_all, high_of_all) = mesh.bounds().unwrap();
            assert!(low.distance(low_of_all) < 0.4 && high.distance(high_of_all) < 0.4);
            assert!(
                (small.area() / mesh.area() - 1.0).abs() < 0.35,
                "{part}: {}",
                small.area()
            );
        }
        assert!((1..50).contains(&resized(&mesh, 1).triangles.len()));
        let mesh = bumpy_sphere(3, 1);
        let own = mesh.triangles.len() as u32;
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
        let again = read(&path, &ReadOptions::default(), &Budget::default())
            .unwrap()
            .mesh;
        assert_eq!(
            (again.positions, again.triangles),
            (mesh.positions, mesh.triangles)
        );
    }
}
