//! Boxes with sides along the axes.

use glam::Vec3;

use super::{Moving, Transform};

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates.
    pub min: Vec3,
    /// Largest coordinates.
    pub max: Vec3,
}

impl Bounds {
    /// Contains nothing.
    pub const EMPTY: Self = Self {
        min: Vec3::INFINITY,
        max: Vec3::NEG_INFINITY,
    };

    /// Contains every point.
    pub const EVERYTHING: Self = Self {
        min: Vec3::NEG_INFINITY,
        max: Vec3::INFINITY,
    };

    /// The smallest box around both.
    #[must_use]
    #[inline]
    pub fn union(self, other: Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    /// The smallest box around this and `point`.
    #[must_use]
    #[inline]
    pub fn with(self, point: Vec3) -> Self {
        Self {
            min: self.min.min(point),
            max: self.max.max(point),
        }
    }

    /// A box around the box's image, with room for rounding: each product of the matrix is least or greatest at one
    /// of two planes (Arvo, "Transforming axis-aligned bounding boxes", *Graphics Gems*, 1990).
    #[must_use]
    pub fn transformed(self, transform: &Transform) -> Self {
        if self.is_empty() {
            return self;
        }
        let linear = transform.linear();
        let (mut min, mut max) = (Vec3::ZERO, Vec3::ZERO);
        for axis in 0..3 {
            let column = linear.col(axis);
            let (low, high) = (column * self.min[axis], column * self.max[axis]);
            min += low.min(high);
            max += low.max(high);
        }
        let farthest = self.min.abs().max(self.max.abs());
        let error = transform.point_error(farthest, Vec3::ZERO);
        let origin = transform.translation();
        Self {
            min: min + origin - error,
            max: max + origin + error,
        }
    }

    /// A box around the box's images at all times of an interval (first, last), with room for rounding.
    #[must_use]
    pub fn moved(self, moving: &Moving, interval: (f32, f32)) -> Self {
        match moving {
            Moving::Still(transform) => self.transformed(transform),
            _ if self.is_empty() => self,
            Moving::Keyed(_) => {
                let [min, max] = moving.swept([self.min, self.max], interval);
                Self { min, max }
            }
        }
    }

    /// Its corners.
    pub fn corners(&self) -> [Vec3; 8] {
        std::array::from_fn(|i| {
            let pick = |axis: usize| match i >> axis & 1 {
                0 => self.min[axis],
                _ => self.max[axis],
            };
            Vec3::new(pick(0), pick(1), pick(2))
        })
    }

    /// Whether it contains nothing.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Whether it contains something and has no end.
    pub fn is_unbounded(&self) -> bool {
        let has_end = self.min.is_finite() && self.max.is_finite();
        !(has_end || self.is_empty())
    }
}
