//! Lanes in the registers of x86-64.

#![allow(unsafe_code)]

use std::arch::x86_64::*;

pub(super) mod avx2;
pub(super) mod avx512;

/// Operators of a type that holds registers, each a function of the processor's.
macro_rules! operators {
    ($type:ident: $($trait:ident::$method:ident = $function:ident),+) => {$(
        impl std::ops::$trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: see the module.
                unsafe { Self($function(self.0, other.0)) }
            }
        }
    )+};
    // Two registers.
    (pair $type:ident: $($trait:ident::$method:ident = $function:ident),+) => {$(
        impl std::ops::$trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: see the module.
                unsafe { Self($function(self.0, other.0), $function(self.1, other.1)) }
            }
        }
    )+};
}
use operators;

/// See [`super::fetch`].
#[inline(always)]
pub(super) fn fetch<T>(value: &T) {
    // SAFETY: every processor of x86-64 has the instruction, which reads nothing.
    unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(value).cast()) };
}

/// The sum of eight numbers, by halves.
///
/// # Safety
/// The processor has AVX2.
#[inline(always)]
unsafe fn sum_of_eight(numbers: __m256) -> f32 {
    // SAFETY: the caller's word.
    unsafe {
        let four = _mm_add_ps(
            _mm256_castps256_ps128(numbers),
            _mm256_extractf128_ps::<1>(numbers),
        );
        let two = _mm_add_ps(four, _mm_movehl_ps(four, four));
        _mm_cvtss_f32(_mm_add_ss(two, _mm_movehdup_ps(two)))
    }
}
