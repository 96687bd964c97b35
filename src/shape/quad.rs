//! A rectangle as a light, drawn uniformly over the solid angle under which a point sees it (Ureña, Fajardo and
//! King, *An area-preserving parametrization for spherical rectangles*, 2013). A mesh of two triangles that make
//! a rectangle is one; all runs in double precision, and the angles come from arc tangents of sums of squares,
//! so that neither a grazing nor a distant view cancels.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3, Vec2, Vec3};

use crate::mesh::Mesh;

/// Two triangles that share a diagonal, in a plane, with right angles.
#[derive(Debug)]
pub(super) struct Quad {
    corner: DVec3,
    /// Unit vectors along the sides at the corner.
    axes: [DVec3; 2],
    /// The sides' lengths.
    size: DVec2,
    /// The largest coordinate.
    reach: f64,
    /// Which of each triangle's corners stands at `corner`.
    first: [usize; 2],
}

/// A point of the rectangle: which triangle, and its three barycentric coordinates there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) triangle: u32,
    pub(super) barycentric: [f32; 3],
}

/// The least solid angle that is drawn: a smaller one holds too few of a double's digits, and there is nothing
/// to be gained any more.
const LEAST: f64 = 1e-8;
/// How near a point may come to the plane, as a part of the largest coordinate: closer, single precision no
/// longer tells on which side it lies.
const NEAREST: f64 = 1.0 / (1 << 18) as f64;
/// By what fraction of its sides a rectangle may miss being one.
const TOLERANCE: f64 = 1e-5;

impl Quad {
    /// The rectangle that a mesh is, if it is one.
    pub(super) fn of(mesh: &Mesh) -> Option<Self> {
        let [t0, t1] = mesh.triangles[..] else {
            return None;
        };
        let corners = [t0, t1].map(|t| t.map(|i| mesh.positions[i as usize]));
        let turned = |t: usize, first: usize| [0, 1, 2].map(|i| corners[t][(first + i) % 3]);
        let starts = (0..9).map(|i| [i / 3, i % 3]);
        let (first, [a, b, c], d) = starts
            .map(|[i, j]| ([i, j], turned(0, i), turned(1, j)))
            .find(|(_, [a, _, c], [d, e, _])| a == d && c == e)
            .map(|(first, t0, [_, _, d])| (first, t0.map(Vec3::as_dvec3), d.as_dvec3()))?;
        let [x, y] = [b - a, d - a];
        let size = DVec2::new(x.length(), y.length());
        let allowed = TOLERANCE * size.min_element();
        let right = x.dot(y).abs() <= allowed * size.max_element();
        let closed = (a + x + y).distance(c) <= allowed;
        (right && closed && size.min_element() > 0.0 && size.is_finite()).then(|| Self {
            corner: a,
            axes: [x / size.x, y / size.y],
            size,
            reach: (a.abs().max(c.abs()))
                .max(b.abs().max(d.abs()))
                .max_element(),
            first,
        })
    }

    /// The point at these fractions of the sides.
    pub(super) fn place(&self, at: DVec2) -> Place {
        // The first triangle's corners lie at (0, 0), (1, 0), (1, 1), the second's at (0, 0), (1, 1), (0, 1).
        let (triangle, weights) = if at.y <= at.x {
            (0, [1.0 - at.x, at.x - at.y, at.y])
        } else {
            (1, [1.0 - at.y, at.x, at.y - at.x])
        };
        let mut barycentric = [0.0; 3];
        for (i, w) in weights.into_iter().enumerate() {
            barycentric[(self.first[triangle] + i) % 3] = w as f32;
        }
        Place {
            triangle: triangle as u32,
            barycentric,
        }
    }

    /// The fractions of the sides at a point of a triangle, whose second and third coordinate are given.
    pub(super) fn fractions(&self, triangle: u32, barycentric: Vec2) -> Vec2 {
        let b = [
            1.0 - barycentric.x - barycentric.y,
            barycentric.x,
            barycentric.y,
        ];
        let first = self.first[triangle as usize];
        let [_, second, third] = [0, 1, 2].map(|i| b[(first + i) % 3]);
        if triangle == 0 {
            Vec2::new(second + third, third)
        } else {
            Vec2::new(second, second + third)
        }
    }

    /// In square units.
    pub(super) fn area(&self) -> f64 {
        self.size.x * self.size.y
    }

    /// The rectangle seen from a point; `None` where it fills too small an angle to be drawn by it.
    pub(super) fn seen(&self, from: Vec3) -> Option<Seen> {
        let corner = self.corner - from.as_dvec3();
        let [x, y] = self.axes;
        let low = DVec2::new(corner.dot(x), corner.dot(y));
        let high = low + self.size;
        let distance = corner.dot(x.cross(y)).abs();
        let largest = f64::from(from.abs().max_element()).max(self.reach);
        if distance <= NEAREST * largest {
            return None;
        }
        // The planes through the eye and the sides y = low, x = high, y = high, x = low: the two components
        // of their unit normals, along the side's own axis and toward the rectangle's plane.
        let plane = |side: f64| {
            let length = side.hypot(distance);
            DVec2::new(distance, side) / length
        };
        let planes = [plane(-low.y), plane(high.x), plane(high.y), plane(-low.x)];
        // The angle between neighbours, inside the spherical rectangle.
        let angle = |i: usize| {
            let (a, b) = (planes[i], planes[(i + 1) % 4]);
            let sine = (a.x * b.x).hypot((a.x * b.y).hypot(a.y * b.x));
            sine.atan2(-a.y * b.y)
        };
        let [g0, g1, g2, g3] = [0, 1, 2, 3].map(angle);
        let start = TAU - g2 - g3;
        let solid_angle = g0 + g1 - start;
        (solid_angle > LEAST).then_some(Seen {
            low,
            high,
            distance,
            ends: [planes[0].y, planes[2].y],
            start,
            solid_angle,
        })
    }
}

/// A [`Quad`] and where it is seen from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    /// The rectangle on its plane, the eye's foot at the origin.
    low: DVec2,
    high: DVec2,
    /// Of the eye from the plane.
    distance: f64,
    /// How much the planes through the sides along x lean toward the rectangle.
    ends: [f64; 2],
    /// 2π less the angles at x = low.
    start: f64,
    /// In sr.
    pub(super) solid_angle: f64,
}

impl Seen {
    /// A point, as fractions of the sides, uniform over the solid angle.
    pub(super) fn sample(&self, u: Vec2) -> DVec2 {
        let u = u.as_dvec2();
        let [b0, b1] = self.ends;
        let (sin, cos) = (u.x * self.solid_angle + self.start).sin_cos();
        let f = (cos * b0 - b1) / sin;
        let c = (f.signum() / f.hypot(b0)).clamp(-1.0, 1.0);
        let x = c * self.distance / (1.0 - c * c).max(f64::MIN_POSITIVE).sqrt();
        let x = x.max(self.low.x).min(self.high.x);
        let d = x.hypot(self.distance);
        let [h0, h1] = [self.low.y, self.high.y].map(|y| y / d.hypot(y));
        let h = h0 + u.y * (h1 - h0);
        let y = (d * h / (1.0 - h * h).max(f64::MIN_POSITIVE).sqrt())
            .max(self.low.y)
            .min(self.high.y);
        (DVec2::new(x, y) - self.low) / (self.high - self.low)
    }
}

#[cfg(test)]
mod tests {
    use glam::DMat4;

    use super::*;
    use crate::math::random;
    use crate::mesh;

    fn quad(matrix: DMat4, flip: bool) -> Option<Quad> {
        let mut mesh = mesh::rectangle();
        mesh.transform(&matrix);
        if flip {
            mesh.flip_normals();
        }
        Quad::of(&mesh)
    }

    fn placed() -> DMat4 {
        DMat4::from_translation(DVec3::new(3.0, -1.0, 2.0))
            * DMat4::from_rotation_x(0.7)
            * DMat4::from_scale(DVec3::new(2.0, 0.5, 1.0))
    }

    #[test]
    fn a_mesh_is_a_rectangle_only_if_its_angles_are_right() {
        assert!(quad(placed(), false).is_some() && quad(placed(), true).is_some());
        let sheared = DMat4::from_cols_array_2d(&[
            [1.0, 0.1, 0.0, 0.0],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ]);
        assert!(quad(sheared, false).is_none());
        assert!(Quad::of(&mesh::cube()).is_none());
    }

    #[test]
    fn places_lie_where_their_fractions_say_and_give_them_back() {
        for flip in [false, true] {
            let mut mesh = mesh::rectangle();
            mesh.transform(&placed());
            if flip {
                mesh.flip_normals();
            }
            let quad = Quad::of(&mesh).unwrap();
            for (x, y) in [(0.1, 0.7), (0.9, 0.2), (0.5, 0.5), (0.0, 1.0)] {
                let place = quad.place(DVec2::new(x, y));
                let corners = mesh.corners(&mesh.triangles[place.triangle as usize]);
                let b = place.barycentric;
                let position = b[0] * corners[0] + b[1] * corners[1] + b[2] * corners[2];
                let [along, up] = quad.axes;
                let expected = quad.corner + along * quad.size.x * x + up * quad.size.y * y;
                assert!(position.as_dvec3().distance(expected) < 1e-5);
                let back = quad.fractions(place.triangle, Vec2::new(b[1], b[2]));
                assert!((back.as_dvec2() - DVec2::new(x, y)).length() < 1e-6);
            }
        }
    }

    /// Of a rectangle [x0, x1] × [y0, y1] at distance d, by its corners.
    fn solid_angle(low: DVec2, high: DVec2, d: f64) -> f64 {
        let corner = |x: f64, y: f64| (x * y / (d * (x * x + y * y + d * d).sqrt())).atan();
        corner(high.x, high.y) - corner(low.x, high.y) - corner(high.x, low.y)
            + corner(low.x, low.y)
    }

    #[test]
    fn points_are_uniform_over_the_solid_angle_from_near_far_and_aside() {
        let quad = quad(placed(), false).unwrap();
        let [x, y] = quad.axes;
        let n = x.cross(y);
        for (along, up, away) in [
            (0.5, 0.5, 1.0),
            (0.5, 0.5, -0.3),
            (-3.0, 2.0, 0.7),
            (40.0, 10.0, 5.0),
            (0.1, 5.0, 300.0),
            (2.0, 0.5, 0.02),
            (800.0, 700.0, 900.0),
        ] {
            let from = quad.corner + x * quad.size.x * along + y * quad.size.y * up + n * away;
            let from = from.as_vec3();
            let seen = quad.seen(from).unwrap();
            let exact = solid_angle(seen.low, seen.high, seen.distance);
            let ratio = seen.solid_angle / exact;
            assert!((ratio - 1.0).abs() < 1e-5, "{along} {up} {away}: {ratio}");
            // The part of the angle that lies in a part of the rectangle is that of the points there.
            let side = 200;
            let part = |at: DVec2| at.x < 0.3 && at.y > 0.4;
            let mut inside = 0;
            for i in 0..side * side {
                let jitter = |n| random::unit(random::bits(n, i));
                let u = Vec2::new(
                    ((i % side) as f32 + jitter(1)) / side as f32,
                    ((i / side) as f32 + jitter(2)) / side as f32,
                );
                let at = seen.sample(u);
                assert!(at.cmpge(DVec2::ZERO).all() && at.cmple(DVec2::ONE).all());
                inside += u32::from(part(at));
            }
            let size = seen.high - seen.low;
            let low = seen.low + size * DVec2::new(0.0, 0.4);
            let high = seen.low + size * DVec2::new(0.3, 1.0);
            let expected = solid_angle(low, high, seen.distance) / exact;
            let found = f64::from(inside) / f64::from(side * side);
            assert!(
                (found - expected).abs() < 4e-3,
                "{along} {up} {away}: {found} {expected}"
            );
        }
    }

    #[test]
    fn what_is_too_small_or_edge_on_is_left_to_the_area() {
        let quad = quad(placed(), false).unwrap();
        let [x, y] = quad.axes;
        let middle = quad.corner + 0.5 * (x * quad.size.x + y * quad.size.y);
        assert!(quad.seen((middle + x * 9.0).as_vec3()).is_none());
        assert!(quad.seen(middle.as_vec3()).is_none());
        assert!(quad.seen((middle + x.cross(y) * 1e6).as_vec3()).is_none());
    }
}
