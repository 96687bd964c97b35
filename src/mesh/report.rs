//! What is to be known of a mesh: its size, and what is wrong with it as a surface. Vertices at one place count as one
//! (see [`weld`](super::weld)), for a seam of normals or texture coordinates is no hole. Edges are sorted, not hashed,
//! and some at a time: those whose lower vertex lies in one range after those of another, so that the memory taken does not
//! grow with the mesh.

use rayon::prelude::*;
use serde::Serialize;

use super::{GRAIN, Mesh, weld};

/// What [`Report::of`] found.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Report {
    /// Vertices as they stand in the arrays.
    pub vertices: usize,
    /// Different places of vertices that triangles have.
    pub places: usize,
    /// Triangles, of whatever shape.
    pub triangles: usize,
    /// Edges between places, each counted once.
    pub edges: usize,
    /// The low and the high corner of the box around all triangles.
    pub bounds: Option<[[f32; 3]; 2]>,
    /// In square units.
    pub area: f64,
    /// Whether every edge has as many triangles that run along it as against it: no hole, and an outside.
    pub closed: bool,
    /// In cubic units, negative where the outside is in; of a closed mesh.
    pub volume: Option<f64>,
    /// Sets of triangles that hang together by vertices.
    pub components: usize,
    /// Places − edges + triangles, without degenerate ones: 2 for a sphere, 0 for a torus, added over components.
    pub euler_characteristic: i64,
    /// Triangles without an area.
    pub degenerate_triangles: usize,
    /// Triangles whose three places another has, whatever its winding; the first of them is not counted.
    pub duplicate_triangles: usize,
    /// Edges of one triangle.
    pub boundary_edges: usize,
    /// Edges of more than two triangles.
    pub non_manifold_edges: usize,
    /// Edges of two triangles that disagree on which side is out.
    pub inconsistent_edges: usize,
    /// Vertices that no triangle has.
    pub unreferenced_vertices: usize,
    /// Vertices with a coordinate that is not finite.
    pub non_finite_vertices: usize,
}

/// What the triangles with a lower vertex in some range come to.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    edges: usize,
    boundary: usize,
    non_manifold: usize,
    inconsistent: usize,
    /// Edges with more triangles along than against them, or fewer.
    open: usize,
    /// Triangles of three different places, and how many of them are there already.
    proper: usize,
    duplicates: usize,
}

impl Report {
    /// Examines a mesh.
    pub fn of(mesh: &Mesh) -> Self {
        let places = weld::first_at_place(&mesh.positions);
        let mut used = vec![false; mesh.positions.len()];
        for &vertex in mesh.triangles.iter().flatten() {
            used[vertex as usize] = true;
        }
        let unreferenced = used.iter().filter(|used| !**used).count();
        let mut components = Components::new(mesh.positions.len());
        for [a, b, c] in &mesh.triangles {
            let [a, b, c] = [a, b, c].map(|&i| places[i as usize]);
            components.join(a, b);
            components.join(a, c);
        }
        // A place is used where any of its vertices is.
        for i in 0..places.len() {
            let first = places[i] as usize;
            used[first] |= used[i];
        }
        let firsts = (0..places.len()).filter(|&i| places[i] as usize == i && used[i]);
        let (place_count, component_count) = firsts.fold((0, 0), |(n, roots), i| {
            (n + 1, roots + usize::from(components.is_root(i as u32)))
        });
        drop((used, components));
        let counts = count(&mesh.triangles, &places);
        let closed = counts.open == 0 && counts.edges > 0;
        Self {
            vertices: mesh.positions.len(),
            places: place_count,
            triangles: mesh.triangles.len(),
            edges: counts.edges,
            bounds: (mesh.bounds()).map(|(low, high)| [low.to_array(), high.to_array()]),
            area: mesh.area(),
            closed,
            volume: closed.then(|| mesh.signed_volume()),
            components: component_count,
            euler_characteristic: place_count as i64 - counts.edges as i64 + counts.proper as i64,
            degenerate_triangles: mesh.degenerate_triangles(),
            duplicate_triangles: counts.duplicates,
            boundary_edges: counts.boundary,
            non_manifold_edges: counts.non_manifold,
            inconsistent_edges: counts.inconsistent,
            unreferenced_vertices: unreferenced,
            non_finite_vertices: mesh.positions.iter().filter(|p| !p.is_finite()).count(),
        }
    }
}

impl Mesh {
    /// The volume inside, in cubic units, of a closed surface that looks outwards; of another, the sum of the signed
    /// volumes between its triangles and the middle of its box.
    pub fn signed_volume(&self) -> f64 {
        let Some((low, high)) = self.bounds() else {
            return 0.0;
        };
        let middle = 0.5 * (low.as_dvec3() + high.as_dvec3());
        let partial: Vec<f64> = (self.triangles.par_chunks(GRAIN))
            .map(|triangles| {
                let six = triangles.iter().map(|t| {
                    let [a, b, c] = self.corners(t).map(|p| p.as_dvec3() - middle);
                    a.dot(b.cross(c))
                });
                six.sum::<f64>() / 6.0
            })
            .collect();
        // Added in order, so that the sum is the same whatever the threads.
        partial.iter().sum()
    }

    fn degenerate_triangles(&self) -> usize {
        let flat = |t: &&[u32; 3]| {
            let [a, b, c] = self.corners(t).map(glam::Vec3::as_dvec3);
            (b - a).cross(c - a).length_squared() == 0.0
        };
        let triangles = self.triangles.par_iter().with_min_len(GRAIN);
        triangles.filter(flat).count()
    }
}

/// Counts edges and equal triangles, between places.
fn count(triangles: &[[u32; 3]], places: &[u32]) -> Counts {
    /// Edges that are sorted at a time.
    const SLAB: usize = 1 << 23;
    // Two slabs at least where half of an edge would not fit into 31 bits.
    let slabs = (3 * triangles.len())
        .div_ceil(SLAB)
        .max(places.len() >> 30)
        .max(1);
    let width = places.len().div_ceil(slabs).max(1) as u32;
    (0..slabs as u32)
        .into_par_iter()
        .map(|slab| {
            count_slab(
                triangles,
                places,
                slab * width..(slab + 1).saturating_mul(width),
            )
        })
        .reduce(Counts::default, Counts::plus)
}

/// Counts what has its lower vertex in `range`.
fn count_slab(triangles: &[[u32; 3]], places: &[u32], range: std::ops::Range<u32>) -> Counts {
    let mut counts = Counts::default();
    // The lower place from the range's begin, the higher one, and whether the triangle runs from that to the lower.
    let mut edges: Vec<u64> = Vec::new();
    let mut sorted: Vec<[u32; 3]> = Vec::new();
    for triangle in triangles {
        let corners = triangle.map(|i| places[i as usize]);
        let [a, b, c] = corners;
        if a == b || b == c || c == a {
            continue;
        }
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let low = from.min(to);
            if range.contains(&low) {
                let pair = u64::from(low - range.start) << 32 | u64::from(from.max(to));
                edges.push(pair << 1 | u64::from(from > to));
            }
        }
        if range.contains(&a.min(b).min(c)) {
            let mut corners = corners;
            corners.sort_unstable();
            sorted.push(corners);
        }
    }
    edges.par_sort_unstable();
    for edge in edges.chunk_by(|a, b| a >> 1 == b >> 1) {
        let against = edge.iter().filter(|e| **e & 1 == 1).count();
        let balanced = 2 * against == edge.len();
        counts.edges += 1;
        counts.open += usize::from(!balanced);
        match edge.len() {
            1 => counts.boundary += 1,
            2 => counts.inconsistent += usize::from(!balanced),
            _ => counts.non_manifold += 1,
        }
    }
    drop(edges);
    sorted.par_sort_unstable();
    counts.proper = sorted.len();
    counts.duplicates = sorted.windows(2).filter(|w| w[0] == w[1]).count();
    counts
}

impl Counts {
    fn plus(self, other: Self) -> Self {
        Self {
            edges: self.edges + other.edges,
            boundary: self.boundary + other.boundary,
            non_manifold: self.non_manifold + other.non_manifold,
            inconsistent: self.inconsistent + other.inconsistent,
            open: self.open + other.open,
            proper: self.proper + other.proper,
            duplicates: self.duplicates + other.duplicates,
        }
    }
}

/// Disjoint sets of vertices (Tarjan and van Leeuwen, *Worst-case analysis of set union algorithms*, 1984): paths are
/// halved, and the lower root stays.
struct Components(Vec<u32>);

impl Components {
    fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    fn root(&mut self, mut i: u32) -> u32 {
        while self.0[i as usize] != i {
            let above = self.0[self.0[i as usize] as usize];
            self.0[i as usize] = above;
            i = above;
        }
        i
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }

    fn is_root(&self, i: u32) -> bool {
        self.0[i as usize] == i
    }
}

#[cfg(test)]
mod tests {
    use glam::{DMat4, DVec3, Vec3};

    use super::*;
    use crate::mesh;

    #[test]
    fn a_cube_is_closed_whatever_its_seams_and_its_measures_are_known() {
        let mut cube = mesh::cube();
        cube.transform(&DMat4::from_translation(DVec3::new(1e3, 0.0, -7.0)));
        let report = Report::of(&cube);
        let expected = Report {
            vertices: 24,
            places: 8,
            triangles: 12,
            edges: 18,
            bounds: Some([[999.0, -1.0, -8.0], [1001.0, 1.0, -6.0]]),
            area: 24.0,
            closed: true,
            volume: Some(8.0),
            components: 1,
            euler_characteristic: 2,
            ..Report::default()
        };
        assert_eq!(report, expected);
        cube.flip_normals();
        assert_eq!(Report::of(&cube).volume, Some(-8.0));
    }

    #[test]
    fn what_is_wrong_with_a_mesh_is_counted() {
        let mut mesh = mesh::cube();
        mesh.triangles[3].swap(0, 1);
        let report = Report::of(&mesh);
        assert_eq!(
            (report.inconsistent_edges, report.closed, report.volume),
            (3, false, None)
        );
        mesh.triangles.pop();
        assert_eq!(Report::of(&mesh).boundary_edges, 3);
        // A fin on an edge, a triangle twice, two without an area, a lone vertex and one nowhere.
        let mut mesh = mesh::cube();
        mesh.normals.clear();
        mesh.uvs.clear();
        let first = mesh.positions.len() as u32;
        let [a, b, _] = mesh.triangles[0];
        mesh.positions
            .extend([Vec3::splat(9.0), Vec3::ZERO, Vec3::NAN]);
        let [c, d, e] = mesh.triangles[2];
        mesh.triangles
            .extend([[a, b, first], [d, c, e], [a, a, b], [first, first, first]]);
        let report = Report::of(&mesh);
        assert_eq!(report.non_manifold_edges, 1 + 3);
        assert_eq!(report.boundary_edges, 2);
        assert_eq!(report.duplicate_triangles, 1);
        assert_eq!(report.degenerate_triangles, 2);
        assert_eq!(
            (report.unreferenced_vertices, report.non_finite_vertices),
            (2, 1)
        );
        assert_eq!((report.places, report.components), (9, 1));
        assert!(!report.closed);
    }

    #[test]
    fn an_empty_mesh_and_a_sheet_are_not_closed() {
        assert_eq!(Report::of(&Mesh::default()), Report::default());
        let sheet = Report::of(&mesh::grid(10, 7, |x, y| x * y));
        assert_eq!((sheet.boundary_edges, sheet.closed), (34, false));
        assert_eq!((sheet.euler_characteristic, sheet.components), (1, 1));
    }

    #[test]
    fn slabs_count_what_one_slab_counts() {
        let mesh = mesh::bumpy_sphere(3, 1);
        let places = weld::first_at_place(&mesh.positions);
        let n = places.len() as u32;
        let parts =
            [0..1, 1..100, 100..101, 101..n].map(|r| count_slab(&mesh.triangles, &places, r));
        let whole = count(&mesh.triangles, &places);
        let sum = parts.into_iter().fold(Counts::default(), Counts::plus);
        assert_eq!(format!("{sum:?}"), format!("{whole:?}"));
        assert_eq!((whole.edges, whole.open), (30 * 64, 0));
    }
}
