//! Integers of 64 bits in lanes, as their halves: enough for hashes.

use std::ops::{Add, BitXor};

use super::Ints;

/// Integers of 64 bits, one a lane, that wrap around.
#[derive(Clone, Copy, Debug)]
pub struct Long<I> {
    /// Bits 0 to 31.
    pub low: I,
    /// Bits 32 to 63.
    pub high: I,
}

impl<I: Ints> Long<I> {
    /// The same in all lanes.
    #[inline(always)]
    pub fn splat(value: u64) -> Self {
        Self {
            low: I::splat(value as u32),
            high: I::splat((value >> 32) as u32),
        }
    }

    /// `self ⊕ self / 2^N`; `M` is 32 − `N`.
    #[inline(always)]
    pub fn xor_shr<const N: u32, const M: u32>(self) -> Self {
        const { assert!(N + M == 32) };
        self ^ Self {
            low: self.low.shr::<N>() | self.high.shl::<M>(),
            high: self.high.shr::<N>(),
        }
    }

    /// Times a number.
    #[inline(always)]
    pub fn times(self, factor: u64) -> Self {
        let (low, high) = (I::splat(factor as u32), I::splat((factor >> 32) as u32));
        Self {
            low: self.low * low,
            high: self.low.mul_high(low) + self.low * high + self.high * low,
        }
    }
}

impl<I: Ints> From<I> for Long<I> {
    #[inline(always)]
    fn from(low: I) -> Self {
        let high = I::splat(0);
        Self { low, high }
    }
}

impl<I: Ints> Add for Long<I> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let low = self.low + other.low;
        // What carries is the highest bit of (a ∧ b) ∨ ((a ∨ b) ∧ ¬(a + b)).
        let carry = (self.low & other.low) | ((self.low | other.low) & !low);
        Self {
            low,
            high: self.high + other.high + carry.shr::<31>(),
        }
    }
}

impl<I: Ints> BitXor for Long<I> {
    type Output = Self;

    #[inline(always)]
    fn bitxor(self, other: Self) -> Self {
        Self {
            low: self.low ^ other.low,
            high: self.high ^ other.high,
        }
    }
}
