//! One lane, where the registers of AVX2 serve the channels of a path: the numbers of [`f32`], but what is called knows the
//! instructions.
//!
//! SAFETY, for all blocks: the types of this file are made by [`run`] alone, whose caller has the instructions.

#![allow(unsafe_code)]

use std::num::Wrapping;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Mul, Neg, Not, Sub};

use crate::lanes::{Call, Doubles, Ints, Lanes, MAX_LANES, Task};

/// Does `task` with one lane.
///
/// # Safety
/// The processor has the instructions.
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
pub(in crate::lanes) unsafe fn run<T: Task>(task: T) -> T::Output {
    task.run::<F32x1>()
}

/// # Safety
/// The processor has the instructions.
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
#[inline(never)]
unsafe fn call<T: Call<F32x1>>(call: T) -> T::Output {
    call.run()
}

#[derive(Clone, Copy, Debug)]
pub(in crate::lanes) struct F32x1(f32);
#[derive(Clone, Copy, Debug)]
pub(in crate::lanes) struct U32x1(Wrapping<u32>);
#[derive(Clone, Copy, Debug)]
pub(in crate::lanes) struct F64x1(f64);

/// Operators, as those of what is inside.
macro_rules! operators {
    ($type:ident: $($trait:ident::$method:ident),+; $($sign:ident::$negated:ident)?) => {
        $(impl $trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self($trait::$method(self.0, other.0))
            }
        })+
        $(impl $sign for $type {
            type Output = Self;
            #[inline(always)]
            fn $negated(self) -> Self {
                Self($sign::$negated(self.0))
            }
        })?
    };
}
operators!(F32x1: Add::add, Sub::sub, Mul::mul, Div::div; Neg::neg);
operators!(U32x1: Add::add, Sub::sub, Mul::mul, BitAnd::bitand, BitOr::bitor, BitXor::bitxor; Not::not);
operators!(F64x1: Add::add, Sub::sub, Mul::mul, Div::div; Neg::neg);

/// Methods, as those of what is inside: `new` makes numbers of numbers, `is` answers.
macro_rules! methods {
    ($trait:ident of $inner:ty: $($kind:ident $method:ident($($other:ident),*)),+) => {
        $(methods!(one $kind $trait of $inner, $method($($other),*));)+
    };
    (one new $trait:ident of $inner:ty, $method:ident($($other:ident),*)) => {
        #[inline(always)]
        fn $method(self, $($other: Self),*) -> Self {
            Self(<$inner as $trait>::$method(self.0, $($other.0),*))
        }
    };
    (one is $trait:ident of $inner:ty, $method:ident($($other:ident),*)) => {
        #[inline(always)]
        fn $method(self, $($other: Self),*) -> bool {
            <$inner as $trait>::$method(self.0, $($other.0),*)
        }
    };
}

impl Lanes for F32x1 {
    const WIDTH: usize = 1;
    const ROW: [f32; 1] = [0.0; 1];
    type Row = [f32; 1];
    type Int = U32x1;
    type Mask = bool;
    type Double = F64x1;

    #[inline(always)]
    fn call<T: Call<Self>>(task: T) -> T::Output {
        // SAFETY: see the module.
        unsafe { call(task) }
    }

    methods!(Lanes of f32: new sqrt(), new abs(), new floor(), new mul_add(factor, term), new min(other), new max(other),
        is lt(other), is le(other), is eq(other));

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self(value)
    }
    #[inline(always)]
    fn load(row: &Self::Row) -> Self {
        Self(row[0])
    }
    #[inline(always)]
    fn store(self, row: &mut Self::Row) {
        row[0] = self.0;
    }
    #[inline(always)]
    fn from_slice(values: &[f32]) -> Self {
        Self(values[0])
    }
    #[inline(always)]
    fn store_to(self, values: &mut [f32]) {
        values[0] = self.0;
    }
    #[inline(always)]
    fn sum(parts: &[Self; MAX_LANES]) -> f32 {
        <f32 as Lanes>::sum(&parts.map(|part| part.0))
    }
    #[inline(always)]
    fn gather(table: &[f32], index: U32x1) -> Self {
        Self(f32::gather(table, index.0))
    }
    #[inline(always)]
    fn lane(self, _lane: usize) -> f32 {
        self.0
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
    #[inline(always)]
    fn to_bits(self) -> U32x1 {
        U32x1(Lanes::to_bits(self.0))
    }
    #[inline(always)]
    fn to_int(self) -> U32x1 {
        U32x1(self.0.to_int())
    }
    #[inline(always)]
    fn widen(self) -> F64x1 {
        F64x1(self.0.widen())
    }
}

impl Ints for U32x1 {
    type Float = F32x1;
    type Mask = bool;
    type Row = [u32; 1];
    const ROW: [u32; 1] = [0; 1];

    methods!(Ints of Wrapping<u32>: new min(other), new mul_high(other), is eq(other), is lt(other));

    #[inline(always)]
    fn splat(value: u32) -> Self {
        Self(Wrapping(value))
    }
    #[inline(always)]
    fn load(row: &[u32; 1]) -> Self {
        Self(Wrapping(row[0]))
    }
    #[inline(always)]
    fn store(self, row: &mut [u32; 1]) {
        row[0] = self.0.0;
    }
    #[inline(always)]
    fn gather(table: &[u32], index: Self) -> Self {
        Self(Ints::gather(table, index.0))
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
    #[inline(always)]
    fn shl<const N: u32>(self) -> Self {
        Self(Ints::shl::<N>(self.0))
    }
    #[inline(always)]
    fn shr<const N: u32>(self) -> Self {
        Self(Ints::shr::<N>(self.0))
    }
    #[inline(always)]
    fn to_float(self) -> F32x1 {
        F32x1(self.0.to_float())
    }
    #[inline(always)]
    fn from_bits(self) -> F32x1 {
        F32x1(Ints::from_bits(self.0))
    }
}

impl Doubles for F64x1 {
    type Float = F32x1;
    type Int = U32x1;
    type Mask = bool;

    methods!(Doubles of f64: new sqrt(), new abs(), new min(other), new max(other), is lt(other));

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self(value)
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
    #[inline(always)]
    fn narrow(self) -> F32x1 {
        F32x1(self.0.narrow())
    }
    #[inline(always)]
    fn to_nearest(self) -> U32x1 {
        U32x1(self.0.to_nearest())
    }
}
