//! The random numbers of [`crate::math::random`] in lanes, to the bit.

use super::{Divisor, Ints, Lanes, Long, Mask as _};
use crate::math::random::{FACTORS, STEP};

/// [`crate::math::random::mix`].
#[inline(always)]
pub fn mix<I: Ints>(x: Long<I>) -> Long<I> {
    let x = x.xor_shr::<30, 2>().times(FACTORS[0]);
    let x = x.xor_shr::<27, 5>().times(FACTORS[1]);
    x.xor_shr::<31, 1>()
}

/// [`crate::math::random::bits`] of one dimension.
#[inline(always)]
pub fn bits<I: Ints>(key: Long<I>, dimension: u32) -> Long<I> {
    mix(key + Long::splat(STEP.wrapping_mul(u64::from(dimension) + 1)))
}

/// [`crate::math::random::bits`] of a dimension a lane.
#[inline(always)]
pub fn bits_along<I: Ints>(key: Long<I>, dimension: I) -> Long<I> {
    mix(key + Long::from(dimension).times(STEP) + Long::splat(STEP))
}

/// [`crate::math::random::unit`] of bits of which these are the upper half.
#[inline(always)]
pub fn unit<F: Lanes>(high: F::Int) -> F {
    high.shr::<8>().to_float() * F::splat(1.0 / 16_777_216.0)
}

/// Where index `i` of `n` goes in the permutation of 0..n that `key` selects; `i < n`.
///
/// Kensler, *Correlated multi-jittered sampling* (2013): a bijection of the next power of two, walked
/// until it lands inside the range.
#[inline(always)]
pub fn permute<F: Lanes>(i: F::Int, n: Divisor, key: Long<F::Int>) -> F::Int {
    let count = n.value();
    if count == 1 {
        return F::Int::splat(0);
    }
    let w = F::Int::splat(u32::MAX >> (count - 1).leading_zeros());
    let p = key.low ^ key.high;
    let factor = F::Int::splat(1) | p.shr::<27>();
    let count = F::Int::splat(count);
    let (mut found, mut outside) = (i, F::Mask::splat(true));
    loop {
        let mut i = found ^ p;
        i = i * F::Int::splat(0xe170_893d);
        i = i ^ p.shr::<16>();
        i = i ^ (i & w).shr::<4>();
        i = i ^ p.shr::<8>();
        i = i * F::Int::splat(0x0929_eb3f);
        i = i ^ p.shr::<23>();
        i = i ^ (i & w).shr::<1>();
        i = i * factor;
        i = i * F::Int::splat(0x6935_fa69);
        i = i ^ (i & w).shr::<11>();
        i = i * F::Int::splat(0x74dc_b303);
        i = i ^ (i & w).shr::<2>();
        i = i * F::Int::splat(0x9e50_1cc3);
        i = i ^ (i & w).shr::<2>();
        i = i * F::Int::splat(0xc860_a3df);
        i = i & w;
        i = i ^ i.shr::<5>();
        found = F::Int::select(outside, i, found);
        outside = outside & !found.lt(count);
        if !outside.any() {
            break;
        }
    }
    // (i + p) mod n.
    let back = count - n.divide(p).1;
    let around = found.lt(back);
    found - F::Int::select(around, back - count, back)
}
