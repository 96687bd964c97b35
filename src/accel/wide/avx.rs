//! The kernels for AVX2 and AVX-512: eight children or four triangles at once. They differ in how lanes
//! are compared and packed; everything else is one source.
//!
//! All functions are expanded into the walk that uses them, which is compiled for their instructions: a
//! call would lose what they gain. Nothing is fused: see [`Shear`](crate::accel::triangle::Shear).

#![allow(unsafe_code)]

use std::arch::x86_64::*;
use std::hint::select_unpredictable;

use super::kernel::Lanes;
use super::node::{BLOCK, Block, Node};
use super::state::State;
use crate::accel::boxes::WIDEN;

/// Comparing and packing lanes.
///
/// # Safety
/// As [`Lanes`].
unsafe trait Pack: Copy {
    /// A bit for each lane where `a` ≤ `b`.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn at_most(a: __m256, b: __m256) -> u32;
    /// The lanes of `mask`, moved together.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn pack(mask: u32, names: __m256i, distances: __m256) -> (__m256i, __m256);
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Avx2;

#[derive(Clone, Copy, Debug)]
pub(super) struct Avx512;

/// For each mask, the lanes that it has, one a byte.
static PACKED: [u64; 256] = {
    let mut table = [0; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut count) = (0, 0);
        while lane < 8 {
            if mask >> lane & 1 == 1 {
                table[mask] |= (lane as u64) << (8 * count);
                count += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
};

// SAFETY: the functions are expanded where AVX2 may be used.
unsafe impl Pack for Avx2 {
    #[inline(always)]
    unsafe fn at_most(a: __m256, b: __m256) -> u32 {
        // SAFETY: the caller has AVX2.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b)) as u32 }
    }

    #[inline(always)]
    unsafe fn pack(mask: u32, names: __m256i, distances: __m256) -> (__m256i, __m256) {
        // SAFETY: the caller has AVX2; a mask has eight bits.
        unsafe {
            let lanes = *PACKED.get_unchecked(mask as usize);
            let lanes = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(lanes as i64));
            (
                _mm256_permutevar8x32_epi32(names, lanes),
                _mm256_permutevar8x32_ps(distances, lanes),
            )
        }
    }
}

// SAFETY: the functions are expanded where AVX-512 F and VL may be used.
unsafe impl Pack for Avx512 {
    #[inline(always)]
    unsafe fn at_most(a: __m256, b: __m256) -> u32 {
        // SAFETY: the caller has AVX-512.
        unsafe { u32::from(_mm256_cmp_ps_mask::<_CMP_LE_OQ>(a, b)) }
    }

    #[inline(always)]
    unsafe fn pack(mask: u32, names: __m256i, distances: __m256) -> (__m256i, __m256) {
        // SAFETY: the caller has AVX-512.
        unsafe {
            (
                _mm256_maskz_compress_epi32(mask as u8, names),
                _mm256_maskz_compress_ps(mask as u8, distances),
            )
        }
    }
}

// SAFETY: the functions are expanded where the instructions of `P` may be used, all at least AVX2.
unsafe impl<P: Pack> Lanes for P {
    #[inline(always)]
    unsafe fn enter<const ANY: bool>(
        node: &Node,
        ray: &State,
        distances: *mut f32,
        references: *mut u32,
    ) -> u32 {
        // SAFETY: the caller has AVX2 and room for eight entries; `ray.near` holds offsets of slabs of
        // the node, whose neighbours are 32 bytes away.
        unsafe {
            let slabs = node.slabs.as_ptr().cast::<u8>();
            let slab = |offset: u32| slabs.add(offset as usize).cast::<f32>();
            let mut near = _mm256_setzero_ps();
            let mut far = _mm256_set1_ps(f32::INFINITY);
            for axis in 0..3 {
                let origin = _mm256_set1_ps(ray.origin[axis]);
                let inverse = _mm256_set1_ps(ray.inverse[axis]);
                let enter = _mm256_load_ps(slab(ray.near[axis]));
                let leave = _mm256_load_ps(slab(ray.near[axis] ^ 32));
                let enter = _mm256_mul_ps(_mm256_sub_ps(enter, origin), inverse);
                let leave = _mm256_mul_ps(_mm256_sub_ps(leave, origin), inverse);
                near = _mm256_max_ps(near, enter);
                far = if axis == 0 {
                    leave
                } else {
                    _mm256_min_ps(far, leave)
                };
            }
            let far = _mm256_mul_ps(far, _mm256_set1_ps(WIDEN));
            let far = _mm256_min_ps(far, _mm256_set1_ps(ray.limit));
            // Comparing before the lanes are put in order saves permutations and was no faster.
            let order = _mm256_load_si256(node.order.as_ptr().cast());
            let order = _mm256_srlv_epi32(order, _mm256_set1_epi32(ray.octant as i32));
            let near = _mm256_permutevar8x32_ps(near, order);
            let far = _mm256_permutevar8x32_ps(far, order);
            let children = _mm256_load_si256(node.children.as_ptr().cast());
            let children = _mm256_permutevar8x32_epi32(children, order);
            let mask = P::at_most(near, far);
            let (children, near) = P::pack(mask, children, near);
            _mm256_storeu_si256(references.cast(), children);
            if !ANY {
                _mm256_storeu_ps(distances, near);
            }
            mask.count_ones()
        }
    }

    #[inline(always)]
    unsafe fn pop(distances: *const f32, limit: f32) -> u32 {
        // SAFETY: the caller has AVX2 and eight distances.
        let mask = unsafe { P::at_most(_mm256_loadu_ps(distances), _mm256_set1_ps(limit)) };
        31 - (mask | 1).leading_zeros()
    }

    #[inline(always)]
    unsafe fn inside(block: &Block, ray: &State) -> u32 {
        // SAFETY: the caller has AVX2; `ray.axes` holds offsets of the block's axes.
        unsafe {
            let corners = block.corners.as_ptr().cast::<u8>();
            let load = |axis: usize, corner: usize| {
                _mm_load_ps(corners.add(ray.axes[axis] as usize + 16 * corner).cast())
            };
            let origin = ray.sheared_origin;
            let (ox, oy, oz) = (
                _mm_set1_ps(origin[0]),
                _mm_set1_ps(origin[1]),
                _mm_set1_ps(origin[2]),
            );
            let (sx, sy) = (_mm_set1_ps(ray.shear[0]), _mm_set1_ps(ray.shear[1]));
            let mut planar = [(_mm_setzero_ps(), _mm_setzero_ps()); 3];
            for (corner, planar) in planar.iter_mut().enumerate() {
                let z = _mm_sub_ps(load(2, corner), oz);
                let (x, y) = (
                    _mm_sub_ps(load(0, corner), ox),
                    _mm_sub_ps(load(1, corner), oy),
                );
                *planar = (
                    _mm_sub_ps(x, _mm_mul_ps(sx, z)),
                    _mm_sub_ps(y, _mm_mul_ps(sy, z)),
                );
            }
            let [a, b, c] = planar;
            let u = _mm_sub_ps(_mm_mul_ps(c.0, b.1), _mm_mul_ps(c.1, b.0));
            let v = _mm_sub_ps(_mm_mul_ps(a.0, c.1), _mm_mul_ps(a.1, c.0));
            let w = _mm_sub_ps(_mm_mul_ps(b.0, a.1), _mm_mul_ps(b.1, a.0));
            let low = _mm_min_ps(u, _mm_min_ps(v, w));
            let high = _mm_max_ps(u, _mm_max_ps(v, w));
            let zero = _mm_setzero_ps();
            let inside = _mm_xor_ps(_mm_cmpge_ps(low, zero), _mm_cmple_ps(high, zero));
            _mm_movemask_ps(inside) as u32
        }
    }

    #[inline(always)]
    unsafe fn meet(block: &Block, ray: &State) -> (f32, usize) {
        // SAFETY: the caller has AVX2; loads are of whole rows of the block.
        unsafe {
            let corner =
                |axis: usize, corner: usize| _mm_load_ps(block.corners[axis][corner].as_ptr());
            // The distance, in double precision: Shear::distance.
            let mut a = [_mm256_setzero_pd(); 3];
            let (mut ab, mut ac) = (a, a);
            for axis in 0..3 {
                let origin = _mm256_cvtps_pd(_mm_set1_ps(ray.origin[axis]));
                let from = |c: usize| _mm256_sub_pd(_mm256_cvtps_pd(corner(axis, c)), origin);
                a[axis] = from(0);
                ab[axis] = _mm256_sub_pd(from(1), a[axis]);
                ac[axis] = _mm256_sub_pd(from(2), a[axis]);
            }
            let mut normal = a;
            for (axis, normal) in normal.iter_mut().enumerate() {
                let (y, z) = ((axis + 1) % 3, (axis + 2) % 3);
                *normal = _mm256_sub_pd(_mm256_mul_pd(ab[y], ac[z]), _mm256_mul_pd(ac[y], ab[z]));
            }
            let mut direction = a;
            for (to, from) in direction.iter_mut().zip(ray.direction) {
                *to = _mm256_cvtps_pd(_mm_set1_ps(from));
            }
            let dot = |p: [__m256d; 3]| {
                let (x, y) = (
                    _mm256_mul_pd(normal[0], p[0]),
                    _mm256_mul_pd(normal[1], p[1]),
                );
                _mm256_add_pd(_mm256_add_pd(x, y), _mm256_mul_pd(normal[2], p[2]))
            };
            let t = _mm256_cvtpd_ps(_mm256_div_pd(dot(a), dot(direction)));
            // Where the ray enters the triangle's box: RayBoxes::entry.
            let zero = _mm_setzero_ps();
            let mut near = zero;
            let mut far = _mm_set1_ps(f32::INFINITY);
            for axis in 0..3 {
                let (p, q, r) = (corner(axis, 0), corner(axis, 1), corner(axis, 2));
                let (low, high) = (
                    _mm_min_ps(p, _mm_min_ps(q, r)),
                    _mm_max_ps(p, _mm_max_ps(q, r)),
                );
                let (origin, inverse) = (
                    _mm_set1_ps(ray.origin[axis]),
                    _mm_set1_ps(ray.inverse[axis]),
                );
                let low = _mm_mul_ps(_mm_sub_ps(low, origin), inverse);
                let high = _mm_mul_ps(_mm_sub_ps(high, origin), inverse);
                near = _mm_max_ps(near, _mm_min_ps(low, high));
                far = _mm_min_ps(far, _mm_max_ps(low, high));
            }
            let passes = _mm_cmple_ps(near, _mm_mul_ps(far, _mm_set1_ps(WIDEN)));
            let passes = _mm_and_ps(passes, _mm_cmpgt_ps(t, zero));
            let lanes = _mm_movemask_ps(passes) as u32 & ray.lanes;
            let t = _mm_max_ps(_mm_max_ps(t, near), _mm_set1_ps(ray.entry));
            // The least of the lanes that count; the first of equal ones has the smallest number.
            let bits = _mm_setr_epi32(1, 2, 4, 8);
            let counted = _mm_cmpeq_epi32(_mm_and_si128(_mm_set1_epi32(lanes as i32), bits), bits);
            let t = _mm_blendv_ps(_mm_set1_ps(f32::INFINITY), t, _mm_castsi128_ps(counted));
            let least = _mm_min_ps(t, _mm_shuffle_ps::<0b10_11_00_01>(t, t));
            let least = _mm_min_ps(least, _mm_shuffle_ps::<0b01_00_11_10>(least, least));
            let first = (_mm_movemask_ps(_mm_cmpeq_ps(t, least)) as u32 & lanes).trailing_zeros();
            let t = select_unpredictable(lanes == 0, f32::NAN, _mm_cvtss_f32(least));
            (t, first as usize & (BLOCK - 1))
        }
    }
}
