//! Numbers in lanes: one operation for many paths at once.
//!
//! What is written over [`Lanes`] is written once, and reads as it would for single numbers, with `select` in place
//! of `if`. It is compiled for each set of instructions: for AVX-512 over sixteen lanes, for AVX2 over eight, and for
//! every processor over one, the plain [`f32`]. A lane's value never depends on another lane's, and no operation but
//! those of IEEE 754 is used, so that all give the same bits.
//!
//! The types of other widths are known to this module alone: generic code comes to them through [`Kernel::run`], which
//! has asked the processor. That is what makes their operations safe to call.
//!
//! Everything that is written over lanes must be `#[inline(always)]`, closures avoided: a function that is called, and
//! not expanded, where the instructions are known is compiled without them, and is an order of magnitude slower.
//! [`Lanes::call`] is the way to call one: it begins a function that knows the instructions again.

mod divisor;
mod elementary;
mod frame;
mod kernel;
mod long;
pub mod random;
mod single;
mod vector;
pub mod warp;
#[cfg(target_arch = "x86_64")]
mod x86;

use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitOr, BitXor, Div, Index, IndexMut, Mul, Neg, Not, Sub};

use crate::math::moving;
pub use divisor::Divisor;
pub use elementary::{
    acos, atan2, erf, erf_inverse, exp, ln, ln_bessel_i0, pow, sin_cos, sin_cos_turns,
};
pub use frame::Frame;
pub use kernel::{Kernel, Set};
pub use long::Long;
pub use vector::{Vec2, Vec3};

/// No lanes are more.
pub const MAX_LANES: usize = 16;

/// No table from which lanes gather has more entries.
pub const MAX_TABLE: usize = 1 << 31;

/// Tables of so many entries fit into registers.
pub const SMALL_TABLE: usize = 96;

/// Asks for a value's memory ahead, as far as it lies where the value begins.
#[inline(always)]
pub fn fetch<T>(value: &T) {
    #[cfg(target_arch = "x86_64")]
    x86::fetch(value);
    #[cfg(not(target_arch = "x86_64"))]
    let _ = value;
}

/// The sum of terms: those of the second half are added to those of the first, and so on.
#[inline(always)]
pub fn sum_by_halves<F: Lanes>(mut terms: [F; MAX_LANES]) -> F {
    let mut half = MAX_LANES / 2;
    while half > 0 {
        for i in 0..half {
            terms[i] = terms[i] + terms[i + half];
        }
        half /= 2;
    }
    terms[0]
}

/// The index of a table's last entry.
#[inline(always)]
fn last_of<T>(table: &[T]) -> u32 {
    assert!(
        (1..=MAX_TABLE).contains(&table.len()),
        "a table to gather from"
    );
    (table.len() - 1) as u32
}

/// Something to be done over lanes of some width. `run` must be `#[inline(always)]`.
pub trait Task {
    /// What comes of it.
    type Output;

    /// Does it.
    fn run<F: Lanes>(self) -> Self::Output;
}

/// The same where the width is known already. `run` must be `#[inline(always)]`.
pub trait Call<F> {
    /// What comes of it.
    type Output;

    /// Does it.
    fn run(self) -> Self::Output;
}

/// Single-precision numbers, one a lane.
pub trait Lanes:
    Copy
    + Debug
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// How many lanes.
    const WIDTH: usize;
    /// A number for each lane: the way in and out.
    type Row: Copy + Debug + Index<usize, Output = f32> + IndexMut<usize> + AsRef<[f32]>;
    /// Zeros.
    const ROW: Self::Row;
    /// As many integers.
    type Int: Ints<Float = Self, Mask = Self::Mask>;
    /// As many answers.
    type Mask: Mask;
    /// As many numbers of double precision.
    type Double: Doubles<Float = Self, Int = Self::Int, Mask = Self::Mask>;

    /// Does `call` in a function of its own that knows the instructions.
    fn call<T: Call<Self>>(call: T) -> T::Output;

    /// The same number in all lanes.
    fn splat(value: f32) -> Self;
    /// The numbers of a row.
    fn load(row: &Self::Row) -> Self;
    /// To a row.
    fn store(self, row: &mut Self::Row);
    /// The first numbers of a slice.
    ///
    /// # Panics
    /// Where there are fewer than lanes.
    fn from_slice(values: &[f32]) -> Self;
    /// To the first numbers of a slice.
    ///
    /// # Panics
    /// Where there are fewer than lanes.
    fn store_to(self, values: &mut [f32]);
    /// Adds the first numbers to those of a slice, which has no more than lanes.
    fn add_to(self, sums: &mut [f64]);
    /// Numbers of both in turns, `self`'s first: of the first half of lanes, and of the second.
    fn interleave(self, other: Self) -> [Self; 2];
    /// The entries of a table; what is beyond its end is its last.
    ///
    /// # Panics
    /// Where the table is empty, or has more than [`MAX_TABLE`] entries.
    fn gather(table: &[f32], index: Self::Int) -> Self;
    /// The same of a small table, by indices within it.
    #[inline(always)]
    fn gather_small(table: &[f32; SMALL_TABLE], index: Self::Int) -> Self {
        Self::gather(table, index)
    }
    /// One lane's number.
    fn lane(self, lane: usize) -> f32;

    /// The square root.
    fn sqrt(self) -> Self;
    /// Without its sign.
    fn abs(self) -> Self;
    /// The greatest integer that is not above.
    fn floor(self) -> Self;
    /// `self · factor + term`, rounded once. Processors without an instruction for it take long, so that boxes alone are
    /// met by it.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// `self` where it is less, else `other`.
    fn min(self, other: Self) -> Self;
    /// `self` where it is greater, else `other`.
    fn max(self, other: Self) -> Self;

    /// Where it is less.
    fn lt(self, other: Self) -> Self::Mask;
    /// Where it is less or equal.
    fn le(self, other: Self) -> Self::Mask;
    /// Where it is equal.
    fn eq(self, other: Self) -> Self::Mask;
    /// `yes` where the mask is set, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// Its bits.
    fn to_bits(self) -> Self::Int;
    /// Without its fraction; within ±2³¹.
    fn to_int(self) -> Self::Int;
    /// In double precision.
    fn widen(self) -> Self::Double;

    /// Exchanges rows and lanes of a square, whose rows are as many of the first as there are lanes.
    #[inline(always)]
    fn transpose(square: &mut [Self; MAX_LANES]) {
        // Each round turns the bits of a number's place, row above lane, by one.
        let (half, mut rounds) = (Self::WIDTH / 2, Self::WIDTH.ilog2());
        while rounds > 0 {
            let rows = *square;
            for i in 0..half {
                [square[2 * i], square[2 * i + 1]] = rows[i].interleave(rows[i + half]);
            }
            rounds -= 1;
        }
    }
    /// A row of its lanes.
    #[inline(always)]
    fn row(self) -> Self::Row {
        let mut row = Self::ROW;
        self.store(&mut row);
        row
    }
    /// Nothing.
    #[inline(always)]
    fn zero() -> Self {
        Self::splat(0.0)
    }
    /// One.
    #[inline(always)]
    fn one() -> Self {
        Self::splat(1.0)
    }
    /// Where it is greater.
    #[inline(always)]
    fn gt(self, other: Self) -> Self::Mask {
        other.lt(self)
    }
    /// Where it is greater or equal.
    #[inline(always)]
    fn ge(self, other: Self) -> Self::Mask {
        other.le(self)
    }
    /// Between `least` and `most`; what is no number becomes `least`.
    #[inline(always)]
    fn clamp(self, least: f32, most: f32) -> Self {
        self.max(Self::splat(least)).min(Self::splat(most))
    }
    /// Its square.
    #[inline(always)]
    fn squared(self) -> Self {
        self * self
    }
    /// Where it is finite.
    #[inline(always)]
    fn is_finite(self) -> Self::Mask {
        self.abs().lt(Self::splat(f32::INFINITY))
    }
    /// With the sign of another.
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        let bit = Self::Int::splat(SIGN);
        let magnitude = self.to_bits() & !bit;
        (magnitude | (sign.to_bits() & bit)).from_bits()
    }
    /// A number for each lane.
    #[inline(always)]
    fn from_fn(mut number: impl FnMut(usize) -> f32) -> Self {
        let mut row = Self::ROW;
        for lane in 0..Self::WIDTH {
            row[lane] = number(lane);
        }
        Self::load(&row)
    }
}

/// The bit that is a number's sign.
const SIGN: u32 = 1 << 31;

/// Integers of 32 bits, one a lane, that wrap around.
pub trait Ints:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + BitXor<Output = Self>
    + Not<Output = Self>
{
    /// As many numbers.
    type Float;
    /// As many answers.
    type Mask;

    /// An integer for each lane.
    type Row: Copy + Debug + Index<usize, Output = u32> + IndexMut<usize>;
    /// Zeros.
    const ROW: Self::Row;

    /// The same in all lanes.
    fn splat(value: u32) -> Self;
    /// The integers of a row.
    fn load(row: &Self::Row) -> Self;
    /// To a row.
    fn store(self, row: &mut Self::Row);
    /// To the first numbers of a slice, with a sign.
    ///
    /// # Panics
    /// Where there are fewer than lanes.
    fn store_to(self, values: &mut [i32]);
    /// The entries of a table, as [`Lanes::gather`].
    fn gather(table: &[u32], index: Self) -> Self;
    /// `self` where it is less, else `other`, both without a sign.
    fn min(self, other: Self) -> Self;
    /// Bits 32 to 63 of the product, both without a sign.
    fn mul_high(self, other: Self) -> Self;
    /// `yes` where the mask is set, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// With zeros from below.
    fn shl<const N: u32>(self) -> Self;
    /// With zeros from above.
    fn shr<const N: u32>(self) -> Self;
    /// Where it is equal.
    fn eq(self, other: Self) -> Self::Mask;
    /// Where it is less, as numbers with a sign.
    fn lt(self, other: Self) -> Self::Mask;
    /// As a number, which has a sign.
    fn to_float(self) -> Self::Float;
    /// The number with these bits.
    #[expect(clippy::wrong_self_convention)]
    fn from_bits(self) -> Self::Float;

    /// The bits in the other order.
    #[inline(always)]
    fn reverse_bits(self) -> Self {
        let odd = Self::splat(0x5555_5555);
        let x = (self & odd).shl::<1>() | (self.shr::<1>() & odd);
        let pairs = Self::splat(0x3333_3333);
        let x = (x & pairs).shl::<2>() | (x.shr::<2>() & pairs);
        let fours = Self::splat(0x0f0f_0f0f);
        let x = (x & fours).shl::<4>() | (x.shr::<4>() & fours);
        let bytes = Self::splat(0x00ff_00ff);
        let x = (x & bytes).shl::<8>() | (x.shr::<8>() & bytes);
        x.shl::<16>() | x.shr::<16>()
    }
}

/// Yes or no, one a lane.
pub trait Mask:
    Copy
    + Debug
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + BitXor<Output = Self>
    + Not<Output = Self>
{
    /// From a bit a lane.
    fn from_bits(bits: u32) -> Self;
    /// A bit a lane.
    fn to_bits(self) -> u32;

    /// Whether any lane says yes.
    #[inline(always)]
    fn any(self) -> bool {
        self.to_bits() != 0
    }
    /// The lanes that say yes, ascending.
    #[inline(always)]
    fn lanes(self) -> LanesOf {
        LanesOf(self.to_bits())
    }
    /// In all lanes the same.
    #[inline(always)]
    fn splat(value: bool) -> Self {
        Self::from_bits(if value { u32::MAX } else { 0 })
    }
}

/// The lanes of a [`Mask`].
#[derive(Clone, Copy, Debug)]
pub struct LanesOf(u32);

impl Iterator for LanesOf {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let lane = self.0.trailing_zeros() as usize;
        self.0 &= self.0.wrapping_sub(1);
        (lane < 32).then_some(lane)
    }
}

/// Double-precision numbers, one a lane.
pub trait Doubles:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// As many of single precision.
    type Float;
    /// As many integers.
    type Int;
    /// As many answers.
    type Mask;

    /// The same in all lanes.
    fn splat(value: f64) -> Self;
    /// The square root.
    fn sqrt(self) -> Self;
    /// Without its sign.
    fn abs(self) -> Self;
    /// `self` where it is less, else `other`.
    fn min(self, other: Self) -> Self;
    /// `self` where it is greater, else `other`.
    fn max(self, other: Self) -> Self;
    /// Where it is less.
    fn lt(self, other: Self) -> Self::Mask;
    /// `yes` where the mask is set, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// In single precision.
    fn narrow(self) -> Self::Float;
    /// The nearest integers, the even one of two as near; within ±2³¹.
    fn to_nearest(self) -> Self::Int;
}

impl<D: Doubles<Mask: Mask>> moving::Real for D {
    type Mask = <D as Doubles>::Mask;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        Doubles::splat(value)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> <D as Doubles>::Mask {
        Doubles::lt(self, other)
    }
    #[inline(always)]
    fn any_within(self, first: f64, end: f64) -> bool {
        let (first, end) = (Doubles::splat(first), Doubles::splat(end));
        (Doubles::lt(self, end) & !Doubles::lt(self, first)).any()
    }
    #[inline(always)]
    fn select(mask: <D as Doubles>::Mask, yes: Self, no: Self) -> Self {
        Doubles::select(mask, yes, no)
    }
}

#[cfg(test)]
mod tests;
