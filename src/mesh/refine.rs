//! Finer triangles of the same surface. A pass halves edges: those that are too long, or all; a triangle of which one,
//! two or three edges are halved becomes two, three or four. Whether an edge is halved, and where its middle lies, depends
//! on the places of its ends alone, so that no crack opens, along seams of normals and texture coordinates neither.
//! Middles have the mean of what their ends have, and the unit mean of their normals.

use glam::Vec3;
use rayon::prelude::*;

use super::{Attribute, GRAIN, Mesh, Per, unit_or};

/// How many triangles there would be, more than were allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooMany(pub usize);

impl Mesh {
    /// Cuts each triangle in four, `times` times.
    ///
    /// # Errors
    /// Where more than `most` triangles would come of it; the mesh is as it was.
    pub fn subdivide(&mut self, times: u32, most: usize) -> Result<(), TooMany> {
        let count = self.triangles.len();
        let after = 4_usize
            .checked_pow(times)
            .and_then(|n| n.checked_mul(count));
        match after {
            Some(after) if after <= most => {}
            _ => return Err(TooMany(after.unwrap_or(usize::MAX))),
        }
        for _ in 0..times {
            halve(self, |_, _| true, most)?;
        }
        Ok(())
    }

    /// Cuts triangles until no edge is longer than `longest`.
    ///
    /// # Errors
    /// Where more than `most` triangles would come of a pass; those before it were made.
    pub fn tessellate(&mut self, longest: f32, most: usize) -> Result<(), TooMany> {
        let limit = f64::from(longest) * f64::from(longest);
        let is_long = |a: Vec3, b: Vec3| a.as_dvec3().distance_squared(b.as_dvec3()) > limit;
        while halve(self, is_long, most)? {}
        Ok(())
    }
}

/// Halves the edges that are `long`; whether there were any.
fn halve(
    mesh: &mut Mesh,
    is_long: impl Fn(Vec3, Vec3) -> bool + Sync,
    most: usize,
) -> Result<bool, TooMany> {
    let Mesh {
        positions,
        triangles,
        ..
    } = &*mesh;
    let sides = |&[a, b, c]: &[u32; 3]| [[a, b], [b, c], [c, a]];
    let long = |[a, b]: [u32; 2]| is_long(positions[a as usize], positions[b as usize]);
    let count = |t: &[u32; 3]| sides(t).into_iter().filter(|side| long(*side)).count();
    let added: Vec<usize> = (triangles.par_chunks(GRAIN))
        .map(|some| some.iter().map(count).sum())
        .collect();
    let after = triangles.len() + added.iter().sum::<usize>();
    if after == triangles.len() {
        return Ok(false);
    }
    if after > most {
        return Err(TooMany(after));
    }
    let mut cuts: Vec<u64> = (triangles.par_chunks(GRAIN))
        .flat_map_iter(|some| some.iter().flat_map(sides).filter(|s| long(*s)).map(key))
        .collect();
    cuts.par_sort_unstable();
    cuts.dedup();
    let first = u32::try_from(positions.len());
    let last = u32::try_from(positions.len() + cuts.len());
    let (Ok(first), Ok(_)) = (first, last) else {
        return Err(TooMany(after));
    };
    let middle = |side: [u32; 2]| {
        let place = long(side).then(|| cuts.binary_search(&key(side)));
        place.map(|at| first + at.expect("all long edges were gathered") as u32)
    };
    let mut finer = vec![[0; 3]; after];
    let mut rest = &mut finer[..];
    let mut jobs = Vec::with_capacity(added.len());
    for (some, added) in triangles.chunks(GRAIN).zip(&added) {
        let (mine, others) = rest.split_at_mut(some.len() + added);
        jobs.push((some, mine));
        rest = others;
    }
    jobs.into_par_iter().for_each(|(some, mut out)| {
        for triangle in some {
            let middles = sides(triangle).map(middle);
            let (pieces, count) = pieces(triangle, middles, positions);
            let (mine, others) = out.split_at_mut(count);
            mine.copy_from_slice(&pieces[..count]);
            out = others;
        }
    });
    let counts = |t: &[u32; 3]| 1 + count(t);
    let faces = mesh.attributes.iter().filter(|a| a.per == Per::Face);
    let faces: Vec<Vec<f32>> = faces.map(|a| repeated(a, triangles, counts)).collect();
    let mut faces = faces.into_iter();
    let ends: Vec<[usize; 2]> = (cuts.par_iter())
        .map(|key| [(key >> 32) as usize, *key as u32 as usize])
        .collect();
    drop(cuts);
    mesh.triangles = finer;
    extend(&mut mesh.positions, &ends, |a, b| 0.5 * a + 0.5 * b);
    extend(&mut mesh.uvs, &ends, |a, b| 0.5 * a + 0.5 * b);
    extend(&mut mesh.normals, &ends, |a, b| {
        unit_or(a.as_dvec3() + b.as_dvec3(), a)
    });
    for attribute in &mut mesh.attributes {
        if attribute.per == Per::Face {
            attribute.values = faces.next().expect("one was made for each");
            continue;
        }
        for [a, b] in &ends {
            for i in 0..attribute.channels {
                let at = |vertex: usize| attribute.values[vertex * attribute.channels + i];
                let mean = 0.5 * at(*a) + 0.5 * at(*b);
                attribute.values.push(mean);
            }
        }
    }
    Ok(true)
}

/// The same for both directions.
fn key([a, b]: [u32; 2]) -> u64 {
    u64::from(a.min(b)) << 32 | u64::from(a.max(b))
}

/// Adds the `mean` of each two ends, of what the mesh has.
fn extend<T: Copy + Send + Sync>(
    values: &mut Vec<T>,
    ends: &[[usize; 2]],
    mean: impl Fn(T, T) -> T + Sync,
) {
    if !values.is_empty() {
        let mut new = Vec::new();
        ends.par_iter()
            .map(|[a, b]| mean(values[*a], values[*b]))
            .collect_into_vec(&mut new);
        values.append(&mut new);
    }
}

/// A face attribute's rows, each as often as its triangle has pieces.
fn repeated(
    attribute: &Attribute,
    triangles: &[[u32; 3]],
    count: impl Fn(&[u32; 3]) -> usize,
) -> Vec<f32> {
    let rows = triangles.iter().enumerate();
    rows.flat_map(|(i, t)| std::iter::repeat_n(attribute.row(i), count(t)).flatten())
        .copied()
        .collect()
}

/// The pieces of a triangle whose sides have these middles, and how many they are.
fn pieces(
    triangle: &[u32; 3],
    middles: [Option<u32>; 3],
    positions: &[Vec3],
) -> ([[u32; 3]; 4], usize) {
    // Turned so that the halved sides come first.
    let start = match middles.map(|m| m.is_some()) {
        [false, true, _] => 1,
        [_, false, true] => 2,
        _ => 0,
    };
    let [a, b, c] = [0, 1, 2].map(|i| triangle[(start + i) % 3]);
    match [0, 1, 2].map(|i| middles[(start + i) % 3]) {
        [Some(ab), Some(bc), Some(ca)] => {
            ([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]], 4)
        }
        [Some(ab), Some(bc), None] => {
            // What is left is cut along its shorter diagonal.
            let [p, q, r] = [a, b, c].map(|i| positions[i as usize].as_dvec3());
            let from_a = p.distance_squared(0.5 * (q + r));
            let from_c = r.distance_squared(0.5 * (p + q));
            let [second, third] = if from_a <= from_c {
                [[a, ab, bc], [a, bc, c]]
            } else {
                [[a, ab, c], [ab, bc, c]]
            };
            ([[b, bc, ab], second, third, [0; 3]], 3)
        }
        [Some(ab), None, None] => ([[a, ab, c], [ab, b, c], [0; 3], [0; 3]], 2),
        _ => ([[a, b, c], [0; 3], [0; 3], [0; 3]], 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{self, Report};

    /// With an attribute a vertex, x + 2y, and one a face, its number.
    fn with_attributes(mut mesh: Mesh) -> Mesh {
        let values = mesh.positions.iter().map(|p| p.x + 2.0 * p.y).collect();
        let numbers = (0..mesh.triangles.len()).map(|i| i as f32).collect();
        for (name, per, values) in [
            ("vertex_x", Per::Vertex, values),
            ("face_n", Per::Face, numbers),
        ] {
            let name = name.to_owned();
            mesh.attributes.push(Attribute {
                name,
                channels: 1,
                per,
                values,
            });
        }
        mesh
    }

    #[test]
    fn finer_meshes_are_the_same_surface_with_the_same_colours() {
        for base in [
            mesh::cube(),
            mesh::rectangle(),
            mesh::bumpy_sphere(1, 3),
            mesh::grid(3, 2, |x, y| x - y),
        ] {
            let base = with_attributes(base);
            let before = Report::of(&base);
            for edge in [0.5, 0.21, 0.07] {
                let mut fine = base.clone();
                fine.tessellate(edge, 1 << 20).unwrap();
                let longest = fine.triangles.iter().flat_map(|t| {
                    let [a, b, c] = fine.corners(t);
                    [a.distance(b), b.distance(c), c.distance(a)]
                });
                assert!(longest.fold(0.0, f32::max) <= edge * 1.000_001);
                let after = Report::of(&fine);
                assert!((after.area / before.area - 1.0).abs() < 1e-6);
                assert_eq!(
                    (after.closed, after.components),
                    (before.closed, before.components)
                );
                assert_eq!(after.euler_characteristic, before.euler_characteristic);
                assert_eq!(
                    (after.degenerate_triangles, after.unreferenced_vertices),
                    (0, 0)
                );
                assert_eq!(after.bounds, before.bounds);
                let [vertex, face] = &fine.attributes[..] else {
                    panic!()
                };
                for (p, x) in fine.positions.iter().zip(&vertex.values) {
                    assert!((x - p.x - 2.0 * p.y).abs() < 1e-5);
                }
                // Each piece lies in the triangle whose number it has.
                assert_eq!(face.values.len(), fine.triangles.len());
                for (t, number) in fine.triangles.iter().zip(&face.values) {
                    let parent = base.corners(&base.triangles[*number as usize]);
                    let [a, b, c] = fine.corners(t);
                    let normal = |a: Vec3, b: Vec3, c: Vec3| (b - a).cross(c - a).normalize();
                    let n = normal(parent[0], parent[1], parent[2]);
                    assert!(n.dot(normal(a, b, c)) > 0.999);
                    for i in 0..3 {
                        let [from, to] = [parent[i], parent[(i + 1) % 3]];
                        let inside = (to - from).cross((a + b + c) / 3.0 - from).dot(n);
                        assert!(inside > 0.0, "{inside}");
                    }
                }
            }
        }
    }

    #[test]
    fn subdividing_makes_four_of_each_and_shares_what_was_shared() {
        let mut mesh = mesh::bumpy_sphere(0, 1);
        mesh.subdivide(3, 1 << 20).unwrap();
        assert_eq!(
            (mesh.triangles.len(), mesh.positions.len()),
            (20 * 64, 10 * 64 + 2)
        );
        assert_eq!(mesh.subdivide(40, 1 << 20), Err(TooMany(usize::MAX)));
        assert_eq!(
            mesh.subdivide(3, 20 * 64 * 64 - 1),
            Err(TooMany(20 * 64 * 64))
        );
    }

    #[test]
    fn what_would_never_end_is_refused() {
        for edge in [0.0, 1e-30, f32::NAN] {
            let refused = mesh::rectangle().tessellate(edge, 10_000);
            assert_eq!(refused.is_err(), edge >= 0.0, "{edge}");
        }
        let mut tiny = mesh::rectangle();
        tiny.transform(&glam::DMat4::from_translation(glam::DVec3::splat(1e7)));
        assert!(tiny.tessellate(0.01, 10_000).is_err());
    }

    #[test]
    fn the_threads_leave_no_trace() {
        let fine = |threads| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            let mut mesh = with_attributes(mesh::bumpy_sphere(4, 3));
            pool.install(|| mesh.tessellate(0.02, 1 << 20)).unwrap();
            mesh
        };
        assert_eq!(fine(1), fine(3));
    }
}
