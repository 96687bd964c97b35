//! Convex hulls of triangles around the unit ball, whose corners and centres of triangles are not inside of it.

use glam::{DMat3, DVec3, Vec2};

/// A convex hull.
#[derive(Clone, Debug)]
pub(super) struct Shell {
    /// Corners, counter-clockwise from outside.
    triangles: Vec<[DVec3; 3]>,
}

/// Where a line comes in.
pub(super) struct Entry {
    pub(super) place: DVec3,
    /// Outward, of any length.
    pub(super) normal: DVec3,
    /// The second and third coordinate on the triangle.
    pub(super) uv: Vec2,
    /// How the place changes with each.
    pub(super) tangents: [DVec3; 2],
}

/// Corners of the cube's triangles, by number: bit 0 is x, 1 y, 2 z.
const BOX: [[u8; 3]; 12] = [
    [1, 5, 4],
    [0, 1, 4],
    [3, 2, 6],
    [7, 3, 6],
    [1, 3, 7],
    [5, 1, 7],
    [5, 7, 6],
    [4, 5, 6],
    [4, 6, 2],
    [0, 4, 2],
    [3, 1, 0],
    [2, 3, 0],
];

/// Corners of the icosahedron's triangles: 0 is its south pole, 1 to 5 and 6 to 10 go around, 11 is its north pole.
const ICOSAHEDRON: [[u8; 3]; 20] = [
    [0, 1, 2],
    [1, 0, 5],
    [0, 2, 3],
    [0, 3, 4],
    [0, 4, 5],
    [1, 5, 10],
    [2, 1, 6],
    [3, 2, 7],
    [4, 3, 8],
    [5, 4, 9],
    [1, 10, 6],
    [2, 6, 7],
    [3, 7, 8],
    [4, 8, 9],
    [5, 9, 10],
    [6, 10, 11],
    [7, 6, 11],
    [8, 7, 11],
    [9, 8, 11],
    [10, 9, 11],
];

/// A place on the unit ball at an angle around the y axis, in turns from z toward x, and a height.
fn on_ball(turns: f64, height: f64) -> DVec3 {
    let (sin, cos) = (turns * std::f64::consts::TAU).sin_cos();
    let radius = (1.0 - height * height).max(0.0).sqrt();
    DVec3::new(radius * sin, height, radius * cos)
}

impl Shell {
    /// The hull that a scene calls so.
    pub(super) fn named(name: &str) -> Self {
        let triangles = match name {
            "box" => {
                let side = |number: u8, bit: u8| f64::from(number >> bit & 1) * 2.0 - 1.0;
                let corner = |n: u8| DVec3::new(side(n, 0), side(n, 1), side(n, 2));
                BOX.iter().map(|t| t.map(corner)).collect()
            }
            "uv_sphere" => sphere(),
            _ => {
                let ring = 1.0 / 5f64.sqrt();
                // The first is at a tenth of a turn from x toward z, the others follow.
                let corner = |n: u8| match n {
                    0 => DVec3::NEG_Y,
                    11 => DVec3::Y,
                    1..=5 => on_ball(0.25 - 0.1 - 0.2 * f64::from(n - 1), -ring),
                    _ => on_ball(0.25 - 0.2 - 0.2 * f64::from(n - 6), ring),
                };
                ICOSAHEDRON.iter().map(|t| t.map(corner)).collect()
            }
        };
        Self::around_ball(triangles)
    }

    /// Corners and centres are moved out of the ball, all by one factor.
    fn around_ball(mut triangles: Vec<[DVec3; 3]>) -> Self {
        let least = triangles.iter().flat_map(|[a, b, c]| {
            [
                a.length(),
                b.length(),
                c.length(),
                ((a + b + c) / 3.0).length(),
            ]
        });
        let least = least.fold(f64::INFINITY, f64::min);
        for triangle in &mut triangles {
            *triangle = triangle.map(|corner| corner / least);
        }
        Self { triangles }
    }

    /// How far the hull reaches along each axis after a linear map.
    pub(super) fn reach(&self, map: DMat3) -> DVec3 {
        let corners = self.triangles.iter().flatten();
        corners.fold(DVec3::ZERO, |reach, corner| reach.max((map * corner).abs()))
    }

    /// Where a line comes in: how far along it, and by which triangle's plane.
    pub(super) fn enter(&self, o: DVec3, d: DVec3) -> Option<(f64, usize)> {
        let (mut entry, mut exit) = ((f64::NEG_INFINITY, 0), f64::INFINITY);
        for (i, [a, b, c]) in self.triangles.iter().enumerate() {
            let normal = (b - a).cross(c - a);
            let (ahead, gap) = (normal.dot(d), normal.dot(a - o));
            let t = gap / ahead;
            if ahead < 0.0 && t > entry.0 {
                entry = (t, i);
            } else if ahead > 0.0 {
                exit = exit.min(t);
            } else if ahead == 0.0 && gap < 0.0 {
                return None;
            }
        }
        (entry.0 < exit && entry.0.is_finite()).then_some(entry)
    }

    /// The place where a line that comes in does so.
    pub(super) fn meet(&self, o: DVec3, d: DVec3) -> Entry {
        let (t, plane) = self.enter(o, d).unwrap_or_default();
        let place = o + t * d;
        let normal = |[a, b, c]: &[DVec3; 3]| (b - a).cross(c - a);
        let out = normal(&self.triangles[plane]);
        // Of the triangles in that plane, the one that the place is most within.
        let coordinates = |triangle: &[DVec3; 3]| {
            let [a, b, c] = *triangle;
            let whole = normal(triangle);
            let part = |p: DVec3, q: DVec3| {
                (p - place).cross(q - place).dot(whole) / whole.length_squared()
            };
            [part(b, c), part(c, a), part(a, b)]
        };
        let least = |triangle: &[DVec3; 3]| coordinates(triangle).into_iter().fold(1.0, f64::min);
        let in_plane = self.triangles.iter().filter(|triangle| {
            normal(triangle).cross(out).length() < 1e-9 && normal(triangle).dot(out) > 0.0
        });
        let triangle = in_plane.max_by(|a, b| least(a).total_cmp(&least(b)));
        let triangle = triangle.unwrap_or(&self.triangles[plane]);
        let [a, b, c] = *triangle;
        let [_, u, v] = coordinates(triangle);
        Entry {
            place,
            normal: out,
            uv: Vec2::new(u as f32, v as f32),
            tangents: [b - a, c - a],
        }
    }
}

/// Nine meridians and four circles of latitude, with the poles.
fn sphere() -> Vec<[DVec3; 3]> {
    const AROUND: i32 = 9;
    let at = |meridian: i32, circle: i32| {
        let turns = (3.5 - f64::from(meridian)) / f64::from(AROUND);
        on_ball(
            turns,
            (f64::from(circle + 1) * std::f64::consts::PI / 5.0).cos(),
        )
    };
    let mut triangles = Vec::new();
    for k in 0..AROUND {
        triangles.push([at(k, 0), DVec3::Y, at(k + 1, 0)]);
        triangles.push([DVec3::NEG_Y, at(k, 3), at(k + 1, 3)]);
        for row in 0..3 {
            triangles.push([at(k, row), at(k + 1, row), at(k + 1, row + 1)]);
            triangles.push([at(k, row), at(k + 1, row + 1), at(k, row + 1)]);
        }
    }
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hulls_hold_the_ball_s_poles_and_face_outward() {
        for (name, count) in [
            ("default", 20),
            ("ico_sphere", 20),
            ("uv_sphere", 72),
            ("box", 12),
        ] {
            let shell = Shell::named(name);
            assert_eq!(shell.triangles.len(), count, "{name}");
            let mut area = DVec3::ZERO;
            for [a, b, c] in &shell.triangles {
                let normal = (b - a).cross(c - a);
                assert!(normal.dot(a + b + c) > 0.0, "{name}");
                assert!(
                    [*a, *b, *c].iter().all(|p| p.length() > 1.0 - 1e-9),
                    "{name}"
                );
                assert!((a + b + c).length() > 3.0 - 1e-9, "{name}");
                area += normal;
            }
            assert!(area.length() < 1e-9, "{name} is not closed");
            let (t, _) = shell
                .enter(DVec3::new(0.1, 0.05, 5.0), DVec3::NEG_Z)
                .unwrap();
            assert!((3.0..4.1).contains(&t), "{name}: {t}");
            assert!(
                shell
                    .enter(DVec3::new(3.0, 0.0, 5.0), DVec3::NEG_Z)
                    .is_none()
            );
        }
    }
}
