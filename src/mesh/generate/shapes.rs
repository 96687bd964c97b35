//! Balls and boxes of as many triangles as wanted, and bumps on any mesh: each vertex moves along its normal by fractal
//! noise of its place. What stands at one place moves together, so that a closed mesh stays closed.

use glam::Vec3;

use super::{icosahedron, noise::Noise};
use crate::mesh::Mesh;

/// The unit sphere of 20 · 4ⁿ triangles: an icosahedron of which each triangle is cut in four `subdivisions` times, the new
/// vertices put on the sphere. With exact normals, without texture coordinates.
///
/// # Panics
/// Beyond 14 subdivisions, where 32 bits no longer number the vertices.
pub fn ball(subdivisions: u32) -> Mesh {
    let (corners, triangles) = icosahedron();
    let positions: Vec<Vec3> = corners.iter().map(|p| p.as_vec3()).collect();
    let mut mesh = Mesh {
        normals: positions.clone(),
        positions,
        triangles,
        ..Mesh::default()
    };
    for _ in 0..subdivisions {
        mesh.subdivide(1, usize::MAX)
            .expect("32 bits number the vertices");
        // The mean of unit normals, made unit, is the place on the sphere.
        mesh.positions.clone_from(&mesh.normals);
    }
    mesh
}

/// The box [−1, 1]³ of 12 · 4ⁿ triangles, its corners shared, without normals or texture coordinates.
///
/// # Panics
/// Beyond 14 subdivisions, where 32 bits no longer number the vertices.
pub fn block(subdivisions: u32) -> Mesh {
    let mut mesh = super::menger(0);
    mesh.subdivide(subdivisions, usize::MAX)
        .expect("32 bits number the vertices");
    mesh
}

/// Bumps on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bumps {
    /// The height of the largest, as a part of the diagonal of the mesh's box.
    pub height: f64,
    /// Their width, as a part of that diagonal; positive.
    pub width: f64,
    /// How many sizes there are, each half as large as the one before.
    pub octaves: u32,
    /// Chooses them.
    pub seed: u64,
}

/// Moves vertices along their normals; normals are computed anew where the mesh has any.
pub fn add_bumps(mesh: &mut Mesh, bumps: &Bumps) {
    let Some((low, high)) = mesh.bounds() else {
        return;
    };
    let diagonal = low.as_dvec3().distance(high.as_dvec3());
    let noise = Noise::new(bumps.seed, bumps.octaves);
    let (height, width) = (bumps.height * diagonal, bumps.width * diagonal);
    let place = |p: Vec3| (p - low).as_dvec3() / width;
    mesh.displace(|mesh, vertex| Some(height * noise.at(place(mesh.positions[vertex]))));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Report;

    #[test]
    fn balls_and_blocks_are_closed_and_as_large_as_they_should_be() {
        for n in 0..5 {
            for (mesh, base) in [(ball(n), 20), (block(n), 12)] {
                let report = Report::of(&mesh);
                assert_eq!(report.triangles, base << (2 * n));
                assert_eq!(report.vertices, report.triangles / 2 + 2);
                assert!(report.closed && report.euler_characteristic == 2);
            }
        }
        let volume = Report::of(&ball(6)).volume.unwrap();
        assert!((volume / (4.0 / 3.0 * std::f64::consts::PI) - 1.0).abs() < 1e-3);
        assert_eq!(Report::of(&block(4)).volume, Some(8.0));
        assert!(
            ball(4)
                .positions
                .iter()
                .all(|p| (p.length() - 1.0).abs() < 1e-6)
        );
    }

    #[test]
    fn bumps_are_as_high_as_is_said_and_leave_no_cracks() {
        let bumps = Bumps {
            height: 0.02,
            width: 0.2,
            octaves: 5,
            seed: 7,
        };
        for mut mesh in [ball(5), block(4), crate::mesh::cube()] {
            let before = mesh.clone();
            mesh.subdivide(0, usize::MAX).unwrap();
            add_bumps(&mut mesh, &bumps);
            let report = Report::of(&mesh);
            assert!(report.closed && report.components == 1);
            let moved = (before.positions.iter().zip(&mesh.positions)).map(|(p, q)| p.distance(*q));
            let farthest = moved.fold(0.0, f32::max);
            let diagonal = 2.0 * 3.0_f32.sqrt();
            assert!(
                (0.004 * diagonal..0.04 * diagonal).contains(&farthest),
                "{farthest}"
            );
            assert_eq!(mesh.normals.is_empty(), before.normals.is_empty());
            let mut other = before.clone();
            add_bumps(&mut other, &Bumps { seed: 8, ..bumps });
            assert_ne!(other, mesh);
        }
        add_bumps(&mut Mesh::default(), &bumps);
    }
}
