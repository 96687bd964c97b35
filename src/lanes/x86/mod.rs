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
