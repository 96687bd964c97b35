//! The kernel for AVX2: eight children or four triangles at once; and what AVX-512 does alike.
//!
//! All functions are expanded into the walk that uses them, which is compiled for their instructions: a
//! call would lose what they gain. Only boxes' planes are fused: see [`Shear`](crate::accel::triangle::Shear).

#![allow(unsafe_code)]

use std::arch::x86_64::*;
use std::hint::select_unpredictable;

use super::kernel::Lanes;
use super::node::{BLOCK, Block, Entry, Node};
use super::state::State;
use crate::accel::boxes::WIDEN;

#[derive(Clone, Copy, Debug)]
pub(super) struct Avx2;

/// For each mask, the lanes that it has, one a byte; in the order 0, 1, 4, 5, 2, 3, 6, 7, from which
/// interleaving halves makes the order 0 to 7.
static PACKED: [u64; 256] = {
    const PLACES: [u32; 8] = [0, 1, 4, 5, 2, 3, 6, 7];
    let mut table = [0; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut count) = (0, 0);
        while lane < 8 {
            if mask >> lane & 1 == 1 {
                table[mask] |= (lane as u64) << (8 * PLACES[count]);
                count += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
};

/// Where the ray enters each child of a node, and where it leaves it or ends.
///
/// # Safety
/// The processor has AVX2 and FMA.
#[inline(always)]
pub(super) unsafe fn slabs(node: &Node, ray: &State) -> (__m256, __m256) {
    // SAFETY: the caller has the instructions; `ray.near` holds offsets of slabs of the node, whose
    // neighbours are 32 bytes away.
    unsafe {
        let slabs = node.slabs.as_ptr().cast::<u8>();
        let plane = |offset: u8| _mm256_load_ps(slabs.add(usize::from(offset)).cast());
        let enter = |axis: usize| {
            let inverse = _mm256_set1_ps(ray.inverse[axis]);
            let entering = _mm256_set1_ps(ray.entering[axis]);
            _mm256_fmadd_ps(plane(ray.near[axis]), inverse, entering)
        };
        let leave = |axis: usize| {
            let inverse = _mm256_set1_ps(ray.inverse[axis]);
            let leaving = _mm256_set1_ps(ray.leaving[axis]);
            _mm256_fmadd_ps(plane(ray.near[axis] ^ 32), inverse, leaving)
        };
        let near = _mm256_max_ps(_mm256_max_ps(enter(0), enter(1)), enter(2));
        let near = _mm256_max_ps(near, _mm256_setzero_ps());
        let far = _mm256_min_ps(_mm256_min_ps(leave(0), leave(1)), leave(2));
        let far = _mm256_mul_ps(far, _mm256_set1_ps(WIDEN));
        (near, _mm256_min_ps(far, _mm256_set1_ps(ray.limit())))
    }
}

// SAFETY: the functions are expanded where AVX2 and FMA may be used.
unsafe impl Lanes for Avx2 {
    #[inline(always)]
    unsafe fn enter(node: &Node, ray: &State, stack: *mut Entry) -> u32 {
        // SAFETY: the caller has AVX2 and FMA and room for eight entries; a mask has eight bits, an octant three.
        unsafe {
            let (near, far) = slabs(node, ray);
            let order = *node.order.get_unchecked(usize::from(ray.octant));
            let order = _mm256_set1_epi32(order as i32);
            let order = _mm256_srlv_epi32(order, _mm256_setr_epi32(0, 3, 6, 9, 12, 15, 18, 21));
            let entered = _mm256_cmp_ps::<_CMP_LE_OQ>(near, far);
            let mask = _mm256_movemask_ps(_mm256_permutevar8x32_ps(entered, order)) as u32;
            let packed = _mm_cvtsi64_si128(*PACKED.get_unchecked(mask as usize) as i64);
            let lanes = _mm256_permutevar8x32_epi32(order, _mm256_cvtepu8_epi32(packed));
            let children = _mm256_load_si256(node.children.as_ptr().cast());
            let children = _mm256_permutevar8x32_epi32(children, lanes);
            let near = _mm256_castps_si256(_mm256_permutevar8x32_ps(near, lanes));
            let (low, high) = (
                _mm256_unpacklo_epi32(children, near),
                _mm256_unpackhi_epi32(children, near),
            );
            _mm256_storeu_si256(stack.cast(), low);
            _mm256_storeu_si256(stack.add(4).cast(), high);
            mask.count_ones()
        }
    }

    #[inline(always)]
    unsafe fn pop(stack: *const Entry, bound: Entry) -> u32 {
        // SAFETY: the caller has AVX2 and eight entries.
        unsafe {
            let bound = _mm256_set1_epi64x(bound.cast_signed());
            let beyond = |first: usize| {
                let four = _mm256_loadu_si256(stack.add(first).cast());
                let beyond = _mm256_cmpgt_epi64(four, bound);
                _mm256_movemask_pd(_mm256_castsi256_pd(beyond)) as u32
            };
            let within = !(beyond(0) | beyond(4) << 4) & 0xff;
            31 - (within | 1).leading_zeros()
        }
    }

    #[inline(always)]
    unsafe fn inside(block: &Block, ray: &State) -> u32 {
        // SAFETY: the caller has AVX2; `ray.axes` holds offsets of the block's axes.
        unsafe {
            let corners = block.corners.as_ptr().cast::<u8>();
            let load = |axis: usize, corner: usize| {
                _mm_load_ps(
                    corners
                        .add(usize::from(ray.axes[axis]) + 16 * corner)
                        .cast(),
                )
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
            let zero = _mm_setzero_ps();
            let up = [u, v, w].map(|edge| _mm_cmpge_ps(edge, zero));
            let down = [u, v, w].map(|edge| _mm_cmple_ps(edge, zero));
            let all = |[u, v, w]: [__m128; 3]| _mm_and_ps(_mm_and_ps(u, v), w);
            let inside = _mm_xor_ps(all(up), all(down));
            _mm_movemask_ps(inside) as u32
        }
    }

    #[inline(always)]
    unsafe fn meet(block: &Block, ray: &State) -> (f32, usize) {
        // SAFETY: the caller has what is needed.
        unsafe { meet(block, ray) }
    }
}

/// What [`Lanes::meet`] says.
///
/// # Safety
/// The processor has AVX2 and FMA.
#[inline(always)]
pub(super) unsafe fn meet(block: &Block, ray: &State) -> (f32, usize) {
    // SAFETY: the caller has AVX2; loads are of whole rows of the block.
    unsafe {
        let corner = |axis: usize, corner: usize| _mm_load_ps(block.corners[axis][corner].as_ptr());
        // The distance, in double precision: Shear::distance.
        let mut a = [_mm256_setzero_pd(); 3];
        let (mut ab, mut ac) = (a, a);
        for axis in 0..3 {
            let origin = _mm256_cvtps_pd(_mm_set1_ps(ray.origin[axis]));
            let [p, q, r] = [0, 1, 2].map(|c| _mm256_cvtps_pd(corner(axis, c)));
            a[axis] = _mm256_sub_pd(p, origin);
            ab[axis] = _mm256_sub_pd(q, p);
            ac[axis] = _mm256_sub_pd(r, p);
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
            let inverse = _mm_set1_ps(ray.inverse[axis]);
            // A selection by the sign.
            let first = _mm_blendv_ps(low, high, inverse);
            let last = _mm_blendv_ps(high, low, inverse);
            let enter = _mm_fmadd_ps(first, inverse, _mm_set1_ps(ray.entering[axis]));
            let leave = _mm_fmadd_ps(last, inverse, _mm_set1_ps(ray.leaving[axis]));
            near = _mm_max_ps(near, enter);
            far = _mm_min_ps(far, leave);
        }
        let passes = _mm_cmple_ps(near, _mm_mul_ps(far, _mm_set1_ps(WIDEN)));
        let passes = _mm_and_ps(passes, _mm_cmpgt_ps(t, zero));
        let lanes = _mm_movemask_ps(passes) as u32 & u32::from(ray.lanes);
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
