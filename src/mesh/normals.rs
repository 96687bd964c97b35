//! Vertex normals: at each vertex the unit normals of its faces are added, weighted with the face's angle at
//! that vertex, and the sum is made unit (Thürmer and Wüthrich, "Computing vertex normals from polygonal
//! facets", 1998), as Mitsuba does. With edges e, f from a corner the angle is atan2(|e × f|, e · f), and
//! |e × f| is the same for the three corners. In f64 nothing underflows or overflows: a triangle of no area
//! is left out, and a vertex that has no other gets Mitsuba's (1, 0, 0).

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{GRAIN, unit_or, zeros};

/// The normal of a vertex without a face that has one.
const NOWHERE: Vec3 = Vec3::X;

/// A unit normal a vertex. The sums are taken in the order of the triangles, whatever the threads.
pub(super) fn angle_weighted(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    shared(positions, triangles, |vertex| vertex)
}

/// The same, of vertices that count as one where `first` gives the same vertex, the first of them.
pub(super) fn shared(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    first: impl Fn(u32) -> u32 + Sync,
) -> Vec<Vec3> {
    let mut sums = zeros(positions.len());
    let mut shares: Vec<[Vec3; 3]> = Vec::new();
    let band = sums.len().div_ceil(rayon::current_num_threads()).max(GRAIN);
    // The angles are the work, and are found in parallel for some triangles at a time; the sums follow.
    for triangles in triangles.chunks(16 * GRAIN) {
        shares.resize(triangles.len(), [Vec3::ZERO; 3]);
        let some = triangles
            .par_chunks(LANES)
            .zip(shares.par_chunks_mut(LANES));
        some.with_min_len(GRAIN / LANES)
            .for_each(|(triangles, shares)| {
                let mut corners = [[[0.0; LANES]; 3]; 3];
                for (lane, triangle) in triangles.iter().enumerate() {
                    for (corner, i) in corners.iter_mut().zip(triangle) {
                        let position = positions[*i as usize];
                        (corner[0][lane], corner[1][lane], corner[2][lane]) = position.into();
                    }
                }
                let made = corner_normals(&corners);
                for (lane, shares) in shares.iter_mut().enumerate() {
                    for (share, [x, y, z]) in shares.iter_mut().zip(&made) {
                        *share = Vec3::new(x[lane], y[lane], z[lane]);
                    }
                }
            });
        // Each thread goes through all of them, and adds what belongs to its own vertices.
        sums.par_chunks_mut(band).enumerate().for_each(|(i, sums)| {
            for (triangle, share) in triangles.iter().zip(&shares) {
                for (&vertex, &normal) in triangle.iter().zip(share) {
                    let place = (first(vertex) as usize).wrapping_sub(i * band);
                    if let Some(sum) = sums.get_mut(place) {
                        *sum += normal;
                    }
                }
            }
        });
    }
    sums.par_iter_mut()
        .with_min_len(GRAIN)
        .for_each(|n| *n = unit_or(n.as_dvec3(), NOWHERE));
    for vertex in 0..sums.len() {
        sums[vertex] = sums[first(vertex as u32) as usize];
    }
    sums
}

/// The unit normal of a triangle, (1, 0, 0) where it has none.
pub(super) fn face_normal(corners: [Vec3; 3]) -> Vec3 {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    unit_or((b - a).cross(c - a), NOWHERE)
}

/// Triangles that are looked at side by side: one loop without a branch, of which a step is taken for several at once.
const LANES: usize = 16;
/// A number for each of them, by corner and axis.
type Lanes = [[[f32; LANES]; 3]; 3];

/// What triangles with these corners add to the normals there: nothing where one has no area.
fn corner_normals(corners: &Lanes) -> Lanes {
    let mut shares = [[[0.0; LANES]; 3]; 3];
    for lane in 0..LANES {
        let corner = |i: usize| {
            let [x, y, z] = &corners[i];
            DVec3::new(x[lane].into(), y[lane].into(), z[lane].into())
        };
        let (a, b, c) = (corner(0), corner(1), corner(2));
        let (ab, bc, ca) = (b - a, c - b, a - c);
        let normal = ab.cross(-ca);
        let length = normal.length();
        let at_a = angle(length, -ca.dot(ab));
        let at_b = angle(length, -ab.dot(bc));
        let at_c = (PI - at_a - at_b).max(0.0);
        let has_area = length > 0.0 && length < f64::INFINITY;
        let mut share = |i: usize, angle: f64| {
            let share = (normal * (angle / length)).as_vec3();
            let [x, y, z] = &mut shares[i];
            x[lane] = if has_area { share.x } else { 0.0 };
            y[lane] = if has_area { share.y } else { 0.0 };
            z[lane] = if has_area { share.z } else { 0.0 };
        };
        share(0, at_a);
        share(1, at_b);
        share(2, at_c);
    }
    shares
}

/// atan2(y, x) for y > 0, to 2·10⁻⁸ (Hastings, *Approximations for digital computers*, 1955, sheet 13): five
/// times faster than to the last bit of double precision, of which single precision keeps less.
#[inline(always)]
fn angle(y: f64, x: f64) -> f64 {
    const TERMS: [f64; 8] = [
        0.002_866_225_7,
        -0.016_165_736_7,
        0.042_909_613_8,
        -0.075_289_640_0,
        0.106_562_639_3,
        -0.142_088_994_4,
        0.199_935_508_5,
        -0.333_331_452_8,
    ];
    let steep = x.abs();
    let less = if y < steep { y } else { steep };
    let more = if y < steep { steep } else { y };
    let t = less / more;
    let squared = t * t;
    let [a, b, c, d, e, f, g, h] = TERMS;
    let series = (((a * squared + b) * squared + c) * squared + d) * squared;
    let series = ((((series + e) * squared + f) * squared + g) * squared + h) * squared;
    let near = t + t * series;
    let turned = if y > steep { FRAC_PI_2 - near } else { near };
    if x < 0.0 { PI - turned } else { turned }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_those_of_the_arc_tangent() {
        for i in 1..4000 {
            let exact = f64::from(i) / 4000.0 * PI;
            for radius in [1e-30, 1.0, 1e30] {
                let found = angle(radius * exact.sin(), radius * exact.cos());
                assert!((found - exact).abs() < 3e-8, "{found} for {exact}");
            }
        }
        assert!((angle(1e-300, 1.0) / 1e-300 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_normals_of_a_tetrahedron_are_mitsubas() {
        let positions = [Vec3::ZERO, Vec3::X, 2.0 * Vec3::Y, 3.0 * Vec3::Z];
        let triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let mitsuba = [
            Vec3::new(-0.577_350_26, -0.577_350_26, -0.577_350_26),
            Vec3::new(0.791_601_06, -0.411_490_05, -0.451_711_83),
            Vec3::new(-0.167_379_23, 0.927_008_33, -0.335_618_23),
            Vec3::new(-0.110_320_57, -0.198_251_92, 0.973_922_7),
        ];
        for (ours, theirs) in angle_weighted(&positions, &triangles).iter().zip(mitsuba) {
            assert!(ours.distance(theirs) < 1e-6, "{ours} for {theirs}");
        }
    }

    #[test]
    fn tiny_huge_and_flat_triangles_give_unit_normals() {
        for scale in [1e-44, 1e-30, 1.0, 1e30, 1e38] {
            let positions = [
                Vec3::ZERO,
                scale * Vec3::X,
                scale * Vec3::Y,
                Vec3::splat(scale),
            ];
            let triangles = [[0, 1, 2], [3, 3, 3], [0, 1, 1]];
            let normals = angle_weighted(&positions, &triangles);
            assert_eq!(normals[..3], [Vec3::Z; 3], "scale {scale}");
            assert_eq!(normals[3], NOWHERE);
        }
    }

    #[test]
    fn an_unfinite_triangle_leaves_its_neighbours_normals_alone() {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::NAN];
        let normals = angle_weighted(&positions, &[[0, 1, 2], [0, 1, 3]]);
        assert_eq!(normals, [Vec3::Z, Vec3::Z, Vec3::Z, NOWHERE]);
    }
}
