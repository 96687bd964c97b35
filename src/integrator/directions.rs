//! A density of directions, learnt from examples: a quadtree over a square onto which the sphere is mapped with equal areas,
//! as Müller, Gross and Novák have it (*Practical path guiding for efficient light-transport simulation*, 2017). The square's
//! centre is the examples' mean, for around it the map (Archimedes' cylinder) distorts least.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use crate::lanes::{atan2, sin_cos_turns};
use crate::math::Frame;

/// A part of the square, cut into quarters: that with x and y below the middle, that with x above it, and those with y above.
#[derive(Clone, Copy, Debug)]
struct Quarters {
    /// The probability of each; their sum is 1.
    share: [f32; 4],
    /// Where each is cut further; 0 where it is not.
    child: [u32; 4],
}

/// A density of directions.
#[derive(Clone, Debug)]
pub(super) struct Directions {
    /// World space, around the examples' mean.
    frame: Frame,
    /// The first is the whole square.
    tree: Vec<Quarters>,
}

/// A quarter with more examples is cut further.
const MOST: usize = 4;
/// So often at most.
const MAX_CUTS: u32 = 12;
/// The examples that each quarter counts as having beside those that it has, so that none is left out.
const PRIOR: f32 = 0.25;

impl Directions {
    /// The most bytes for so many examples.
    pub(super) fn bytes(examples: u64) -> u64 {
        let cuts = (examples / MOST as u64 + 1) * u64::from(MAX_CUTS);
        (cuts * size_of::<Quarters>() as u64).saturating_add(size_of::<Self>() as u64)
    }

    /// Learnt from unit vectors, of which there is at least one.
    pub(super) fn of(examples: impl Iterator<Item = Vec3> + Clone) -> Self {
        let sum: Vec3 = examples.clone().sum();
        let frame = Frame::around(sum.try_normalize().unwrap_or(Vec3::Z));
        let mut directions = Self {
            frame,
            tree: Vec::new(),
        };
        let mut places: Vec<Vec2> = examples.map(|example| directions.place(example)).collect();
        directions.cut(&mut places, 1);
        directions.tree.shrink_to_fit();
        directions
    }

    /// Cuts a part with those examples, whose places are in [0, 1)² of it; the answer is where it stands in the tree.
    fn cut(&mut self, places: &mut [Vec2], cuts: u32) -> u32 {
        let index = self.tree.len();
        let mut counts = [0; 4];
        for place in &mut *places {
            counts[quarter(*place)] += 1;
        }
        let all = places.len() as f32 + 4.0 * PRIOR;
        self.tree.push(Quarters {
            share: counts.map(|count| (count as f32 + PRIOR) / all),
            child: [0; 4],
        });
        places.sort_by_key(|place| quarter(*place));
        let mut rest = places;
        for (number, count) in counts.into_iter().enumerate() {
            let (own, others) = rest.split_at_mut(count);
            rest = others;
            if count > MOST && cuts < MAX_CUTS {
                for place in &mut *own {
                    *place = within(*place, number);
                }
                self.tree[index].child[number] = self.cut(own, cuts + 1);
            }
        }
        index as u32
    }

    /// Where a direction is in the square.
    fn place(&self, direction: Vec3) -> Vec2 {
        let local = self.frame.to_local(direction);
        let around = atan2::<f32>(local.x, local.z) * (1.0 / TAU) + 0.5;
        below_one(Vec2::new(around, 0.5 * local.y + 0.5))
    }

    /// A direction, from numbers in [0, 1)².
    pub(super) fn sample(&self, mut u: Vec2) -> Vec3 {
        let (mut corner, mut side) = (Vec2::ZERO, 1.0);
        let mut index = 0;
        loop {
            let Quarters { share, child } = self.tree[index];
            side *= 0.5;
            let left = share[0] + share[2];
            let right = draw(&mut u.x, left);
            let [lower, upper] = match right {
                true => [share[1], share[3]],
                false => [share[0], share[2]],
            };
            let above = draw(&mut u.y, lower / (lower + upper));
            let number = usize::from(right) + 2 * usize::from(above);
            corner += side * corner_of(number);
            match child[number] {
                0 => break,
                next => index = next as usize,
            }
        }
        let place = corner + side * u;
        let y = 2.0 * place.y - 1.0;
        let (sin, cos) = sin_cos_turns::<f32>(place.x);
        let r = (1.0 - y * y).max(0.0).sqrt();
        self.frame.to_world(Vec3::new(-r * sin, y, -r * cos))
    }

    /// The density with which a unit vector is drawn, in 1/sr.
    pub(super) fn pdf(&self, direction: Vec3) -> f32 {
        let mut place = self.place(direction);
        let mut pdf = 1.0 / (4.0 * PI);
        let mut index = 0;
        loop {
            let Quarters { share, child } = &self.tree[index];
            let number = quarter(place);
            pdf *= 4.0 * share[number];
            match child[number] {
                0 => return pdf,
                next => index = next as usize,
            }
            place = within(place, number);
        }
    }
}

/// Whether the number in [0, 1) is not below the probability of "no"; it becomes one that tells nothing of that.
fn draw(u: &mut f32, no: f32) -> bool {
    let yes = *u >= no;
    *u = match yes {
        true => (*u - no) / (1.0 - no),
        false => *u / no,
    };
    *u = u.clamp(0.0, 1f32.next_down());
    yes
}

/// The quarter that a place in [0, 1)² is in.
fn quarter(place: Vec2) -> usize {
    usize::from(place.x >= 0.5) + 2 * usize::from(place.y >= 0.5)
}

/// Its corner, in halves.
fn corner_of(number: usize) -> Vec2 {
    Vec2::new((number % 2) as f32, (number / 2) as f32)
}

/// The place in that quarter.
fn within(place: Vec2, number: usize) -> Vec2 {
    below_one(2.0 * place - corner_of(number))
}

/// What rounding brings out of [0, 1)².
fn below_one(place: Vec2) -> Vec2 {
    place.clamp(Vec2::ZERO, Vec2::splat(1f32.next_down()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::warp;
    use crate::math::random;

    fn pair(key: u64, number: u32) -> Vec2 {
        let unit = |dimension| random::unit(random::bits(key, dimension));
        Vec2::new(unit(2 * number), unit(2 * number + 1))
    }

    /// Densities of some kinds: even, a narrow one, two, and the same direction many times.
    fn examples() -> Vec<Directions> {
        let even = |i| Vec3::from(warp::uniform_sphere::<f32>(pair(1, i).into()));
        let narrow = |axis: Vec3, i| (axis + 0.1 * even(i)).normalize();
        vec![
            Directions::of((0..64).map(even)),
            Directions::of((0..64).map(|i| narrow(Vec3::Z, i))),
            Directions::of((0..40).map(|i| narrow(if i % 3 == 0 { Vec3::X } else { -Vec3::X }, i))),
            Directions::of((0..64).map(|_| Vec3::NEG_Y)),
            Directions::of(std::iter::once(Vec3::new(0.6, 0.0, 0.8))),
        ]
    }

    #[test]
    fn the_density_is_above_0_and_its_integral_is_1() {
        let n = 1 << 20;
        // What is far narrower than strata is left to the test below.
        for (number, directions) in examples()[..3].iter().enumerate() {
            let mut sum = 0.0;
            for i in 0..n {
                // Strata along both axes, in the square's own map: it is of equal areas.
                let strata = Vec2::new((i % 1024) as f32, (i / 1024) as f32);
                let u = (strata + pair(2, i)) / 1024.0;
                let y = 2.0 * u.y - 1.0;
                let (sin, cos) = sin_cos_turns::<f32>(u.x);
                let r = (1.0 - y * y).max(0.0).sqrt();
                let pdf = directions.pdf(directions.frame.to_world(Vec3::new(r * sin, y, r * cos)));
                assert!(pdf > 0.0);
                sum += f64::from(pdf);
            }
            let integral = sum / f64::from(n) * f64::from(4.0 * PI);
            assert!((integral - 1.0).abs() < 0.01, "{number}: {integral}");
        }
    }

    /// The mean of 1/pdf over what is drawn in a region is its solid angle.
    #[test]
    fn directions_are_drawn_as_densely_as_the_density_says() {
        const BINS: usize = 8;
        let n = 1 << 20;
        for (number, directions) in examples().iter().enumerate() {
            let mut bins = [[0.0_f64; 2]; BINS * BINS];
            for i in 0..n {
                let direction = directions.sample(pair(3, i));
                assert!((direction.length() - 1.0).abs() < 1e-5);
                let share = f64::from(1.0 / directions.pdf(direction)) / f64::from(n);
                // In halves of the world's axes, of equal areas; turned, so that no bin ends where a quarter does.
                let u = (0.5 * direction.z + 0.5) * BINS as f32;
                let v = (atan2::<f32>(direction.y, direction.x) / TAU + 0.5) * BINS as f32;
                let bin = (u as usize).min(BINS - 1) * BINS + (v as usize).min(BINS - 1);
                bins[bin][0] += share;
                bins[bin][1] += share * share;
            }
            let area = f64::from(4.0 * PI) / (BINS * BINS) as f64;
            let chi_squared: f64 = (bins.iter())
                .map(|[sum, squares]| {
                    let variance = squares - sum * sum / f64::from(n);
                    (sum - area).powi(2) / variance
                })
                .sum();
            // Of 64 degrees of freedom, exceeded with a probability of 10⁻⁵.
            assert!(chi_squared < 121.0, "{number}: {chi_squared}");
        }
    }
}
