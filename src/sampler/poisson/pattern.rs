//! Point patterns with a large minimum distance on the unit torus. Jittered points repel each other,
//! downhill in Σ φ(distance) with Wendland's φ(r) = (1 − r)⁴ (4r + 1), r in units of twice the hexagonal
//! distance (Wendland, *Piecewise polynomial, positive definite and compactly supported radial functions of
//! minimal degree*, 1995). φ has a positive Fourier transform, so the sum also bounds the pattern's power at
//! low frequencies, which is what makes the points integrate well: as Gaussians do in Ahmed, Ren and Wonka,
//! *Gaussian blue noise* (2022), but with 14 neighbours a point and no exponentials. They stop at the
//! distance that is wanted, long before they would freeze into a lattice.

use std::num::Wrapping;

use glam::{DVec2, Vec2};

use crate::lanes::random::permute;
use crate::lanes::{Divisor, Long};
use crate::math::random;

/// The distance to reach, in hexagonal distances.
const WANTED: f64 = 0.75;
/// Steps before which no pattern stops: low frequencies take them.
const LEAST_STEPS: u32 = 30;
/// Steps after which a pattern is given up and begun anew.
const MOST_STEPS: u32 = 400;
/// Patterns begun before the best of them has to do.
const TRIES: u64 = 16;
/// Where repulsion ends, in hexagonal distances.
const REACH: f64 = 2.0;
/// How far a unit of force moves a point, in squared hexagonal distances.
const STEP: f64 = 0.2;

/// The distance between neighbours of a hexagonal lattice of `n` points a unit area.
pub(super) fn hexagonal(n: u32) -> f64 {
    (2.0 / (3f64.sqrt() * f64::from(n))).sqrt()
}

/// A pattern of `n` points in [0, 1)², one for each seed.
pub(super) fn discs(n: u32, seed: u64) -> Vec<Vec2> {
    let mut best = (0.0, Vec::new());
    for attempt in 0..TRIES {
        let key = random::key(random::key(random::key(0, seed), attempt), n.into());
        let mut points = jittered(n, key);
        let mut distance = 0.0;
        for step in 0..MOST_STEPS {
            let forces = Neighbours::new(&points).forces(&points);
            distance = forces.distance / hexagonal(n);
            if distance >= WANTED && step >= LEAST_STEPS {
                break;
            }
            for (point, force) in points.iter_mut().zip(&forces.values) {
                let moved = *point + *force * (STEP * hexagonal(n).powi(2));
                *point = moved - moved.floor();
            }
        }
        if distance > best.0 || best.1.is_empty() {
            best = (distance, points);
        }
        if distance >= WANTED {
            break;
        }
    }
    best.1.iter().map(|p| p.as_vec2()).collect()
}

/// Points in strata chosen at random.
fn jittered(n: u32, key: u64) -> Vec<DVec2> {
    let side = n.isqrt() + u32::from(n.isqrt().pow(2) < n);
    let cells = Divisor::new(side * side);
    (0..n)
        .map(|i| {
            let cell = permute::<f32>(Wrapping(i), cells, Long::splat(key)).0;
            let unit = |axis| f64::from(random::unit(random::bits(key, 2 * i + axis)));
            let cell = DVec2::new((cell % side).into(), (cell / side).into());
            (cell + DVec2::new(unit(0), unit(1))) / f64::from(side)
        })
        .collect()
}

/// Which points lie near which: a grid of cells on the torus, each at least as wide as repulsion reaches.
struct Neighbours {
    /// Cells along an axis.
    side: usize,
    /// The points of all cells, cell by cell.
    order: Vec<u32>,
    /// Where each cell begins in `order`, and where the last one ends.
    begins: Vec<u32>,
    /// Where repulsion ends; at most half the torus, where a point has one nearest image.
    reach: f64,
}

/// What pushes each point, and the least distance between any two.
struct Forces {
    values: Vec<DVec2>,
    distance: f64,
}

impl Neighbours {
    fn new(points: &[DVec2]) -> Self {
        let reach = (REACH * hexagonal(points.len() as u32)).min(0.5);
        let side = ((1.0 / reach) as usize).max(1);
        let cells = points.iter().map(|&p| Self::cell(side, p));
        let mut begins = vec![0; side * side + 1];
        for [x, y] in cells.clone() {
            begins[y * side + x + 1] += 1;
        }
        for cell in 0..side * side {
            begins[cell + 1] += begins[cell];
        }
        let (mut next, mut order) = (begins.clone(), vec![0; points.len()]);
        for (point, [x, y]) in cells.enumerate() {
            let place = &mut next[y * side + x];
            order[*place as usize] = point as u32;
            *place += 1;
        }
        Self {
            side,
            order,
            begins,
            reach,
        }
    }

    fn cell(side: usize, point: DVec2) -> [usize; 2] {
        let along = |x: f64| ((x * side as f64) as usize).min(side - 1);
        [along(point.x), along(point.y)]
    }

    /// The cells around `cell`, itself included and none twice.
    fn around(&self, [x, y]: [usize; 2]) -> impl Iterator<Item = usize> {
        let side = self.side;
        let along = move |x: usize| {
            let (first, count) = if side < 3 {
                (0, side)
            } else {
                (x + side - 1, 3)
            };
            (first..first + count).map(move |x| x % side)
        };
        along(y).flat_map(move |y| along(x).map(move |x| y * side + x))
    }

    fn forces(&self, points: &[DVec2]) -> Forces {
        let mut least = f64::INFINITY;
        let mut push = |i: usize, point: DVec2| {
            let mut force = DVec2::ZERO;
            for cell in self.around(Self::cell(self.side, point)) {
                let (begin, end) = (self.begins[cell] as usize, self.begins[cell + 1] as usize);
                for &j in &self.order[begin..end] {
                    let apart = point - points[j as usize];
                    let apart = apart - apart.round();
                    let square = apart.length_squared();
                    if j as usize != i && square < self.reach * self.reach {
                        least = least.min(square);
                        let r = square.sqrt() / self.reach;
                        force += apart * (20.0 * (1.0 - r).powi(3) / (self.reach * self.reach));
                    }
                }
            }
            force
        };
        let values = points.iter().enumerate();
        let values = values.map(|(i, &point)| push(i, point)).collect();
        Forces {
            values,
            distance: least.sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The least distance on the torus, over all pairs.
    fn distance(points: &[Vec2]) -> f64 {
        let mut least = f64::INFINITY;
        for (i, p) in points.iter().enumerate() {
            for q in &points[..i] {
                let apart = p.as_dvec2() - q.as_dvec2();
                least = least.min((apart - apart.round()).length());
            }
        }
        least
    }

    #[test]
    fn every_pattern_keeps_more_than_seven_tenths_of_the_hexagonal_distance() {
        for n in (4..=40).chain([
            49, 64, 81, 100, 128, 200, 256, 400, 512, 777, 1000, 1023, 1024,
        ]) {
            for seed in 0..8 {
                let points = discs(n, seed);
                assert_eq!(points.len(), n as usize);
                let ratio = distance(&points) / hexagonal(n);
                assert!(ratio >= 0.74, "{n} points, pattern {seed}: {ratio}");
            }
        }
    }

    /// Of independent points it is 1.
    #[test]
    fn patterns_have_little_power_at_low_frequencies() {
        for n in [64, 256, 1024] {
            let points = discs(n, 0);
            let mut power = 0.0;
            for (k, l) in [(1, 0), (0, 1), (1, 1), (1, -1), (2, 0), (0, 2), (2, 1)] {
                let wave = |p: &Vec2| {
                    let turn = std::f64::consts::TAU * f64::from(p.x * k as f32 + p.y * l as f32);
                    DVec2::new(turn.cos(), turn.sin())
                };
                let sum: DVec2 = points.iter().map(wave).sum();
                power += sum.length_squared() / f64::from(n) / 7.0;
            }
            assert!(power < 0.01, "{n}: {power}");
        }
    }
}
