//! Division of integers in lanes by one that is the same for all.

use super::Ints;

/// A number to divide by, 1 to 2³⁰ and a little above.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Divisor {
    value: u32,
    /// (2³² − 1) / `value`.
    inverse: u32,
}

impl Divisor {
    /// # Panics
    /// Where `value` is 0, or 2³¹ and more.
    pub fn new(value: u32) -> Self {
        assert!((1..1 << 31).contains(&value), "a number to divide by");
        Self {
            value,
            inverse: u32::MAX / value,
        }
    }

    /// The number itself.
    #[inline(always)]
    pub fn value(self) -> u32 {
        self.value
    }

    /// Quotient and remainder.
    #[inline(always)]
    pub fn divide<I: Ints>(self, dividend: I) -> (I, I) {
        // At most one too small: the inverse is, by less than 1, and the product is cut.
        let quotient = dividend.mul_high(I::splat(self.inverse));
        let value = I::splat(self.value);
        let rest = dividend - quotient * value;
        // Below 0 without a sign, where nothing is to be taken off any more.
        let less = rest - value;
        let taken = less.min(rest);
        let more = less.eq(taken);
        let one = quotient + I::splat(1);
        (I::select(more, one, quotient), taken)
    }
}
