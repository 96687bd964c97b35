//! Vertices moved along their normals. Those at one place move as one, by the mean of their heights and along the mean of
//! their different normals, so that no crack opens at seams. Normals are then computed anew, smooth over a place but for
//! creases: where the old normals of a place differ, the new ones do.

use glam::DVec3;
use rayon::prelude::*;

use super::{GRAIN, Mesh, normals, weld};

/// What [`Mesh::displace`] met at seams.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seams {
    /// Places at which vertices have different heights, of which the mean was taken.
    pub places: usize,
    /// The largest such difference.
    pub gap: f64,
}

/// The cosine of the angle from which normals make a crease: one degree.
const CREASE: f32 = 0.999_85;

impl Mesh {
    /// Moves each vertex by its `height` along its normal, or along the mean of its faces' normals where the mesh has none,
    /// and computes those anew that it has. A vertex without a height goes where others at its place go.
    pub fn displace(&mut self, height: impl Fn(&Self, usize) -> Option<f64> + Sync) -> Seams {
        let mesh = &*self;
        let heights: Vec<Option<f64>> = (0..mesh.positions.len())
            .into_par_iter()
            .with_min_len(GRAIN)
            .map(|vertex| height(mesh, vertex))
            .collect();
        let first = weld::first_at_place(&self.positions);
        let faceted = self.normals.is_empty();
        if faceted {
            let place = |i: u32| first[i as usize];
            self.normals = normals::shared(&self.positions, &self.triangles, place);
        }
        let (smooth, seams) = self.move_places(&first, &heights);
        if faceted {
            self.normals = Vec::new();
        } else {
            let side = |i: u32| smooth[i as usize];
            self.normals = normals::shared(&self.positions, &self.triangles, side);
        }
        seams
    }

    /// Moves places as one; for each vertex, the first at its place on its side of a crease.
    fn move_places(&mut self, first: &[u32], heights: &[Option<f64>]) -> (Vec<u32>, Seams) {
        let mut order: Vec<u32> = (0..first.len() as u32).collect();
        order.par_sort_unstable_by_key(|&i| (first[i as usize], i));
        let mut smooth = vec![0; first.len()];
        let mut seams = Seams::default();
        let mut sides: Vec<u32> = Vec::new();
        for place in order.chunk_by(|a, b| first[*a as usize] == first[*b as usize]) {
            sides.clear();
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            let (mut sum, mut count) = (0.0, 0.0);
            let mut along = DVec3::ZERO;
            for &vertex in place {
                let Some(height) = heights[vertex as usize] else {
                    smooth[vertex as usize] = vertex;
                    continue;
                };
                (low, high) = (low.min(height), high.max(height));
                (sum, count) = (sum + height, count + 1.0);
                let normal = self.normals[vertex as usize];
                let alike = |&&side: &&u32| self.normals[side as usize].dot(normal) > CREASE;
                let side = sides.iter().find(alike).copied();
                smooth[vertex as usize] = side.unwrap_or(vertex);
                if side.is_none() {
                    sides.push(vertex);
                    along += normal.as_dvec3();
                }
            }
            if high > low {
                seams.places += 1;
                seams.gap = seams.gap.max(high - low);
            }
            // The mean of equal heights may round.
            let mean = if high > low { sum / count } else { low };
            if let (Some(along), true) = (along.try_normalize(), count > 0.0) {
                for &vertex in place {
                    let position = &mut self.positions[vertex as usize];
                    *position = (position.as_dvec3() + mean * along).as_vec3();
                }
            }
        }
        (smooth, seams)
    }
}

#[cfg(test)]
mod tests {
    use glam::{DMat4, Vec2};

    use super::*;
    use crate::mesh::{self, Report};

    #[test]
    fn a_plane_moved_by_a_constant_is_the_plane_translated() {
        let mut sheet = mesh::rectangle();
        sheet.transform(&DMat4::from_rotation_x(0.3));
        let normal = sheet.normals[0];
        sheet.tessellate(0.1, 1 << 16).unwrap();
        let mut moved = sheet.clone();
        assert_eq!(moved.displace(|_, _| Some(0.25)), Seams::default());
        for (p, q) in sheet.positions.iter().zip(&moved.positions) {
            assert!((*q - *p - 0.25 * normal).length() < 1e-6);
        }
        assert!(moved.normals.iter().all(|n| n.distance(normal) < 1e-6));
        assert_eq!((moved.uvs, moved.triangles), (sheet.uvs, sheet.triangles));
    }

    #[test]
    fn a_sphere_moved_by_a_constant_is_a_larger_sphere_and_closed() {
        for mut ball in [mesh::ball(5), mesh::sphere(256, 128)] {
            ball.displace(|_, _| Some(0.5));
            let report = Report::of(&ball);
            let pi = std::f64::consts::PI;
            assert!((report.area / (4.0 * pi * 2.25) - 1.0).abs() < 2e-3);
            assert!((report.volume.unwrap() / (4.0 / 3.0 * pi * 3.375) - 1.0).abs() < 3e-3);
            for (p, n) in ball.positions.iter().zip(&ball.normals) {
                assert!(n.dot(p.normalize()) > 0.999);
            }
        }
    }

    #[test]
    fn a_ramp_of_heights_gives_normals_of_its_slope() {
        let mut sheet = mesh::rectangle();
        sheet.tessellate(0.05, 1 << 16).unwrap();
        let slope = Vec2::new(0.6, -0.3);
        let seams = sheet.displace(|m, i| Some(f64::from(m.positions[i].truncate().dot(slope))));
        assert_eq!(seams.places, 0);
        let expected = (-slope).extend(1.0).normalize();
        assert!(sheet.normals.iter().all(|n| n.distance(expected) < 1e-5));
        let area = 4.0 * (1.0 + f64::from(slope.length_squared())).sqrt();
        assert!((sheet.area() / area - 1.0).abs() < 1e-6);
    }

    #[test]
    fn seams_stay_whole_and_are_told_and_creases_stay_creases() {
        let mut cube = mesh::cube();
        cube.tessellate(0.25, 1 << 16).unwrap();
        let seams = cube.displace(|m, i| Some(f64::from(0.1 * m.uvs[i].x)));
        let report = Report::of(&cube);
        assert!(report.closed && report.components == 1);
        assert!(seams.places > 20 && (0.09..0.11).contains(&seams.gap));
        let mut cube = mesh::cube();
        cube.tessellate(0.25, 1 << 16).unwrap();
        let before = cube.normals.clone();
        assert_eq!(cube.displace(|_, _| Some(0.01)), Seams::default());
        assert!(Report::of(&cube).closed);
        // The faces lean where edges moved along the mean of two normals, and are not rounded off.
        assert!(
            cube.normals
                .iter()
                .zip(&before)
                .all(|(n, b)| n.dot(*b) > 0.95)
        );
        cube.drop_normals();
        cube.displace(|_, _| Some(0.01));
        assert!(cube.normals.is_empty() && Report::of(&cube).closed);
    }
}
