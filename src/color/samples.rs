//! What a path carries: one value for each channel or band, with arithmetic channel by channel.

use std::ops::{Add, AddAssign, Div, Index, IndexMut, Mul, MulAssign, Sub};

/// The operations on one value a channel that light transport needs.
pub trait Spectral:
    Copy
    + std::fmt::Debug
    + Send
    + Sync
    + PartialEq
    + Add<Output = Self>
    + AddAssign
    + Sub<Output = Self>
    + Mul<Output = Self>
    + MulAssign
    + Mul<f32, Output = Self>
    + Div<f32, Output = Self>
    + Index<usize, Output = f32>
{
    /// How many channels.
    const LANES: usize;
    /// One value a channel.
    fn from_fn(f: impl FnMut(usize) -> f32) -> Self;

    /// The same value everywhere.
    fn splat(value: f32) -> Self {
        Self::from_fn(|_| value)
    }
    /// Darkness.
    fn zero() -> Self {
        Self::splat(0.0)
    }
    /// The function of each channel's value.
    fn map(self, mut f: impl FnMut(f32) -> f32) -> Self {
        Self::from_fn(|i| f(self[i]))
    }
    /// The largest value.
    fn max_value(self) -> f32 {
        (0..Self::LANES).map(|i| self[i]).fold(0.0, f32::max)
    }
    /// Whether every value is zero.
    fn is_black(self) -> bool {
        (0..Self::LANES).all(|i| self[i] == 0.0)
    }
}

/// `N` values, one a channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Samples<const N: usize>(pub [f32; N]);

impl<const N: usize> Spectral for Samples<N> {
    const LANES: usize = N;

    #[inline]
    fn from_fn(f: impl FnMut(usize) -> f32) -> Self {
        Self(std::array::from_fn(f))
    }
}

impl<const N: usize> Index<usize> for Samples<N> {
    type Output = f32;
    #[inline]
    fn index(&self, i: usize) -> &f32 {
        &self.0[i]
    }
}

impl<const N: usize> IndexMut<usize> for Samples<N> {
    #[inline]
    fn index_mut(&mut self, i: usize) -> &mut f32 {
        &mut self.0[i]
    }
}

macro_rules! channelwise {
    ($($operation:ident $method:ident $symbol:tt),+) => {$(
        impl<const N: usize> $operation for Samples<N> {
            type Output = Self;
            #[inline]
            fn $method(self, other: Self) -> Self {
                Self(std::array::from_fn(|i| self.0[i] $symbol other.0[i]))
            }
        }
    )+};
}
channelwise!(Add add +, Sub sub -, Mul mul *);

impl<const N: usize> AddAssign for Samples<N> {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const N: usize> MulAssign for Samples<N> {
    #[inline]
    fn mul_assign(&mut self, other: Self) {
        *self = *self * other;
    }
}

impl<const N: usize> Mul<f32> for Samples<N> {
    type Output = Self;
    #[inline]
    fn mul(self, factor: f32) -> Self {
        Self(self.0.map(|v| v * factor))
    }
}

impl<const N: usize> Div<f32> for Samples<N> {
    type Output = Self;
    #[inline]
    fn div(self, divisor: f32) -> Self {
        self * (1.0 / divisor)
    }
}
