//! A rectangle as a light, drawn uniformly over the solid angle under which a point sees it (Ureña, Fajardo and
//! King, *An area-preserving parametrization for spherical rectangles*, 2013). A mesh of two triangles that make
//! a rectangle is one. The solid angle is that of its two triangles (Van Oosterom and Strackee, *The solid angle of a
//! plane triangle*, 1983), whose formula does not cancel, however far or flat the view.

use std::f32::consts::TAU;

use glam::DVec3;

use crate::lanes::{Lanes, Vec2, Vec3, atan2, sin_cos};
use crate::mesh::Mesh;

/// Two triangles that share a diagonal, in a plane, with right angles.
#[derive(Debug)]
pub(super) struct Quad {
    corner: glam::Vec3,
    /// Unit vectors along the sides at the corner.
    axes: [glam::Vec3; 2],
    /// The sides' lengths.
    size: glam::Vec2,
    /// The largest coordinate.
    reach: f32,
    /// Which of each triangle's corners stands at `corner`.
    first: [usize; 2],
}

/// A point of the rectangle: which triangle, and its three barycentric coordinates there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) triangle: u32,
    pub(super) barycentric: [f32; 3],
}

/// The least solid angle that is drawn, in sr: over a smaller one, which has too few digits for it, the density by area
/// is as good as even.
const LEAST: f32 = 1e-3;
/// How near a point may come to the plane, as a part of the largest coordinate: closer, single precision no
/// longer tells on which side it lies.
const NEAREST: f32 = 1.0 / (1 << 18) as f32;
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
            .map(|(first, t0, [_, _, d])| (first, t0.map(glam::Vec3::as_dvec3), d.as_dvec3()))?;
        let [x, y]: [DVec3; 2] = [b - a, d - a];
        let [width, height] = [x.length(), y.length()];
        let (shorter, longer) = (width.min(height), width.max(height));
        let allowed = TOLERANCE * shorter;
        let right = x.dot(y).abs() <= allowed * longer;
        let closed = (a + x + y).distance(c) <= allowed;
        let farthest = a.abs().max(c.abs()).max(b.abs().max(d.abs()));
        (right && closed && shorter > 0.0 && longer.is_finite()).then(|| Self {
            corner: a.as_vec3(),
            axes: [(x / width).as_vec3(), (y / height).as_vec3()],
            size: glam::Vec2::new(width as f32, height as f32),
            reach: farthest.max_element() as f32,
            first,
        })
    }

    /// The point at these fractions of the sides.
    pub(super) fn place(&self, at: glam::Vec2) -> Place {
        // The first triangle's corners lie at (0, 0), (1, 0), (1, 1), the second's at (0, 0), (1, 1), (0, 1).
        let (triangle, weights) = if at.y <= at.x {
            (0, [1.0 - at.x, at.x - at.y, at.y])
        } else {
            (1, [1.0 - at.y, at.x, at.y - at.x])
        };
        let mut barycentric = [0.0; 3];
        for (i, w) in weights.into_iter().enumerate() {
            barycentric[(self.first[triangle] + i) % 3] = w;
        }
        Place {
            triangle: triangle as u32,
            barycentric,
        }
    }

    /// The fractions of the sides at a point of a triangle, whose second and third coordinate are given.
    pub(super) fn fractions(&self, triangle: u32, barycentric: glam::Vec2) -> glam::Vec2 {
        let b = [
            1.0 - barycentric.x - barycentric.y,
            barycentric.x,
            barycentric.y,
        ];
        let first = self.first[triangle as usize];
        let [_, second, third] = [0, 1, 2].map(|i| b[(first + i) % 3]);
        if triangle == 0 {
            glam::Vec2::new(second + third, third)
        } else {
            glam::Vec2::new(second, second + third)
        }
    }

    /// In square units.
    pub(super) fn area(&self) -> f32 {
        self.size.x * self.size.y
    }

    /// The points at these fractions of the sides.
    #[inline(always)]
    pub(super) fn at<F: Lanes>(&self, fractions: Vec2<F>) -> Vec3<F> {
        let [x, y] = self.axes;
        Vec3::all(self.corner)
            + Vec3::all(x * self.size.x) * fractions.x
            + Vec3::all(y * self.size.y) * fractions.y
    }

    /// The rectangle as points see it.
    #[inline(always)]
    pub(super) fn seen<F: Lanes>(&self, from: Vec3<F>) -> Seen<F> {
        let [x, y] = self.axes;
        let corner = Vec3::all(self.corner) - from;
        let size = Vec2::all(self.size);
        let low = Vec2::new(corner.dot(Vec3::all(x)), corner.dot(Vec3::all(y)));
        let high = low + size;
        let distance = corner.dot(Vec3::all(x.cross(y))).abs();
        let coordinates = from.abs();
        let largest = coordinates.x.max(coordinates.y).max(coordinates.z);
        let off = distance.gt(F::splat(NEAREST) * largest.max(F::splat(self.reach)));
        // The corners in the rectangle's own directions: on the plane, at the distance of the eye.
        let d2 = distance * distance;
        let (lx, hx) = (low.x * low.x + d2, high.x * high.x + d2);
        let (ly, hy) = (low.y * low.y, high.y * high.y);
        let lengths = [
            (lx + ly).sqrt(),
            (hx + ly).sqrt(),
            (hx + hy).sqrt(),
            (lx + hy).sqrt(),
        ];
        // Inner products of neighbouring corners, and of the first and the third.
        let (across, up) = (low.x * high.x + d2, low.y * high.y + d2);
        let (ab, bc) = (across + ly, up + high.x * high.x);
        let (cd, ad) = (across + hy, up + low.x * low.x);
        let ac = across + low.y * high.y;
        let [a, b, c, d] = lengths;
        let volume = distance * (size.x * size.y);
        let first = atan2(volume, a * b * c + ab * c + ac * b + bc * a);
        let second = atan2(volume, a * c * d + ac * d + ad * c + cd * a);
        let solid_angle = first + second;
        let solid_angle = solid_angle + solid_angle;
        Seen {
            low,
            high,
            distance,
            solid_angle,
            is_even: off & solid_angle.gt(F::splat(LEAST)),
        }
    }
}

/// A [`Quad`] and where it is seen from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen<F: Lanes> {
    /// The rectangle on its plane, the eye's foot at the origin.
    low: Vec2<F>,
    high: Vec2<F>,
    /// Of the eye from the plane.
    distance: F,
    /// In sr.
    pub(super) solid_angle: F,
    /// Where it is drawn evenly over the solid angle: it is large enough, and not on edge.
    pub(super) is_even: F::Mask,
}

impl<F: Lanes> Seen<F> {
    /// Points, as fractions of the sides, uniform over the solid angle.
    #[inline(always)]
    pub(super) fn sample(&self, u: Vec2<F>) -> Vec2<F> {
        let Self {
            low,
            high,
            distance,
            ..
        } = *self;
        let one = F::one();
        // The planes through the eye and the sides at y = low, x = low and y = high: the two components of their unit
        // normals, along the side's own axis and toward the rectangle's plane.
        let d2 = distance * distance;
        let bottom = one / (low.y * low.y + d2).sqrt();
        let top = one / (high.y * high.y + d2).sqrt();
        let left = one / (low.x * low.x + d2).sqrt();
        let (b0, b1) = (-low.y * bottom, high.y * top);
        // The angles at x = low inside the spherical rectangle, between the plane of that side and those of the others.
        let (lx, ld) = (-low.x * left, distance * left);
        let upper = angle(Vec2::new(distance * top, b1), lx, ld);
        let lower = angle(Vec2::new(distance * bottom, b0), lx, ld);
        let start = F::splat(TAU) - upper - lower;
        let (sin, cos) = sin_cos(u.x * self.solid_angle + start);
        let f = (cos * b0 - b1) / sin;
        let c = one.copysign(f) / (f * f + b0 * b0).sqrt();
        let c = c.clamp(-1.0, 1.0);
        let x = c * distance / (one - c * c).max(F::splat(f32::MIN_POSITIVE)).sqrt();
        let x = x.max(low.x).min(high.x);
        let d2 = x * x + d2;
        let (h0, h1) = (
            low.y / (d2 + low.y * low.y).sqrt(),
            high.y / (d2 + high.y * high.y).sqrt(),
        );
        let h = h0 + u.y * (h1 - h0);
        let y = h * (d2 / (one - h * h).max(F::splat(f32::MIN_POSITIVE))).sqrt();
        let y = y.max(low.y).min(high.y);
        let fractions = Vec2::new(
            (x - low.x) / (high.x - low.x),
            (y - low.y) / (high.y - low.y),
        );
        Vec2::new(fractions.x.clamp(0.0, 1.0), fractions.y.clamp(0.0, 1.0))
    }
}

/// The angle between a plane, given by two components of its normal, and that of the side at x = low.
#[inline(always)]
fn angle<F: Lanes>(plane: Vec2<F>, lx: F, ld: F) -> F {
    let (p, q, r) = (plane.x * ld, plane.x * lx, plane.y * ld);
    atan2((p * p + q * q + r * r).sqrt(), -(plane.y * lx))
}

#[cfg(test)]
mod tests {
    use glam::{DMat4, DVec2, Vec2, Vec3};

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

    fn seen(quad: &Quad, from: Vec3) -> Option<Seen<f32>> {
        Some(quad.seen::<f32>(from.into())).filter(|seen| seen.is_even)
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
                let at = Vec2::new(x, y);
                let place = quad.place(at);
                let corners = mesh.corners(&mesh.triangles[place.triangle as usize]);
                let b = place.barycentric;
                let position = b[0] * corners[0] + b[1] * corners[1] + b[2] * corners[2];
                let expected = Vec3::from(quad.at::<f32>(at.into()));
                assert!(position.distance(expected) < 1e-5);
                let back = quad.fractions(place.triangle, Vec2::new(b[1], b[2]));
                assert!((back - at).length() < 1e-6);
            }
        }
    }

    /// Of a rectangle [x0, x1] × [y0, y1] at distance d, by its corners.
    fn solid_angle(low: DVec2, high: DVec2, d: f64) -> f64 {
        let corner = |x: f64, y: f64| (x * y / (d * (x * x + y * y + d * d).sqrt())).atan();
        corner(high.x, high.y) - corner(low.x, high.y) - corner(high.x, low.y)
            + corner(low.x, low.y)
    }

    fn double(v: super::Vec2<f32>) -> DVec2 {
        Vec2::from(v).as_dvec2()
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
            (0.1, 5.0, 30.0),
            (1.2, 0.5, 0.02),
            (-0.5, 0.5, 0.05),
        ] {
            let from = quad.corner + x * quad.size.x * along + y * quad.size.y * up + n * away;
            let Some(seen) = seen(&quad, from) else {
                assert!(along == 40.0, "{along} {up} {away} is large enough");
                continue;
            };
            let (low, high) = (double(seen.low), double(seen.high));
            let exact = solid_angle(low, high, seen.distance.into());
            let ratio = f64::from(seen.solid_angle) / exact;
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
                let at = double(seen.sample(u.into()));
                assert!(at.cmpge(DVec2::ZERO).all() && at.cmple(DVec2::ONE).all());
                inside += u32::from(part(at));
            }
            let size = high - low;
            let expected = solid_angle(
                low + size * DVec2::new(0.0, 0.4),
                low + size * DVec2::new(0.3, 1.0),
                seen.distance.into(),
            ) / exact;
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
        assert!(seen(&quad, middle + x * 9.0).is_none());
        assert!(seen(&quad, middle).is_none());
        assert!(seen(&quad, middle + x.cross(y) * 1e3).is_none());
    }
}
