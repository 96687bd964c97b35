//! Faces of more than three corners. Readers make each a fan of triangles around its first corner, as Mitsuba does,
//! and note where it stands. A fan covers a polygon rightly where none of its triangles is turned against the
//! polygon's vector area (Sutherland, Sproull and Schumacker 1974), which is always so where it is convex. Where it is not
//! so, a bare mesh has the fan replaced: `earcut` clips the ears of the polygon in the plane of its area.

use earcut::Earcut;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::Mesh;

/// What part of the whole may be turned over and is rounding: points of a straight edge are seldom quite on it.
const ROUNDING: f64 = 1e-5;
/// The most corners of a polygon that is not left a fan: ears of one that coils take the square of their number.
const MOST_CORNERS: usize = 1 << 16;

/// The fans among a mesh's triangles.
#[derive(Debug, Default)]
pub(super) struct Polygons {
    /// Of two triangles or more, in order.
    fans: Vec<Fan>,
    /// Whether those that do not cover their polygons are replaced.
    bare: bool,
}

/// Consecutive triangles `[a, b, c]`, `[a, c, d]` and so on.
#[derive(Clone, Copy, Debug)]
struct Fan {
    /// The first of them.
    first: usize,
    /// How many there are.
    count: usize,
}

/// What [`Polygons::mend`] found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Concave {
    /// Polygons that a fan does not cover.
    found: usize,
    /// Those that are fans still.
    left: usize,
}

impl Polygons {
    /// Bytes that a polygon takes.
    pub(super) const ROW: usize = size_of::<Fan>();

    pub(super) fn new(bare: bool) -> Self {
        let fans = Vec::new();
        Self { fans, bare }
    }

    /// Does what is to be done about concave polygons; what is left to say of them is returned, in words.
    pub(super) fn settle(&self, mesh: &mut Mesh) -> Option<String> {
        if self.bare {
            let left = self.mend(mesh).left;
            return (left > 0).then(|| {
                format!("{left} polygons cross themselves: they are fans of triangles around their first corners")
            });
        }
        let count = self.count_concave(mesh);
        (count > 0).then(|| {
            format!(
                "{count} concave polygons are not covered rightly: as in Mitsuba they are fans of triangles around \
                 their first corners; store triangles"
            )
        })
    }

    /// Notes a polygon of so many corners whose triangles begin with `first`.
    pub(super) fn push(&mut self, first: usize, corners: usize) {
        if let count @ 2.. = corners.saturating_sub(2) {
            self.fans.push(Fan { first, count });
        }
    }

    /// How many polygons their fans do not cover.
    fn count_concave(&self, mesh: &Mesh) -> usize {
        let fans = self.fans.par_iter().with_min_len(1 << 10);
        fans.filter(|fan| fan.leaves(mesh)).count()
    }

    /// Covers each polygon with triangles that do not leave it. Where that takes fewer, as with corners on a straight
    /// edge, the mesh has fewer afterwards, and face attributes keep step.
    fn mend(&self, mesh: &mut Mesh) -> Concave {
        let fans = self.fans.par_iter().with_min_len(1 << 10);
        let wrong: Vec<Fan> = fans.copied().filter(|fan| fan.leaves(mesh)).collect();
        let covers = wrong.par_iter().map(|fan| fan.cover(mesh));
        let covers: Vec<Option<Vec<[u32; 3]>>> = covers.collect();
        let (mut left, mut needless) = (0, Vec::new());
        for (Fan { first, count }, cover) in wrong.iter().copied().zip(covers) {
            let Some(cover) = cover else {
                left += 1;
                continue;
            };
            mesh.triangles[first..first + cover.len()].copy_from_slice(&cover);
            needless.extend(first + cover.len()..first + count);
        }
        if !needless.is_empty() {
            let mut keep = vec![true; mesh.triangles.len()];
            needless.into_iter().for_each(|i| keep[i] = false);
            mesh.keep_triangles(&keep);
        }
        let found = wrong.len();
        Concave { found, left }
    }
}

impl Fan {
    /// Whether one of the triangles is turned against the whole.
    fn leaves(&self, mesh: &Mesh) -> bool {
        let fan = &mesh.triangles[self.first..self.first + self.count];
        let areas = || {
            fan.iter().map(|t| {
                let [a, b, c] = mesh.corners(t).map(glam::Vec3::as_dvec3);
                (b - a).cross(c - a)
            })
        };
        let whole: DVec3 = areas().sum();
        let spans = fan.iter().map(|t| {
            let [a, b, c] = mesh.corners(t);
            a.distance_squared(b).max(a.distance_squared(c))
        });
        let span = f64::from(spans.fold(0.0, f32::max));
        if whole.length() <= ROUNDING * span {
            return false; // its corners are on a line
        }
        let turned = -ROUNDING * whole.length_squared();
        areas().any(|area| area.dot(whole) < turned)
    }

    /// As many triangles at most that cover the polygon, seen along its area; `None` where it crosses itself.
    fn cover(&self, mesh: &Mesh) -> Option<Vec<[u32; 3]>> {
        if self.count + 2 > MOST_CORNERS {
            return None;
        }
        let fan = &mesh.triangles[self.first..self.first + self.count];
        let corners: Vec<u32> = [fan[0][0], fan[0][1]]
            .into_iter()
            .chain(fan.iter().map(|t| t[2]))
            .collect();
        let place = |i: u32| mesh.positions[i as usize].as_dvec3();
        let first = place(corners[0]);
        let area: DVec3 = fan
            .iter()
            .map(|t| (place(t[1]) - first).cross(place(t[2]) - first))
            .sum();
        let (along, up) = area.try_normalize()?.any_orthonormal_pair();
        let flat: Vec<DVec2> = corners
            .iter()
            .map(|&i| place(i) - first)
            .map(|p| DVec2::new(p.dot(along), p.dot(up)))
            .collect();
        let cover = triangulate(&flat).filter(|cover| cover.len() <= self.count)?;
        Some(
            cover
                .iter()
                .map(|t| t.map(|i| corners[i as usize]))
                .collect(),
        )
    }
}

/// Triangles that cover the polygon with these corners, all turned as it is; `None` where they would not, because it
/// crosses itself or rounding leaves a gap. Holes may be cut in by edges that it runs along twice.
pub(crate) fn triangulate(corners: &[DVec2]) -> Option<Vec<[u32; 3]>> {
    let mut indices: Vec<u32> = Vec::new();
    Earcut::new().earcut(corners.iter().map(|p| p.to_array()), &[], &mut indices);
    let doubled = |[a, b, c]: [u32; 3]| {
        let [a, b, c] = [a, b, c].map(|i| corners[i as usize]);
        (b - a).perp_dot(c - a)
    };
    let whole: f64 = (0..corners.len())
        .map(|i| corners[i].perp_dot(corners[(i + 1) % corners.len()]))
        .sum();
    let triangles: Vec<[u32; 3]> = (indices.chunks_exact(3))
        .map(|t| [t[0], t[1], t[2]])
        .map(|[a, b, c]| match doubled([a, b, c]) {
            area if area * whole < 0.0 => [a, c, b],
            _ => [a, b, c],
        })
        .collect();
    let covered: f64 = triangles.iter().map(|t| doubled(*t)).sum();
    ((covered - whole).abs() <= 1e-6 * whole.abs()).then_some(triangles)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::mesh::{Attribute, Per};

    /// A comb: its teeth stand up from a bar.
    fn comb(teeth: u32) -> Vec<DVec2> {
        let mut corners = vec![DVec2::new(f64::from(2 * teeth), -1.0)];
        for i in (0..teeth).rev() {
            let x = f64::from(2 * i);
            corners.extend([(x + 2.0, 0.0), (x + 1.5, 5.0), (x + 1.0, 0.1)].map(DVec2::from));
        }
        corners.extend([(0.0, 0.0), (0.0, -1.0)].map(DVec2::from));
        corners
    }

    fn area(corners: &[DVec2]) -> f64 {
        let next = corners.iter().cycle().skip(1);
        let doubled = corners.iter().zip(next).map(|(a, b)| a.perp_dot(*b));
        0.5 * doubled.sum::<f64>()
    }

    #[test]
    fn a_polygon_is_covered_once_however_concave_it_is() {
        for teeth in [3, 10, 300] {
            let mut corners = comb(teeth);
            let triangles = triangulate(&corners).expect("it has an area");
            assert_eq!(triangles.len(), corners.len() - 2);
            corners.reverse();
            let [a, b, c] =
                triangulate(&corners).expect("it has an area")[0].map(|i| corners[i as usize]);
            assert!(
                (b - a).perp_dot(c - a) < 0.0,
                "it is turned as the polygon is"
            );
        }
    }

    /// The polygon as a fan that stands slanted in space, from each of its corners in turn.
    fn fans(corners: &[DVec2]) -> Vec<Mesh> {
        let [along, up] = [Vec3::new(2.0, 1.0, -2.0), Vec3::new(-2.0, 2.0, -1.0)].map(|v| v / 3.0);
        let place = |p: &DVec2| along * p.x as f32 + up * p.y as f32 + Vec3::splat(5.0);
        let count = corners.len() as u32;
        let fan = |first: u32| {
            let corner = |i: u32| (first + i) % count;
            Mesh {
                positions: corners.iter().map(place).collect(),
                triangles: (2..count)
                    .map(|i| [corner(0), corner(i - 1), corner(i)])
                    .collect(),
                attributes: vec![Attribute {
                    name: "face_part".to_owned(),
                    channels: 1,
                    per: Per::Face,
                    values: vec![7.0; corners.len() - 2],
                }],
                ..Mesh::default()
            }
        };
        (0..count).map(fan).collect()
    }

    #[test]
    fn polygons_have_their_area_from_whichever_corner_they_begin() {
        let e = [
            (3, -1),
            (1, -1),
            (1, -2),
            (3, -2),
            (3, -3),
            (0, -3),
            (0, 0),
            (3, 0),
        ];
        // A square with a square hole, which an edge runs to and back from.
        let hole = [
            (0, 0),
            (4, 0),
            (4, 4),
            (0, 4),
            (0, 0),
            (1, 1),
            (1, 2),
            (2, 2),
            (2, 1),
            (1, 1),
        ];
        // Corners along straight edges, and a notch.
        let straight = [
            (0, 0),
            (1, 0),
            (2, 0),
            (3, 0),
            (3, 1),
            (3, 3),
            (2, 3),
            (2, 1),
            (1, 1),
            (1, 3),
            (0, 3),
            (0, 2),
        ];
        let arrow = [(0, 0), (4, 2), (0, 4), (1, 2)];
        let shapes = [&e[..], &hole[..], &straight[..], &arrow[..]];
        let shapes = shapes.map(|shape| {
            shape
                .iter()
                .map(|&(x, y)| DVec2::new(x.into(), y.into()))
                .collect::<Vec<_>>()
        });
        for corners in shapes.into_iter().chain([comb(5)]) {
            let wanted = area(&corners).abs();
            let mut found = 0;
            for mut mesh in fans(&corners) {
                let mut polygons = Polygons::default();
                polygons.push(0, corners.len());
                assert_eq!(
                    polygons.count_concave(&mesh) == 1,
                    (mesh.area() - wanted).abs() > 1e-3
                );
                let concave = polygons.mend(&mut mesh);
                assert_eq!(concave.left, 0);
                found += concave.found;
                assert!(
                    (mesh.area() - wanted).abs() < 1e-4 * wanted,
                    "{} for {wanted}",
                    mesh.area()
                );
                assert_eq!(mesh.attributes[0].values.len(), mesh.triangles.len());
                mesh.check();
            }
            assert!(found > 0);
        }
    }

    #[test]
    fn convex_bent_and_flat_polygons_stay_the_fans_that_they_are() {
        let round: Vec<DVec2> = (0..12)
            .map(|i| DVec2::from_angle(f64::from(i) / 2.0))
            .collect();
        let line: Vec<DVec2> = (0..5).map(|i| DVec2::splat(f64::from(i))).collect();
        for (corners, bend) in [(round, 0.05), (line, 0.0)] {
            for mut mesh in fans(&corners) {
                // As quads of scanned meshes are.
                mesh.positions[1] += bend * Vec3::new(1.0, 2.0, 2.0);
                let before = mesh.clone();
                let mut polygons = Polygons::default();
                polygons.push(0, corners.len());
                assert_eq!(polygons.mend(&mut mesh), Concave::default());
                assert_eq!(mesh, before);
            }
        }
        // One that crosses itself has no triangles that would be right.
        let crossing =
            [(0, 0), (4, 4), (4, 0), (0, 3), (-1, 3)].map(|(x, y)| DVec2::new(x.into(), y.into()));
        let mut mesh = fans(&crossing).swap_remove(0);
        let mut polygons = Polygons::default();
        polygons.push(0, crossing.len());
        polygons.mend(&mut mesh);
        mesh.check();
    }
}
