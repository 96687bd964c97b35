//! Vectors in lanes.

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::Lanes;

/// Two numbers a lane.
#[derive(Clone, Copy, Debug)]
pub struct Vec2<F> {
    /// The first.
    pub x: F,
    /// The second.
    pub y: F,
}

/// Three numbers a lane.
#[derive(Clone, Copy, Debug)]
pub struct Vec3<F> {
    /// The first.
    pub x: F,
    /// The second.
    pub y: F,
    /// The third.
    pub z: F,
}

macro_rules! componentwise {
    ($vector:ident, $n:literal { $($c:ident),+ }) => {
        impl<F: Lanes> $vector<F> {
            /// From its components.
            #[inline(always)]
            pub fn new($($c: F),+) -> Self {
                Self { $($c),+ }
            }

            /// The same number everywhere.
            #[inline(always)]
            pub fn splat(value: f32) -> Self {
                Self { $($c: F::splat(value)),+ }
            }

            /// The same vector in all lanes.
            #[inline(always)]
            pub fn all(vector: glam::$vector) -> Self {
                Self { $($c: F::splat(vector.$c)),+ }
            }

            /// One lane's vector.
            #[inline(always)]
            pub fn lane(self, lane: usize) -> glam::$vector {
                glam::$vector::new($(self.$c.lane(lane)),+)
            }

            /// From a row a component.
            #[inline(always)]
            pub fn load(rows: &[F::Row; $n]) -> Self {
                let [$($c),+] = rows;
                Self { $($c: F::load($c)),+ }
            }

            /// One lane's vector, of a row a component.
            #[inline(always)]
            pub fn of(rows: &[F::Row; $n], lane: usize) -> glam::$vector {
                let [$($c),+] = rows;
                glam::$vector::new($($c[lane]),+)
            }

            /// A row a component.
            #[inline(always)]
            pub fn rows(self) -> [F::Row; $n] {
                [$(self.$c.row()),+]
            }

            /// `yes` where the mask is set, else `no`.
            #[inline(always)]
            pub fn select(mask: F::Mask, yes: Self, no: Self) -> Self {
                Self { $($c: F::select(mask, yes.$c, no.$c)),+ }
            }

            /// Multiplied component by component.
            #[inline(always)]
            pub fn scale(self, by: Self) -> Self {
                Self { $($c: self.$c * by.$c),+ }
            }

            /// Without signs.
            #[inline(always)]
            pub fn abs(self) -> Self {
                Self { $($c: self.$c.abs()),+ }
            }

            /// The square of the length.
            #[inline(always)]
            pub fn length_squared(self) -> F {
                self.dot(self)
            }

            /// The length.
            #[inline(always)]
            pub fn length(self) -> F {
                self.dot(self).sqrt()
            }

            /// Of length 1.
            #[inline(always)]
            pub fn normalize(self) -> Self {
                self * (F::one() / self.length())
            }

            /// Of length 1; zero where that cannot be.
            #[inline(always)]
            pub fn normalize_or_zero(self) -> Self {
                let scale = F::one() / self.length();
                let usable = F::zero().lt(scale) & scale.is_finite();
                Self::select(usable, self * scale, Self::splat(0.0))
            }

            /// Component by component.
            #[inline(always)]
            pub fn times(self, other: Self) -> Self {
                Self { $($c: self.$c * other.$c),+ }
            }
        }

        impl<F: Lanes> Add for $vector<F> {
            type Output = Self;
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                Self { $($c: self.$c + other.$c),+ }
            }
        }

        impl<F: Lanes> Sub for $vector<F> {
            type Output = Self;
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                Self { $($c: self.$c - other.$c),+ }
            }
        }

        impl<F: Lanes> Mul<F> for $vector<F> {
            type Output = Self;
            #[inline(always)]
            fn mul(self, factor: F) -> Self {
                Self { $($c: self.$c * factor),+ }
            }
        }

        impl<F: Lanes> Div<F> for $vector<F> {
            type Output = Self;
            #[inline(always)]
            fn div(self, divisor: F) -> Self {
                Self { $($c: self.$c / divisor),+ }
            }
        }

        impl<F: Lanes> Neg for $vector<F> {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                Self { $($c: -self.$c),+ }
            }
        }

        impl From<glam::$vector> for $vector<f32> {
            #[inline(always)]
            fn from(vector: glam::$vector) -> Self {
                Self { $($c: vector.$c),+ }
            }
        }

        impl From<$vector<f32>> for glam::$vector {
            #[inline(always)]
            fn from(vector: $vector<f32>) -> Self {
                Self::new($(vector.$c),+)
            }
        }
    };
}

componentwise!(Vec2, 2 { x, y });
componentwise!(Vec3, 3 { x, y, z });

impl<F: Lanes> Vec2<F> {
    /// The inner product.
    #[inline(always)]
    pub fn dot(self, other: Self) -> F {
        self.x * other.x + self.y * other.y
    }

    /// With a third component.
    #[inline(always)]
    pub fn extend(self, z: F) -> Vec3<F> {
        Vec3::new(self.x, self.y, z)
    }
}

impl<F: Lanes> Vec3<F> {
    /// The inner product.
    #[inline(always)]
    pub fn dot(self, other: Self) -> F {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// The outer product.
    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - other.y * self.z,
            y: self.z * other.x - other.z * self.x,
            z: self.x * other.y - other.x * self.y,
        }
    }

    /// Without the third component.
    #[inline(always)]
    pub fn xy(self) -> Vec2<F> {
        Vec2::new(self.x, self.y)
    }
}
