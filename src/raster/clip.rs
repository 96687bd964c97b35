//! Clipping in homogeneous coordinates (Sutherland and Hodgman, *Reentrant polygon clipping*, 1974): a triangle that reaches
//! before the near plane, behind the far one or out of the guard band is cut there, before anything is divided by w. What
//! is out of the picture but within the band is left to the coverage test.
//!
//! Where an edge is cut depends on its two ends alone, taken in one order, so that triangles that share an edge share the
//! new corner to the bit.

use super::projection::{Place, Projection};

/// The most corners of a triangle that six planes have cut.
const MOST: usize = 9;

/// Where triangles are cut.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    pub(super) near: f64,
    pub(super) far: f64,
    /// Coordinates in the picture reach so far to both sides, in pixels.
    pub(super) band: f64,
}

impl Limits {
    pub(super) fn new(projection: &Projection, band: f64) -> Self {
        let [near, far] = projection.range();
        Self { near, far, band }
    }

    /// A bit for each limit that a place is beyond, or is no number before.
    pub(super) fn beyond(&self, place: &Place) -> i32 {
        let inner = self.inner(place).into_iter().enumerate();
        inner.fold(0, |bits, (i, inner)| {
            bits | i32::from(inner.is_nan() || inner < 0.0) << i
        })
    }

    /// How far within each limit a place is; negative outside.
    fn inner(&self, place: &Place) -> [f64; 6] {
        let reach = self.band * place.w;
        [
            place.a - self.near,
            self.far - place.a,
            reach - place.x,
            reach + place.x,
            reach - place.y,
            reach + place.y,
        ]
    }
}

/// A convex polygon.
#[derive(Clone, Copy, Debug)]
pub(super) struct Polygon {
    corners: [Place; MOST],
    count: usize,
}

impl Polygon {
    fn push(&mut self, place: Place) {
        // Rounding alone could make more of them; what is left out then is nothing.
        if let Some(corner) = self.corners.get_mut(self.count) {
            *corner = place;
            self.count += 1;
        }
    }

    pub(super) fn corners(&self) -> &[Place] {
        &self.corners[..self.count]
    }
}

/// What is left of a triangle within the limits: fewer than three corners where it is nothing, or is no finite triangle.
pub(super) fn clip(triangle: [Place; 3], limits: &Limits) -> Polygon {
    let [a, ..] = triangle;
    let mut polygon = Polygon {
        corners: [a; MOST],
        count: 0,
    };
    if !triangle.iter().all(|place| place.is_finite()) {
        return polygon;
    }
    triangle.into_iter().for_each(|place| polygon.push(place));
    for plane in 0..6 {
        let whole = polygon;
        polygon.count = 0;
        let inner = |place: &Place| limits.inner(place)[plane];
        let corners = whole.corners();
        for (i, &to) in corners.iter().enumerate() {
            let from = corners[(i + corners.len() - 1) % corners.len()];
            let (before, after) = (inner(&from), inner(&to));
            if (before < 0.0) != (after < 0.0) {
                polygon.push(cut(from, to, before, after));
            }
            if after >= 0.0 {
                polygon.push(to);
            }
        }
    }
    polygon
}

/// Where an edge passes the limit that its ends are so far within.
fn cut(from: Place, to: Place, before: f64, after: f64) -> Place {
    if from <= to {
        from.toward(to, before / (before - after))
    } else {
        to.toward(from, after / (after - before))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits {
        near: 1.0,
        far: 100.0,
        band: 1000.0,
    };

    fn place(x: f64, y: f64, a: f64) -> Place {
        Place { x, y, a, w: a }
    }

    #[test]
    fn the_near_plane_cuts_edges_where_it_must() {
        // Two corners in front of the eye, one behind it: at a = 1 edges are cut at a third and at two thirds of their way.
        let polygon = clip(
            [
                place(0.0, 0.0, 3.0),
                place(6.0, 0.0, 0.0),
                place(0.0, 6.0, 2.0),
            ],
            &LIMITS,
        );
        let expected = [
            place(0.0, 0.0, 3.0),
            place(4.0, 0.0, 1.0),
            place(3.0, 3.0, 1.0),
            place(0.0, 6.0, 2.0),
        ];
        assert_eq!(polygon.corners().len(), expected.len(), "{polygon:?}");
        for found in polygon.corners() {
            let near =
                |e: &Place| (e.x - found.x).abs() + (e.y - found.y).abs() + (e.a - found.a).abs();
            assert!(expected.iter().any(|e| near(e) < 1e-12), "{polygon:?}");
        }
    }

    #[test]
    fn what_is_outside_is_nothing_and_what_is_inside_stays() {
        let behind = [
            place(0.0, 0.0, -3.0),
            place(6.0, 0.0, 0.5),
            place(0.0, 6.0, 0.9),
        ];
        assert!(clip(behind, &LIMITS).corners().len() < 3);
        let beyond = [
            place(0.0, 0.0, 200.0),
            place(6.0, 0.0, 150.0),
            place(0.0, 6.0, 101.0),
        ];
        assert!(clip(beyond, &LIMITS).corners().len() < 3);
        let inside = [
            place(0.0, 0.0, 2.0),
            place(6.0, 0.0, 3.0),
            place(0.0, 6.0, 4.0),
        ];
        assert_eq!(clip(inside, &LIMITS).corners(), inside);
        for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(
                clip([inside[0], inside[1], place(odd, 0.0, 2.0)], &LIMITS)
                    .corners()
                    .is_empty()
            );
        }
        let huge = [
            place(1e200, 0.0, 2.0),
            place(6.0, -1e300, 3.0),
            place(0.0, 6.0, 4.0),
        ];
        for corner in clip(huge, &LIMITS).corners() {
            assert!((corner.x / corner.w).abs() <= 1000.1 && (corner.y / corner.w).abs() <= 1000.1);
        }
    }

    #[test]
    fn an_edge_is_cut_at_one_place_whichever_triangle_it_belongs_to() {
        let (a, b) = (place(1.7, -3.3, 0.123), place(-12.9, 7.7, 5.77));
        let one = clip([a, b, place(3.0, 4.0, 2.0)], &LIMITS);
        let other = clip([b, a, place(-3.0, -4.0, 7.0)], &LIMITS);
        let shared = |place: &&Place| other.corners().contains(place);
        assert_eq!(one.corners().iter().filter(shared).count(), 2);
    }
}
