//! Eight lanes in the registers of AVX2. A mask is a register too, all bits of a lane alike: turning it into bits takes
//! time, and is done where bits are asked for.
//!
//! SAFETY, for all blocks: the types of this file are made by [`run`] alone, whose caller has the instructions, and
//! every function here is expanded into what that calls.

#![allow(unsafe_code)]

use std::arch::x86_64::*;
use std::ops::{Neg, Not};

use super::operators;
use crate::lanes::{Call, Doubles, Ints, Lanes, Mask, Task, last_of};

/// Does `task` over eight lanes.
///
/// # Safety
/// The processor has the instructions.
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
pub(in crate::lanes) unsafe fn run<T: Task>(task: T) -> T::Output {
    task.run::<F32x8>()
}

/// # Safety
/// The processor has the instructions.
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
#[inline(never)]
unsafe fn call<T: Call<F32x8>>(call: T) -> T::Output {
    call.run()
}

#[derive(Clone, Copy, Debug)]
pub(in crate::lanes) struct F32x8(__m256);
#[derive(Clone, Copy, Debug)]
pub(in crate::lanes) struct U32x8(__m256i);
#[derive(Clone, Copy, Debug)]
pub(in crate::lanes) struct M8(__m256);
/// Lanes 0 to 3, and 4 to 7.
#[derive(Clone, Copy, Debug)]
pub(in crate::lanes) struct F64x8(__m256d, __m256d);

operators!(F32x8: Add::add = _mm256_add_ps, Sub::sub = _mm256_sub_ps, Mul::mul = _mm256_mul_ps, Div::div = _mm256_div_ps);
operators!(U32x8: Add::add = _mm256_add_epi32, Sub::sub = _mm256_sub_epi32, Mul::mul = _mm256_mullo_epi32,
    BitAnd::bitand = _mm256_and_si256, BitOr::bitor = _mm256_or_si256, BitXor::bitxor = _mm256_xor_si256);
operators!(M8: BitAnd::bitand = _mm256_and_ps, BitOr::bitor = _mm256_or_ps, BitXor::bitxor = _mm256_xor_ps);
operators!(pair F64x8: Add::add = _mm256_add_pd, Sub::sub = _mm256_sub_pd, Mul::mul = _mm256_mul_pd, Div::div = _mm256_div_pd);

impl Neg for F32x8 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm256_xor_ps(self.0, _mm256_set1_ps(-0.0))) }
    }
}

impl Neg for F64x8 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: see the module.
        unsafe {
            let sign = _mm256_set1_pd(-0.0);
            Self(_mm256_xor_pd(self.0, sign), _mm256_xor_pd(self.1, sign))
        }
    }
}

impl Not for U32x8 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        self ^ Self::splat(u32::MAX)
    }
}

impl Not for M8 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        self ^ Self::splat(true)
    }
}

impl Mask for M8 {
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        // SAFETY: see the module.
        unsafe {
            let lane = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
            let bits = _mm256_and_si256(_mm256_set1_epi32(bits.cast_signed()), lane);
            Self(_mm256_castsi256_ps(_mm256_cmpeq_epi32(bits, lane)))
        }
    }
    #[inline(always)]
    fn to_bits(self) -> u32 {
        // SAFETY: see the module.
        unsafe { _mm256_movemask_ps(self.0).cast_unsigned() }
    }
}

impl Lanes for F32x8 {
    const WIDTH: usize = 8;
    const ROW: [f32; 8] = [0.0; 8];
    type Row = [f32; 8];
    type Int = U32x8;
    type Mask = M8;
    type Double = F64x8;

    #[inline(always)]
    fn call<T: Call<Self>>(task: T) -> T::Output {
        // SAFETY: see the module.
        unsafe { call(task) }
    }

    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm256_set1_ps(value)) }
    }
    #[inline(always)]
    fn load(row: &Self::Row) -> Self {
        // SAFETY: see the module; a row has eight numbers.
        unsafe { Self(_mm256_loadu_ps(row.as_ptr())) }
    }
    #[inline(always)]
    fn store(self, row: &mut Self::Row) {
        // SAFETY: see the module; a row has eight numbers.
        unsafe { _mm256_storeu_ps(row.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn from_slice(values: &[f32]) -> Self {
        let values = &values[..8];
        // SAFETY: see the module; there are as many numbers.
        unsafe { Self(_mm256_loadu_ps(values.as_ptr())) }
    }
    #[inline(always)]
    fn store_to(self, values: &mut [f32]) {
        let values = &mut values[..8];
        // SAFETY: see the module; there are as many numbers.
        unsafe { _mm256_storeu_ps(values.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn add_to(self, sums: &mut [f64]) {
        let (numbers, F64x8(first, second)) = (self.row(), self.widen());
        for (i, (sums, four)) in sums.chunks_mut(4).zip([first, second]).enumerate() {
            if sums.len() == 4 {
                let sums = sums.as_mut_ptr();
                // SAFETY: see the module; there are four.
                unsafe { _mm256_storeu_pd(sums, _mm256_add_pd(_mm256_loadu_pd(sums), four)) };
            } else {
                for (sum, number) in sums.iter_mut().zip(&numbers[4 * i..]) {
                    *sum += f64::from(*number);
                }
            }
        }
    }
    #[inline(always)]
    fn interleave(self, other: Self) -> [Self; 2] {
        // SAFETY: see the module.
        unsafe {
            let low = _mm256_unpacklo_ps(self.0, other.0);
            let high = _mm256_unpackhi_ps(self.0, other.0);
            [
                Self(_mm256_permute2f128_ps::<0x20>(low, high)),
                Self(_mm256_permute2f128_ps::<0x31>(low, high)),
            ]
        }
    }
    #[inline(always)]
    fn gather(table: &[f32], index: U32x8) -> Self {
        let index = index.min(U32x8::splat(last_of(table)));
        // SAFETY: see the module; no index is beyond the table, or read as one below 0.
        unsafe { Self(_mm256_i32gather_ps::<4>(table.as_ptr(), index.0)) }
    }
    #[inline(always)]
    fn lane(self, lane: usize) -> f32 {
        let mut row = Self::ROW;
        self.store(&mut row);
        row[lane]
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm256_sqrt_ps(self.0)) }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0)) }
    }
    #[inline(always)]
    fn floor(self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm256_floor_ps(self.0)) }
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm256_fmadd_ps(self.0, factor.0, term.0)) }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm256_min_ps(self.0, other.0)) }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm256_max_ps(self.0, other.0)) }
    }

    #[inline(always)]
    fn lt(self, other: Self) -> M8 {
        // SAFETY: see the module.
        unsafe { M8(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0)) }
    }
    #[inline(always)]
    fn le(self, other: Self) -> M8 {
        // SAFETY: see the module.
        unsafe { M8(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0)) }
    }
    #[inline(always)]
    fn eq(self, other: Self) -> M8 {
        // SAFETY: see the module.
        unsafe { M8(_mm256_cmp_ps::<_CMP_EQ_OQ>(self.0, other.0)) }
    }
    #[inline(always)]
    fn select(mask: M8, yes: Self, no: Self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm256_blendv_ps(no.0, yes.0, mask.0)) }
    }

    #[inline(always)]
    fn to_bits(self) -> U32x8 {
        // SAFETY: see the module.
        unsafe { U32x8(_mm256_castps_si256(self.0)) }
    }
    #[inline(always)]
    fn to_int(self) -> U32x8 {
        // SAFETY: see the module.
        unsafe { U32x8(_mm256_cvttps_epi32(self.0)) }
    }
    #[inline(always)]
    fn widen(self) -> F64x8 {
        // SAFETY: see the module.
        unsafe {
            let high = _mm256_extractf128_ps::<1>(self.0);
            F64x8(
                _mm256_cvtps_pd(_mm256_castps256_ps128(self.0)),
                _mm256_cvtps_pd(high),
            )
        }
    }
}

impl Ints for U32x8 {
    type Row = [u32; 8];
    const ROW: [u32; 8] = [0; 8];
    type Float = F32x8;
    type Mask = M8;

    #[inline(always)]
    fn splat(value: u32) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm256_set1_epi32(value.cast_signed())) }
    }
    #[inline(always)]
    fn load(row: &[u32; 8]) -> Self {
        // SAFETY: see the module; a row has eight integers.
        unsafe { Self(_mm256_loadu_si256(row.as_ptr().cast())) }
    }
    #[inline(always)]
    fn store(self, row: &mut [u32; 8]) {
        // SAFETY: see the module; a row has eight integers.
        unsafe { _mm256_storeu_si256(row.as_mut_ptr().cast(), self.0) }
    }
    #[inline(always)]
    fn store_to(self, values: &mut [i32]) {
        let values = &mut values[..8];
        // SAFETY: see the module; there are as many integers.
        unsafe { _mm256_storeu_si256(values.as_mut_ptr().cast(), self.0) }
    }
    #[inline(always)]
    fn gather(table: &[u32], index: Self) -> Self {
        let index = index.min(Self::splat(last_of(table)));
        // SAFETY: see the module; no index is beyond the table, or read as one below 0.
        unsafe { Self(_mm256_i32gather_epi32::<4>(table.as_ptr().cast(), index.0)) }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm256_min_epu32(self.0, other.0)) }
    }
    #[inline(always)]
    fn mul_high(self, other: Self) -> Self {
        // SAFETY: see the module.
        unsafe {
            let even = _mm256_mul_epu32(self.0, other.0);
            let odd = _mm256_mul_epu32(
                _mm256_srli_epi64::<32>(self.0),
                _mm256_srli_epi64::<32>(other.0),
            );
            Self(_mm256_blend_epi32::<0b1010_1010>(
                _mm256_srli_epi64::<32>(even),
                odd,
            ))
        }
    }
    #[inline(always)]
    fn select(mask: M8, yes: Self, no: Self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm256_blendv_epi8(no.0, yes.0, _mm256_castps_si256(mask.0))) }
    }
    #[inline(always)]
    fn shl<const N: u32>(self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm256_sll_epi32(self.0, _mm_cvtsi32_si128(N as i32))) }
    }
    #[inline(always)]
    fn shr<const N: u32>(self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm256_srl_epi32(self.0, _mm_cvtsi32_si128(N as i32))) }
    }
    #[inline(always)]
    fn eq(self, other: Self) -> M8 {
        // SAFETY: see the module.
        unsafe { M8(_mm256_castsi256_ps(_mm256_cmpeq_epi32(self.0, other.0))) }
    }
    #[inline(always)]
    fn lt(self, other: Self) -> M8 {
        // SAFETY: see the module.
        unsafe { M8(_mm256_castsi256_ps(_mm256_cmpgt_epi32(other.0, self.0))) }
    }
    #[inline(always)]
    fn to_float(self) -> F32x8 {
        // SAFETY: see the module.
        unsafe { F32x8(_mm256_cvtepi32_ps(self.0)) }
    }
    #[inline(always)]
    fn from_bits(self) -> F32x8 {
        // SAFETY: see the module.
        unsafe { F32x8(_mm256_castsi256_ps(self.0)) }
    }
}

/// The lanes of a mask of single precision, widened: the lower four, and the upper four.
///
/// # Safety
/// The processor has AVX2.
#[inline(always)]
unsafe fn halves(mask: M8) -> (__m256d, __m256d) {
    // SAFETY: the caller's word.
    unsafe {
        let bits = _mm256_castps_si256(mask.0);
        let low = _mm256_cvtepi32_epi64(_mm256_castsi256_si128(bits));
        let high = _mm256_cvtepi32_epi64(_mm256_extracti128_si256::<1>(bits));
        (_mm256_castsi256_pd(low), _mm256_castsi256_pd(high))
    }
}

impl Doubles for F64x8 {
    type Float = F32x8;
    type Int = U32x8;
    type Mask = M8;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm256_set1_pd(value), _mm256_set1_pd(value)) }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm256_sqrt_pd(self.0), _mm256_sqrt_pd(self.1)) }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: see the module.
        unsafe {
            let sign = _mm256_set1_pd(-0.0);
            Self(
                _mm256_andnot_pd(sign, self.0),
                _mm256_andnot_pd(sign, self.1),
            )
        }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: see the module.
        unsafe {
            Self(
                _mm256_min_pd(self.0, other.0),
                _mm256_min_pd(self.1, other.1),
            )
        }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: see the module.
        unsafe {
            Self(
                _mm256_max_pd(self.0, other.0),
                _mm256_max_pd(self.1, other.1),
            )
        }
    }
    #[inline(always)]
    fn lt(self, other: Self) -> M8 {
        // SAFETY: see the module. Of each lane of 64 bits the lower half is taken, which the packing of
        // single-precision halves puts in the order 0 1 4 5 2 3 6 7.
        unsafe {
            let low = _mm256_castpd_ps(_mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0));
            let high = _mm256_castpd_ps(_mm256_cmp_pd::<_CMP_LT_OQ>(self.1, other.1));
            let packed = _mm256_shuffle_ps::<0b10_00_10_00>(low, high);
            M8(_mm256_castpd_ps(_mm256_permute4x64_pd::<0b11_01_10_00>(
                _mm256_castps_pd(packed),
            )))
        }
    }
    #[inline(always)]
    fn select(mask: M8, yes: Self, no: Self) -> Self {
        // SAFETY: see the module.
        unsafe {
            let (low, high) = halves(mask);
            Self(
                _mm256_blendv_pd(no.0, yes.0, low),
                _mm256_blendv_pd(no.1, yes.1, high),
            )
        }
    }
    #[inline(always)]
    fn narrow(self) -> F32x8 {
        // SAFETY: see the module.
        unsafe {
            let low = _mm256_castps128_ps256(_mm256_cvtpd_ps(self.0));
            F32x8(_mm256_insertf128_ps::<1>(low, _mm256_cvtpd_ps(self.1)))
        }
    }
    #[inline(always)]
    fn to_nearest(self) -> U32x8 {
        // SAFETY: see the module.
        unsafe {
            let low = _mm256_castsi128_si256(_mm256_cvtpd_epi32(self.0));
            U32x8(_mm256_inserti128_si256::<1>(
                low,
                _mm256_cvtpd_epi32(self.1),
            ))
        }
    }
}
