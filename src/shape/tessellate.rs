//! Surfaces as triangles: meshes are cut until their edges are short enough, surfaces with a chart become a grid of its
//! parameters. Where a chart closes on itself, or a side of its square is a single point, vertices stand at one place to the
//! bit, so that the mesh has no gap there.

use glam::{Vec2, Vec3};

use super::{Chart, Geometry, SurfaceSample};
use crate::mesh::{Mesh, TooMany};

/// Why a surface was not made into triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Untessellated {
    /// It has no end, or no chart that covers all of it.
    NoChart,
    /// There would be too many.
    TooMany,
}

impl From<TooMany> for Untessellated {
    fn from(_: TooMany) -> Self {
        Self::TooMany
    }
}

impl Geometry {
    /// Triangles whose edges are about as long as `longest`, in scene units, at most: those of a mesh exactly. They have the
    /// surface's normals and texture coordinates.
    ///
    /// # Errors
    /// Where it cannot be, or there would be more than `most`.
    pub fn into_triangles(self, longest: f32, most: usize) -> Result<Mesh, Untessellated> {
        match self {
            Self::Mesh(mesh) => {
                let mut mesh = mesh.into_mesh();
                mesh.tessellate(longest, most)?;
                Ok(mesh)
            }
            other => grid(&|at| other.chart(at), longest, most),
        }
    }

    /// One of the primitives of a surface that is no mesh as triangles, as [`Geometry::into_triangles`] makes them; texture
    /// coordinates are the parameters of the [`super::Surface::patch`].
    ///
    /// # Errors
    /// Where it cannot be, or there would be more than `most`.
    pub fn patch_triangles(
        &self,
        primitive: u32,
        longest: f32,
        most: usize,
    ) -> Result<Mesh, Untessellated> {
        grid(&|at| self.patch(primitive, at), longest, most)
    }
}

/// Lines of constant parameters that are measured, and steps along each.
const LINES: u32 = 16;
const STEPS: u32 = 64;

fn grid(
    chart: &dyn Fn(Vec2) -> Option<Chart>,
    longest: f32,
    most: usize,
) -> Result<Mesh, Untessellated> {
    let at = |u: f32, v: f32| chart(Vec2::new(u, v)).map(|chart| chart.point);
    if at(0.5, 0.5).is_none() {
        return Err(Untessellated::NoChart);
    }
    let at = |u: f32, v: f32| at(u, v).expect("a chart covers the whole square");
    // The longest line along u and along v.
    let longest_line = |place: &dyn Fn(f32, f32) -> Vec3| {
        let line = |i: u32| {
            let fixed = i as f32 / LINES as f32;
            let steps =
                (0..STEPS).map(|j| [j, j + 1].map(|j| place(j as f32 / STEPS as f32, fixed)));
            steps.map(|[a, b]| a.distance(b)).sum::<f32>()
        };
        (0..=LINES).map(line).fold(0.0, f32::max)
    };
    let along_u = longest_line(&|along, fixed| at(along, fixed).position);
    let along_v = longest_line(&|along, fixed| at(fixed, along).position);
    // Three cells at least go around something.
    let cells = [along_u, along_v].map(|length| f64::from(length / longest).ceil().max(3.0));
    if 2.0 * cells[0] * cells[1] > most.min(i32::MAX as usize) as f64 {
        return Err(Untessellated::TooMany);
    }
    let [columns, rows] = cells.map(|n| n as u32);
    let sample = |i: u32| {
        let (column, row) = (i % (columns + 1), i / (columns + 1));
        at(column as f32 / columns as f32, row as f32 / rows as f32)
    };
    let samples: Vec<SurfaceSample> = (0..(columns + 1) * (rows + 1)).map(sample).collect();
    let mut mesh = Mesh {
        positions: samples.iter().map(|s| s.position).collect(),
        normals: samples.iter().map(|s| s.normal).collect(),
        uvs: (0..samples.len() as u32)
            .map(|i| {
                let (column, row) = (i % (columns + 1), i / (columns + 1));
                Vec2::new(column as f32 / columns as f32, row as f32 / rows as f32)
            })
            .collect(),
        ..Mesh::default()
    };
    close(
        &mut mesh.positions,
        columns,
        rows,
        1e-4 * along_u.max(along_v),
    );
    for row in 0..rows {
        for column in 0..columns {
            let a = row * (columns + 1) + column;
            let d = a + columns + 1;
            mesh.triangles.extend([[a, a + 1, d + 1], [a, d + 1, d]]);
        }
    }
    // Of a cell at a pole one triangle has two corners at one place.
    let places = &mesh.positions;
    mesh.triangles.retain(|t| {
        let [a, b, c] = t.map(|i| places[i as usize]);
        a != b && b != c && c != a
    });
    // The chart may run either way around.
    let outward = mesh.triangles.iter().map(|t| {
        let [a, b, c] = mesh.corners(t);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        normal.dot(mesh.normals[t[0] as usize])
    });
    if outward.sum::<f32>() < 0.0 {
        for triangle in &mut mesh.triangles {
            triangle.swap(1, 2);
        }
    }
    Ok(mesh)
}

/// Makes one place of what rounding alone tells apart: opposite sides of the square, and all of a side that is a point.
fn close(positions: &mut [Vec3], columns: u32, rows: u32, tolerance: f32) {
    let at = |column: u32, row: u32| (row * (columns + 1) + column) as usize;
    let left: Vec<usize> = (0..=rows).map(|row| at(0, row)).collect();
    let right: Vec<usize> = (0..=rows).map(|row| at(columns, row)).collect();
    let low: Vec<usize> = (0..=columns).map(|column| at(column, 0)).collect();
    let high: Vec<usize> = (0..=columns).map(|column| at(column, rows)).collect();
    let mut join = |from: &[usize], to: &[usize]| {
        let pairs = || from.iter().zip(to);
        if pairs().all(|(&i, &j)| positions[i].distance(positions[j]) < tolerance) {
            pairs().for_each(|(&i, &j)| positions[j] = positions[i]);
        }
    };
    for side in [&left, &right, &low, &high] {
        join(&vec![side[0]; side.len()], side);
    }
    join(&left, &right);
    join(&low, &high);
}
