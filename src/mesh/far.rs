//! Meshes whose coordinates are far from the origin, such as those of maps (UTM) and of the whole earth (ECEF): single
//! precision keeps them only to coarse steps. A bare mesh is read once more with an origin of its own subtracted in
//! double precision; in a scene, where things have their places, it is worth a warning.

use glam::{DVec3, Vec3};

use super::Mesh;

/// How many times a mesh's size its coordinates are, on an axis, where it counts as far away: six of 24 bits are lost.
const FAR: f64 = 64.0;
/// What part of a triangle's size the step is in a scene that is warned of.
const COARSE: f64 = 1.0 / 256.0;

/// Where a mesh that is far from the origin is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Far {
    /// A round place in it, on the axes on which it is far away; 0 on the others.
    pub(super) origin: DVec3,
    /// Between a coordinate and the next in single precision, at most.
    pub(super) step: f64,
}

impl Far {
    /// `None` where the mesh is no farther from the origin than it may be.
    pub(super) fn of(mesh: &Mesh) -> Option<Self> {
        if !may_be_far(mesh) {
            return None;
        }
        Self::of_bounds(mesh.bounds()?)
    }

    /// The same, of several meshes with these bounds together.
    pub(super) fn of_bounds((low, high): (Vec3, Vec3)) -> Option<Self> {
        let (low, high) = (low.as_dvec3(), high.as_dvec3());
        let size = (high - low).max_element();
        if size == 0.0 {
            return None;
        }
        // What is subtracted is read by people.
        let unit = 10_f64.powf(size.log10().floor());
        let origin = (0.5 * (low + high)).map(|middle| match middle.abs() > FAR * size {
            true => (middle / unit).round() * unit,
            false => 0.0,
        });
        let farthest = low.abs().max(high.abs()).max_element() as f32;
        let step = f64::from(farthest.next_up()) - f64::from(farthest);
        (origin != DVec3::ZERO).then_some(Self { origin, step })
    }

    /// That a mesh has been moved, in words.
    pub(super) fn moved(&self) -> String {
        let DVec3 { x, y, z } = self.origin;
        let step = self.step;
        format!(
            "({x}, {y}, {z}) is subtracted from its coordinates, of which single precision keeps only steps of {step}"
        )
    }

    /// That a mesh may look coarse, in words.
    pub(super) fn coarse(&self) -> String {
        let DVec3 { x, y, z } = self.origin;
        let step = self.step;
        format!(
            "its coordinates are far from the origin, and single precision keeps them only in steps of {step}: \
             subtract ({x}, {y}, {z}) from those in the file"
        )
    }

    /// Whether the step is large beside a triangle of the mesh.
    pub(super) fn is_coarse(&self, mesh: &Mesh) -> bool {
        let typical = 2.0 * mesh.area() / mesh.triangles.len() as f64;
        self.step > COARSE * typical.sqrt()
    }
}

/// Whether some of the triangles leave it open that the mesh is far away: few are, and to find the bounds takes time.
fn may_be_far(mesh: &Mesh) -> bool {
    const LOOKED_AT: usize = 16;
    let step = mesh.triangles.len().div_ceil(LOOKED_AT).max(1);
    let mut corners = mesh
        .triangles
        .iter()
        .step_by(step)
        .flat_map(|t| mesh.corners(t));
    let Some(first) = corners.next() else {
        return false;
    };
    let (low, high): (Vec3, Vec3) =
        corners.fold((first, first), |(low, high), p| (low.min(p), high.max(p)));
    let size = f64::from((high - low).max_element());
    // The whole may reach farther than these do, by its own size.
    f64::from(low.abs().max(high.abs()).max_element()) > (FAR - 1.0) * size
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{cube, sphere};

    #[test]
    fn a_mesh_is_far_away_where_few_bits_are_left_for_it() {
        let moved = |by: Vec3| {
            let mut mesh = sphere(20, 10);
            mesh.positions.iter_mut().for_each(|p| *p += by);
            Far::of(&mesh)
        };
        for near in [Vec3::ZERO, 100.0 * Vec3::X, Vec3::splat(-120.0)] {
            assert_eq!(moved(near), None, "{near}");
        }
        let far = moved(Vec3::new(412_352.0, -5_543_218.0, 100.0)).unwrap();
        assert_eq!(far.origin, DVec3::new(412_352.0, -5_543_218.0, 0.0));
        assert_eq!(far.step, 0.5);
        assert!(far.is_coarse(&cube()));
        let mut point = cube();
        point.positions.fill(Vec3::splat(1e6));
        assert_eq!(Far::of(&point), None);
        assert_eq!(Far::of(&Mesh::default()), None);
    }
}
