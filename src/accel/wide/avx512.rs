//! The kernel for AVX-512: eight children's entries at once, or three corners of four triangles.
//!
//! As for AVX2, all functions are expanded into the walk that uses them.

#![allow(unsafe_code)]

use std::arch::x86_64::*;

use super::avx2;
use super::kernel::{Ends, FILED, Lanes};
use super::node::{BLOCK, Block, Corners, Entry, Node, OTHER, Slabs};
use super::state::State;
use crate::interaction::Ray;

#[derive(Clone, Copy, Debug)]
pub(super) struct Avx512;

// SAFETY: the functions are expanded where AVX-512 F, VL, BW and DQ, AVX2 and FMA may be used.
unsafe impl Lanes for Avx512 {
    #[inline(always)]
    unsafe fn aim(ray: &Ray, state: &mut State) {
        // SAFETY: the caller has AVX2 and FMA.
        unsafe { avx2::aim(ray, state) };
    }

    #[inline(always)]
    unsafe fn enter(node: &Node, way: Option<&Slabs>, ray: &State, stack: *mut Entry) -> u32 {
        // SAFETY: the caller has the instructions and room for eight entries; an octant has three bits.
        unsafe {
            let (near, far) = avx2::slabs(node, way, ray);
            let entered = _mm256_cmp_ps_mask::<_CMP_LE_OQ>(near, far);
            // Where a child is not entered, further than any bound.
            let near = _mm256_mask_mov_epi32(
                _mm256_set1_epi32(i32::MAX),
                entered,
                _mm256_castps_si256(near),
            );
            let children = _mm256_load_si256(node.children.as_ptr().cast());
            let interleave =
                _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
            let entries = _mm512_permutex2var_epi32(
                _mm512_castsi256_si512(children),
                interleave,
                _mm512_castsi256_si512(near),
            );
            let order = *node.order.get_unchecked(usize::from(ray.octant));
            // Of each lane's bits the last three count.
            let order = _mm512_set1_epi32(order as i32);
            let order = _mm512_srlv_epi64(order, _mm512_setr_epi64(0, 3, 6, 9, 12, 15, 18, 21));
            let entries = _mm512_permutexvar_epi64(order, entries);
            let bound = _mm512_set1_epi64(ray.bound.cast_signed());
            let within = _mm512_cmple_epi64_mask(entries, bound);
            _mm512_storeu_si512(stack.cast(), _mm512_maskz_compress_epi64(within, entries));
            u32::from(entered).count_ones()
        }
    }

    #[inline(always)]
    unsafe fn pop(stack: *const Entry, bound: Entry) -> u32 {
        // SAFETY: the caller has AVX-512 and eight entries.
        let within = unsafe {
            let bound = _mm512_set1_epi64(bound.cast_signed());
            _mm512_cmple_epi64_mask(_mm512_loadu_si512(stack.cast()), bound)
        };
        31 - (u32::from(within) | 1).leading_zeros()
    }

    #[inline(always)]
    unsafe fn inside(block: &Block, way: Option<&Corners>, ray: &State) -> u32 {
        // SAFETY: the caller has AVX-512.
        unsafe {
            let x = from_origin(block, way, ray, 0);
            let y = from_origin(block, way, ray, 1);
            let z = from_origin(block, way, ray, 2);
            let x = _mm512_sub_ps(x, _mm512_mul_ps(_mm512_set1_ps(ray.shear[0]), z));
            let y = _mm512_sub_ps(y, _mm512_mul_ps(_mm512_set1_ps(ray.shear[1]), z));
            // Of the corners a, b, c and the corners c, a, b the edge functions w, u and v.
            let (xc, yc) = (
                _mm512_shuffle_f32x4::<0b11_01_00_10>(x, x),
                _mm512_shuffle_f32x4::<0b11_01_00_10>(y, y),
            );
            let edges = _mm512_sub_ps(_mm512_mul_ps(xc, y), _mm512_mul_ps(yc, x));
            let zero = _mm512_setzero_ps();
            let up = u32::from(_mm512_cmp_ps_mask::<_CMP_GE_OQ>(edges, zero));
            let down = u32::from(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(edges, zero));
            let all = |lanes: u32| lanes & lanes >> 4 & lanes >> 8;
            (all(up) ^ all(down)) & 15
        }
    }

    #[inline(always)]
    unsafe fn meet(block: &Block, way: Option<&Corners>, ray: &State) -> (f32, usize) {
        // SAFETY: the caller has AVX2 and FMA.
        unsafe { avx2::meet(block, way, ray) }
    }

    #[inline(always)]
    unsafe fn file(slots: *const u32, currents: *const u32, count: usize, ends: &mut Ends) {
        for first in (0..count).step_by(FILED) {
            // SAFETY: the caller has AVX-512, and room for sixteen in each array.
            unsafe {
                let there = !(u32::MAX << (count - first).min(FILED)) as u16;
                let slots = _mm512_loadu_si512(slots.add(first).cast());
                let currents = _mm512_loadu_si512(currents.add(first).cast());
                let leaf = _mm512_movepi32_mask(currents);
                let rest = _mm512_cmpge_epu32_mask(currents, _mm512_set1_epi32(OTHER as i32));
                let put = |end: &mut *mut u32, lanes: u16| {
                    _mm512_storeu_si512(end.cast(), _mm512_maskz_compress_epi32(lanes, slots));
                    *end = end.add(lanes.count_ones() as usize);
                };
                put(&mut ends.nodes, there & !leaf);
                put(&mut ends.leaves, there & leaf & !rest);
                put(&mut ends.rest, there & rest);
            }
        }
    }
}

/// The corners of a block as they stand for a ray, from its origin along one of its shear's axes: three of four triangles.
///
/// # Safety
/// The processor has AVX-512.
#[inline(always)]
unsafe fn from_origin(block: &Block, way: Option<&Corners>, ray: &State, axis: usize) -> __m512 {
    let offset = usize::from(ray.axes[axis]);
    // SAFETY: the offset is that of an axis.
    unsafe {
        let mut corners = along(&block.corners, offset);
        if let Some(Corners(way)) = way {
            let gone = _mm512_mul_ps(along(way, offset), _mm512_set1_ps(ray.part));
            corners = _mm512_add_ps(corners, gone);
        }
        _mm512_sub_ps(corners, _mm512_set1_ps(ray.sheared_origin[axis]))
    }
}

/// The coordinates of an axis, which begin so many bytes further on. They are loaded in two parts: a mask is a constant that a
/// compiler may put into 16 bits of a register in each round of a loop, so that each waits for the round before.
///
/// # Safety
/// The processor has AVX-512, and so many bytes further on an axis begins.
#[inline(always)]
unsafe fn along(corners: &[[[f32; BLOCK]; 3]; 3], offset: usize) -> __m512 {
    // SAFETY: what is not of the axis is not loaded.
    unsafe {
        let first = corners.as_ptr().byte_add(offset).cast::<f32>();
        let two = _mm512_zextps256_ps512(_mm256_loadu_ps(first));
        _mm512_insertf32x4::<2>(two, _mm_loadu_ps(first.add(2 * BLOCK)))
    }
}
