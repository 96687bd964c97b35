//! Sixteen lanes in the registers of AVX-512.
//!
//! SAFETY, for all blocks: the types of this file are made by [`run`] alone, whose caller has the instructions, and
//! every function here is expanded into what that calls.

#![allow(unsafe_code)]

use std::arch::x86_64::*;
use std::ops::{BitAnd, BitOr, BitXor, Neg, Not};

use super::operators;
use crate::lanes::{Call, Doubles, Ints, Lanes, Mask, SMALL_TABLE, Task, last_of};

/// Does `task` over sixteen lanes.
///
/// # Safety
/// The processor has the instructions.
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
pub(in crate::lanes) unsafe fn run<T: Task>(task: T) -> T::Output {
    task.run::<F32x16>()
}

/// # Safety
/// The processor has the instructions.
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
#[inline(never)]
unsafe fn call<T: Call<F32x16>>(call: T) -> T::Output {
    call.run()
}

#[derive(Clone, Copy, Debug)]
pub(in crate::lanes) struct F32x16(__m512);
#[derive(Clone, Copy, Debug)]
pub(in crate::lanes) struct U32x16(__m512i);
#[derive(Clone, Copy, Debug)]
pub(in crate::lanes) struct M16(__mmask16);
/// Lanes 0 to 7, and 8 to 15.
#[derive(Clone, Copy, Debug)]
pub(in crate::lanes) struct F64x16(__m512d, __m512d);

operators!(F32x16: Add::add = _mm512_add_ps, Sub::sub = _mm512_sub_ps, Mul::mul = _mm512_mul_ps, Div::div = _mm512_div_ps);
operators!(U32x16: Add::add = _mm512_add_epi32, Sub::sub = _mm512_sub_epi32, Mul::mul = _mm512_mullo_epi32,
    BitAnd::bitand = _mm512_and_si512, BitOr::bitor = _mm512_or_si512, BitXor::bitxor = _mm512_xor_si512);
operators!(pair F64x16: Add::add = _mm512_add_pd, Sub::sub = _mm512_sub_pd, Mul::mul = _mm512_mul_pd, Div::div = _mm512_div_pd);

impl Neg for F32x16 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm512_xor_ps(self.0, _mm512_set1_ps(-0.0))) }
    }
}

impl Neg for F64x16 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: see the module.
        unsafe {
            let sign = _mm512_set1_pd(-0.0);
            Self(_mm512_xor_pd(self.0, sign), _mm512_xor_pd(self.1, sign))
        }
    }
}

impl Not for U32x16 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        self ^ Self::splat(u32::MAX)
    }
}

impl Not for M16 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0)
    }
}
impl BitAnd for M16 {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}
impl BitOr for M16 {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}
impl BitXor for M16 {
    type Output = Self;
    #[inline(always)]
    fn bitxor(self, other: Self) -> Self {
        Self(self.0 ^ other.0)
    }
}

impl Mask for M16 {
    #[inline(always)]
    fn from_bits(bits: u32) -> Self {
        Self(bits as u16)
    }
    #[inline(always)]
    fn to_bits(self) -> u32 {
        self.0.into()
    }
}

impl Lanes for F32x16 {
    const WIDTH: usize = 16;
    const ROW: [f32; 16] = [0.0; 16];
    type Row = [f32; 16];
    type Int = U32x16;
    type Mask = M16;
    type Double = F64x16;

    #[inline(always)]
    fn call<T: Call<Self>>(task: T) -> T::Output {
        // SAFETY: see the module.
        unsafe { call(task) }
    }

    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm512_set1_ps(value)) }
    }
    #[inline(always)]
    fn load(row: &Self::Row) -> Self {
        // SAFETY: see the module; a row has sixteen numbers.
        unsafe { Self(_mm512_loadu_ps(row.as_ptr())) }
    }
    #[inline(always)]
    fn store(self, row: &mut Self::Row) {
        // SAFETY: see the module; a row has sixteen numbers.
        unsafe { _mm512_storeu_ps(row.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn from_slice(values: &[f32]) -> Self {
        let values = &values[..16];
        // SAFETY: see the module; there are as many numbers.
        unsafe { Self(_mm512_loadu_ps(values.as_ptr())) }
    }
    #[inline(always)]
    fn store_to(self, values: &mut [f32]) {
        let values = &mut values[..16];
        // SAFETY: see the module; there are as many numbers.
        unsafe { _mm512_storeu_ps(values.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn add_to(self, sums: &mut [f64]) {
        let F64x16(first, second) = self.widen();
        for (sums, numbers) in sums.chunks_mut(8).zip([first, second]) {
            let there = u8::MAX >> (8 - sums.len());
            let sums = sums.as_mut_ptr();
            // SAFETY: see the module; what is not there is left alone.
            unsafe {
                let sum = _mm512_add_pd(_mm512_maskz_loadu_pd(there, sums), numbers);
                _mm512_mask_storeu_pd(sums, there, sum);
            }
        }
    }
    #[inline(always)]
    fn interleave(self, other: Self) -> [Self; 2] {
        // SAFETY: see the module.
        unsafe {
            let first = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
            let second = _mm512_add_epi32(first, _mm512_set1_epi32(8));
            [
                Self(_mm512_permutex2var_ps(self.0, first, other.0)),
                Self(_mm512_permutex2var_ps(self.0, second, other.0)),
            ]
        }
    }
    #[inline(always)]
    fn gather(table: &[f32], index: U32x16) -> Self {
        let index = index.min(U32x16::splat(last_of(table)));
        // SAFETY: see the module; no index is beyond the table, or read as one below 0.
        unsafe { Self(_mm512_i32gather_ps::<4>(index.0, table.as_ptr())) }
    }
    #[inline(always)]
    fn gather_small(table: &[f32; SMALL_TABLE], index: U32x16) -> Self {
        let number = |first: usize| Self::from_slice(&table[first..]).0;
        // SAFETY: see the module; the lowest five bits of an index count.
        let [low, middle, high] = unsafe {
            [
                Self(_mm512_permutex2var_ps(number(0), index.0, number(16))),
                Self(_mm512_permutex2var_ps(number(32), index.0, number(48))),
                Self(_mm512_permutex2var_ps(number(64), index.0, number(80))),
            ]
        };
        let is_low = index.lt(U32x16::splat(32));
        let is_high = !index.lt(U32x16::splat(64));
        Self::select(is_high, high, Self::select(is_low, low, middle))
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
        unsafe { Self(_mm512_sqrt_ps(self.0)) }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm512_abs_ps(self.0)) }
    }
    #[inline(always)]
    fn floor(self) -> Self {
        // SAFETY: see the module.
        unsafe {
            Self(_mm512_roundscale_ps::<
                { _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC },
            >(self.0))
        }
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm512_fmadd_ps(self.0, factor.0, term.0)) }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm512_min_ps(self.0, other.0)) }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm512_max_ps(self.0, other.0)) }
    }

    #[inline(always)]
    fn lt(self, other: Self) -> M16 {
        // SAFETY: see the module.
        unsafe { M16(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0)) }
    }
    #[inline(always)]
    fn le(self, other: Self) -> M16 {
        // SAFETY: see the module.
        unsafe { M16(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0)) }
    }
    #[inline(always)]
    fn eq(self, other: Self) -> M16 {
        // SAFETY: see the module.
        unsafe { M16(_mm512_cmp_ps_mask::<_CMP_EQ_OQ>(self.0, other.0)) }
    }
    #[inline(always)]
    fn select(mask: M16, yes: Self, no: Self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm512_mask_blend_ps(mask.0, no.0, yes.0)) }
    }

    #[inline(always)]
    fn to_bits(self) -> U32x16 {
        // SAFETY: see the module.
        unsafe { U32x16(_mm512_castps_si512(self.0)) }
    }
    #[inline(always)]
    fn to_int(self) -> U32x16 {
        // SAFETY: see the module.
        unsafe { U32x16(_mm512_cvttps_epi32(self.0)) }
    }
    #[inline(always)]
    fn widen(self) -> F64x16 {
        // SAFETY: see the module.
        unsafe {
            let high = _mm512_extractf32x8_ps::<1>(self.0);
            F64x16(
                _mm512_cvtps_pd(_mm512_castps512_ps256(self.0)),
                _mm512_cvtps_pd(high),
            )
        }
    }
}

impl Ints for U32x16 {
    type Row = [u32; 16];
    const ROW: [u32; 16] = [0; 16];
    type Float = F32x16;
    type Mask = M16;

    #[inline(always)]
    fn splat(value: u32) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm512_set1_epi32(value.cast_signed())) }
    }
    #[inline(always)]
    fn load(row: &[u32; 16]) -> Self {
        // SAFETY: see the module; a row has sixteen integers.
        unsafe { Self(_mm512_loadu_si512(row.as_ptr().cast())) }
    }
    #[inline(always)]
    fn store(self, row: &mut [u32; 16]) {
        // SAFETY: see the module; a row has sixteen integers.
        unsafe { _mm512_storeu_si512(row.as_mut_ptr().cast(), self.0) }
    }
    #[inline(always)]
    fn store_to(self, values: &mut [i32]) {
        let values = &mut values[..16];
        // SAFETY: see the module; there are as many integers.
        unsafe { _mm512_storeu_si512(values.as_mut_ptr().cast(), self.0) }
    }
    #[inline(always)]
    fn gather(table: &[u32], index: Self) -> Self {
        let index = index.min(Self::splat(last_of(table)));
        // SAFETY: see the module; no index is beyond the table, or read as one below 0.
        unsafe { Self(_mm512_i32gather_epi32::<4>(index.0, table.as_ptr().cast())) }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm512_min_epu32(self.0, other.0)) }
    }
    #[inline(always)]
    fn mul_high(self, other: Self) -> Self {
        // SAFETY: see the module.
        unsafe {
            let even = _mm512_mul_epu32(self.0, other.0);
            let odd = _mm512_mul_epu32(
                _mm512_srli_epi64::<32>(self.0),
                _mm512_srli_epi64::<32>(other.0),
            );
            Self(_mm512_mask_blend_epi32(
                0xaaaa,
                _mm512_srli_epi64::<32>(even),
                odd,
            ))
        }
    }
    #[inline(always)]
    fn select(mask: M16, yes: Self, no: Self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm512_mask_blend_epi32(mask.0, no.0, yes.0)) }
    }
    #[inline(always)]
    fn shl<const N: u32>(self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm512_slli_epi32::<N>(self.0)) }
    }
    #[inline(always)]
    fn shr<const N: u32>(self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm512_srli_epi32::<N>(self.0)) }
    }
    #[inline(always)]
    fn eq(self, other: Self) -> M16 {
        // SAFETY: see the module.
        unsafe { M16(_mm512_cmpeq_epi32_mask(self.0, other.0)) }
    }
    #[inline(always)]
    fn lt(self, other: Self) -> M16 {
        // SAFETY: see the module.
        unsafe { M16(_mm512_cmplt_epi32_mask(self.0, other.0)) }
    }
    #[inline(always)]
    fn to_float(self) -> F32x16 {
        // SAFETY: see the module.
        unsafe { F32x16(_mm512_cvtepi32_ps(self.0)) }
    }
    #[inline(always)]
    fn from_bits(self) -> F32x16 {
        // SAFETY: see the module.
        unsafe { F32x16(_mm512_castsi512_ps(self.0)) }
    }
}

impl Doubles for F64x16 {
    type Float = F32x16;
    type Int = U32x16;
    type Mask = M16;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm512_set1_pd(value), _mm512_set1_pd(value)) }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm512_sqrt_pd(self.0), _mm512_sqrt_pd(self.1)) }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: see the module.
        unsafe { Self(_mm512_abs_pd(self.0), _mm512_abs_pd(self.1)) }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: see the module.
        unsafe {
            Self(
                _mm512_min_pd(self.0, other.0),
                _mm512_min_pd(self.1, other.1),
            )
        }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: see the module.
        unsafe {
            Self(
                _mm512_max_pd(self.0, other.0),
                _mm512_max_pd(self.1, other.1),
            )
        }
    }
    #[inline(always)]
    fn lt(self, other: Self) -> M16 {
        // SAFETY: see the module.
        unsafe {
            let low = _mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, other.0);
            let high = _mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.1, other.1);
            M16(u16::from(low) | u16::from(high) << 8)
        }
    }
    #[inline(always)]
    fn select(mask: M16, yes: Self, no: Self) -> Self {
        // SAFETY: see the module.
        unsafe {
            Self(
                _mm512_mask_blend_pd(mask.0 as u8, no.0, yes.0),
                _mm512_mask_blend_pd((mask.0 >> 8) as u8, no.1, yes.1),
            )
        }
    }
    #[inline(always)]
    fn narrow(self) -> F32x16 {
        // SAFETY: see the module.
        unsafe {
            let low = _mm512_castps256_ps512(_mm512_cvtpd_ps(self.0));
            F32x16(_mm512_insertf32x8::<1>(low, _mm512_cvtpd_ps(self.1)))
        }
    }
    #[inline(always)]
    fn to_nearest(self) -> U32x16 {
        // SAFETY: see the module.
        unsafe {
            let low = _mm512_castsi256_si512(_mm512_cvtpd_epi32(self.0));
            U32x16(_mm512_inserti64x4::<1>(low, _mm512_cvtpd_epi32(self.1)))
        }
    }
}
