//! Lanes in the registers of x86-64.

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
