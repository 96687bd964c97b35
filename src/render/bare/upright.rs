//! Which way is up in a mesh whose file does not say it: glTF has +y, STL as a rule +z, and the others as a rule +y. The rule
//! gives way where the mesh would stand far better on the other side. How well it stands is the area that it stands on, the
//! convex hull of what touches the ground, as a part of the area over which it reaches; so in Fu et al., *Upright orientation of
//! man-made objects*, 2008, among other signs.

use std::path::Path;

use glam::{DVec2, Vec3};
use rayon::prelude::*;

use super::{UpAxis, plugin};
use crate::mesh::Mesh;

/// What lies no higher than this part of the height touches the ground.
const TOUCHING: f32 = 0.02;
/// What a mesh stands on that stands at all, and how many times that of the other side it is where that is doubtless.
const STANDING: f64 = 0.1;
const DOUBTLESS: f64 = 4.0;
/// A face that is further from one of its corners' mean normals is at an edge: the cosine of 30°.
const EDGE: f32 = 0.866;

impl UpAxis {
    /// The axis of meshes in files of that format, as a rule.
    pub(super) fn rule(self, path: &Path) -> Self {
        match (self, plugin(path)) {
            (Self::Auto, Some("stl")) => Self::Z,
            (Self::Auto, _) => Self::Y,
            (given, _) => given,
        }
    }

    /// The axis of the mesh of a file.
    pub(crate) fn of(self, path: &Path, mesh: &Mesh) -> Self {
        let rule = self.rule(path);
        if self != Self::Auto || plugin(path) == Some("gltf") {
            return rule;
        }
        let other = if rule == Self::Z { Self::Y } else { Self::Z };
        let [by_rule, by_other] = [rule, other].map(|up| stands_on(mesh, up));
        match by_other >= STANDING && by_other >= DOUBTLESS * by_rule {
            true => other,
            false => rule,
        }
    }
}

/// How much of the area under a mesh it stands on, 0 to 1.
fn stands_on(mesh: &Mesh, up: UpAxis) -> f64 {
    let Some((min, max)) = mesh.bounds() else {
        return 0.0;
    };
    let (up, front) = (up.direction(), up.front());
    let right = up.cross(front);
    let height = |p: Vec3| p.dot(up);
    // The axis is +y or +z.
    let (low, high) = (height(min), height(max));
    // Vertices that no triangle has may lie beyond the box.
    let inside = |p: Vec3| p.cmpge(min).all() && p.cmple(max).all();
    let touches = |p: &Vec3| height(*p) - low <= TOUCHING * (high - low) && inside(*p);
    let below = |p: &Vec3| DVec2::new((p - min).dot(right).into(), (p - min).dot(front).into());
    // The hull of all is that of the parts' hulls.
    let parts = mesh
        .positions
        .par_chunks(1 << 14)
        .flat_map_iter(|part| hull(part.iter().filter(|p| touches(p)).map(below).collect()));
    let standing = hull(parts.collect());
    let size = max - min;
    let reach = f64::from(size.dot(right).abs()) * f64::from(size.dot(front).abs());
    // What is flat lies rather than stands: that says nothing.
    if reach > 0.0 && high > low {
        area(&standing) / reach
    } else {
        0.0
    }
}

/// The corners of the convex hull of points, one after the other (Andrew's monotone chain, 1979).
fn hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let chain = |points: &mut dyn Iterator<Item = &DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for &p in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(p - a) <= 0.0
            {
                chain.pop();
            }
            chain.push(p);
        }
        chain
    };
    let (mut below, mut above) = (chain(&mut points.iter()), chain(&mut points.iter().rev()));
    // Each ends where the other begins.
    below.pop();
    above.pop();
    below.append(&mut above);
    below
}

/// The area of a polygon.
fn area(corners: &[DVec2]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    let twice = corners.iter().zip(next).map(|(a, b)| a.perp_dot(*b));
    twice.sum::<f64>() / 2.0
}

/// Whether most of a mesh's area is at edges, as that of a machine's part is, so that mean normals would round these off.
pub(super) fn is_angular(mesh: &Mesh) -> bool {
    let normals = mesh.mean_normals();
    let (mut all, mut angular) = (0.0, 0.0);
    for triangle in &mesh.triangles {
        let [a, b, c] = mesh.corners(triangle);
        let across = (b - a).cross(c - a);
        let area = across.length();
        let Some(normal) = across.try_normalize() else {
            continue;
        };
        all += f64::from(area);
        let is_edge = |corner: &u32| normals[*corner as usize].dot(normal) < EDGE;
        if triangle.iter().any(is_edge) {
            angular += f64::from(area);
        }
    }
    2.0 * angular > all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A prism over a regular polygon, closed.
    fn prism(sides: u32, radius: f32, height: f32, turned: impl Fn(Vec3) -> Vec3) -> Mesh {
        let corner = |i: u32, z: f32| {
            let angle = (i as f32 + 0.5) / sides as f32 * std::f32::consts::TAU;
            turned(Vec3::new(radius * angle.cos(), radius * angle.sin(), z))
        };
        let positions = [0.0, height]
            .into_iter()
            .flat_map(|z| (0..sides).map(move |i| corner(i, z)));
        let mut triangles = Vec::new();
        for i in 0..sides {
            let (next, above) = ((i + 1) % sides, sides);
            triangles.extend([[i, next, i + above], [next, next + above, i + above]]);
            if (1..sides - 1).contains(&i) {
                triangles.extend([[0, i + 1, i], [above, above + i, above + i + 1]]);
            }
        }
        Mesh {
            positions: positions.collect(),
            triangles,
            ..Mesh::default()
        }
    }

    #[test]
    fn what_stands_far_better_on_the_other_side_is_put_there() {
        // A tower along z that gets thinner, which lies on little otherwise; the same along y; and a box, which stands
        // on any of its sides.
        let thinner = |p: Vec3| (1.0 - 0.15 * p.z) * p.with_z(0.0) + p.z * Vec3::Z;
        let tower = prism(64, 1.0, 5.0, thinner);
        let along_y = prism(64, 1.0, 5.0, |p| {
            let p = thinner(p);
            Vec3::new(p.y, p.z, p.x)
        });
        let cube = prism(4, 1.0, 1.0, |p| p);
        for (mesh, file, expected) in [
            (&tower, "a.ply", UpAxis::Z),
            (&tower, "a.stl", UpAxis::Z),
            (&tower, "a.glb", UpAxis::Y),
            (&along_y, "a.obj", UpAxis::Y),
            (&along_y, "a.stl", UpAxis::Y),
            (&cube, "a.ply", UpAxis::Y),
            (&cube, "a.stl", UpAxis::Z),
        ] {
            let path = Path::new(file);
            assert_eq!(UpAxis::Auto.of(path, mesh), expected, "{file}");
            assert_eq!(UpAxis::Z.of(path, mesh), UpAxis::Z);
        }
        assert!((stands_on(&cube, UpAxis::Z) - 1.0).abs() < 1e-6);
        let sheet = prism(4, 1.0, 0.0, |p| p);
        assert_eq!(UpAxis::Auto.of(Path::new("a.ply"), &sheet), UpAxis::Y);
        let circle = std::f64::consts::FRAC_PI_4;
        assert!((stands_on(&tower, UpAxis::Z) / circle - 1.0).abs() < 5e-3);
    }

    #[test]
    fn parts_of_machines_are_angular_and_what_is_round_is_not() {
        assert!(is_angular(&prism(4, 1.0, 1.0, |p| p)));
        assert!(is_angular(&prism(48, 1.0, 1.0, |p| p)));
        // A ball of 24 by 12 faces.
        let (across, down) = (24, 12);
        let place = |i: u32, j: u32| {
            let [turn, fall] = [
                i as f32 / across as f32 * std::f32::consts::TAU,
                j as f32 / down as f32 * std::f32::consts::PI,
            ];
            Vec3::new(fall.sin() * turn.cos(), fall.sin() * turn.sin(), fall.cos())
        };
        let vertices = (0..=down).flat_map(|j| (0..across).map(move |i| place(i, j)));
        let faces = (0..down).flat_map(|j| (0..across).map(move |i| (i, j)));
        let faces = faces.flat_map(|(i, j)| {
            let (a, b) = (j * across + i, j * across + (i + 1) % across);
            [[a, a + across, b], [b, a + across, b + across]]
        });
        let ball = Mesh {
            positions: vertices.collect(),
            triangles: faces.collect(),
            ..Mesh::default()
        };
        assert!(!is_angular(&ball));
    }
}
