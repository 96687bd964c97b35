//! One lane: plain numbers, on every processor.

use std::num::Wrapping;

use super::{Call, Doubles, Ints, Lanes, Mask, last_of};

impl Lanes for f32 {
    const WIDTH: usize = 1;
    const ROW: [f32; 1] = [0.0; 1];
    type Row = [f32; 1];
    type Int = Wrapping<u32>;
    type Mask = bool;
    type Double = f64;

    #[inline(never)]
    fn call<T: Call<Self>>(call: T) -> T::Output {
        call.run()
    }

    #[inline(always)]
    fn splat(value: f32) -> Self {
        value
    }
    #[inline(always)]
    fn load(row: &Self::Row) -> Self {
        row[0]
    }
    #[inline(always)]
    fn store(self, row: &mut Self::Row) {
        row[0] = self;
    }
    #[inline(always)]
    fn from_slice(values: &[f32]) -> Self {
        values[0]
    }
    #[inline(always)]
    fn store_to(self, values: &mut [f32]) {
        values[0] = self;
    }
    #[inline(always)]
    fn add_to(self, sums: &mut [f64]) {
        sums[0] += f64::from(self);
    }
    #[inline(always)]
    fn interleave(self, other: Self) -> [Self; 2] {
        [self, other]
    }
    #[inline(always)]
    fn gather(table: &[f32], index: Wrapping<u32>) -> Self {
        table[index.0.min(last_of(table)) as usize]
    }
    #[inline(always)]
    fn lane(self, _lane: usize) -> f32 {
        self
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        f32::sqrt(self)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f32::abs(self)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        f32::floor(self)
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        f32::mul_add(self, factor, term)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }

    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }
    #[inline(always)]
    fn eq(self, other: Self) -> bool {
        self == other
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }

    #[inline(always)]
    fn to_bits(self) -> Wrapping<u32> {
        Wrapping(f32::to_bits(self))
    }
    #[inline(always)]
    fn to_int(self) -> Wrapping<u32> {
        Wrapping((self as i32).cast_unsigned())
    }
    #[inline(always)]
    fn widen(self) -> f64 {
        self.into()
    }
}

impl Ints for Wrapping<u32> {
    type Float = f32;
    type Mask = bool;
    type Row = [u32; 1];
    const ROW: [u32; 1] = [0; 1];

    #[inline(always)]
    fn splat(value: u32) -> Self {
        Self(value)
    }
    #[inline(always)]
    fn load(row: &[u32; 1]) -> Self {
        Self(row[0])
    }
    #[inline(always)]
    fn store(self, row: &mut [u32; 1]) {
        row[0] = self.0;
    }
    #[inline(always)]
    fn store_to(self, values: &mut [i32]) {
        values[0] = self.0.cast_signed();
    }
    #[inline(always)]
    fn gather(table: &[u32], index: Self) -> Self {
        Self(table[index.0.min(last_of(table)) as usize])
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(self.0.min(other.0))
    }
    #[inline(always)]
    fn mul_high(self, other: Self) -> Self {
        Self(((u64::from(self.0) * u64::from(other.0)) >> 32) as u32)
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
    #[inline(always)]
    fn shl<const N: u32>(self) -> Self {
        Self(self.0 << N)
    }
    #[inline(always)]
    fn shr<const N: u32>(self) -> Self {
        Self(self.0 >> N)
    }
    #[inline(always)]
    fn eq(self, other: Self) -> bool {
        self == other
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self.0.cast_signed() < other.0.cast_signed()
    }
    #[inline(always)]
    fn to_float(self) -> f32 {
        self.0.cast_signed() as f32
    }
    #[inline(always)]
    fn from_bits(self) -> f32 {
        f32::from_bits(self.0)
    }
}

impl Mask for bool {
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        bits & 1 == 1
    }
    #[inline(always)]
    fn to_bits(self) -> u32 {
        self.into()
    }
}

impl Doubles for f64 {
    type Float = f32;
    type Int = Wrapping<u32>;
    type Mask = bool;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
    #[inline(always)]
    fn narrow(self) -> f32 {
        self as f32
    }
    #[inline(always)]
    fn to_nearest(self) -> Wrapping<u32> {
        // What is added and taken away rounds to whole numbers, half to even.
        const WHOLE: f64 = 1.5 * (1_u64 << 52) as f64;
        Wrapping(((self + WHOLE - WHOLE) as i32).cast_unsigned())
    }
}
