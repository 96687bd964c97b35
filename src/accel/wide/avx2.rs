//! The kernel for AVX2: eight children or four triangles at once; and what AVX-512 does alike.
//!
//! All functions are expanded into the walk that uses them, which is compiled for their instructions: a
//! call would lose what they gain. Only boxes' planes are fused: see [`Shear`](crate::accel::triangle::Shear).

#![allow(unsafe_code)]

use std::arch::x86_64::*;
use std::hint::select_unpredictable;
use std::mem::offset_of;

use glam::Vec3;

use super::kernel::{Ends, Lanes};
use super::node::{BLOCK, Block, Corners, Entry, Node, Slabs, WIDTH};
use super::state::{BLOCK_AXIS, NEAR, State};
use crate::accel::boxes::{LOST, SMALLEST, WIDEN};
use crate::accel::triangle::{AXES, GREATEST, greatest};
use crate::interaction::Ray;

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

/// How a shear's axes are taken from a vector, by its z and whether the ray goes backwards along that: as places
/// in the vector, and in a block in bytes.
static SHEARED: [([u32; 4], [u8; 3]); 6] = {
    let mut sheared = [([0; 4], [0; 3]); 6];
    let mut i = 0;
    while i < 18 {
        let (way, to) = (i / 3, i % 3);
        let from = AXES[way / 2][way % 2][to];
        sheared[way].0[to] = from as u32;
        sheared[way].1[to] = from as u8 * BLOCK_AXIS;
        i += 1;
    }
    sheared
};

/// What [`Lanes::aim`] says: [`RayBoxes::new`](crate::accel::boxes::RayBoxes::new) and [`Shear::new`] in lanes.
/// Fields are written four numbers at a time, each over the end of the one before; the last one as it is.
///
/// # Safety
/// The processor has AVX2 and FMA.
#[inline(always)]
pub(super) unsafe fn aim(ray: &Ray, state: &mut State) {
    // SAFETY: the caller has the instructions; the state's layout is C's, where behind each of these fields there
    // is a number more; an index into a table is below its length.
    unsafe {
        // Not loaded four at a time: the ray was just written, in other pieces, which is slow.
        let lanes = |v: Vec3| _mm_setr_ps(v.x, v.y, v.z, 0.0);
        let state = &raw mut *state;
        let start = state.cast::<f32>();
        let store = |offset: usize, lanes: __m128| _mm_storeu_ps(start.byte_add(offset), lanes);
        let (origin, direction) = (lanes(ray.origin), lanes(ray.direction));
        let (zero, sign) = (_mm_setzero_ps(), _mm_set1_ps(-0.0));
        let length = _mm_andnot_ps(sign, direction);
        let smallest = _mm_set1_ps(SMALLEST);
        let bounded = _mm_blendv_ps(
            direction,
            _mm_or_ps(smallest, _mm_and_ps(sign, direction)),
            _mm_cmplt_ps(length, smallest),
        );
        let inverse = _mm_div_ps(_mm_set1_ps(1.0), bounded);
        let middle = _mm_xor_ps(sign, _mm_mul_ps(origin, inverse));
        let lost = _mm_mul_ps(_mm_set1_ps(LOST), _mm_andnot_ps(sign, middle));
        store(offset_of!(State, inverse), inverse);
        store(offset_of!(State, entering), _mm_sub_ps(middle, lost));
        store(offset_of!(State, leaving), _mm_add_ps(middle, lost));
        let octant = _mm_movemask_ps(_mm_cmplt_ps(inverse, zero)) as usize & 7;
        ((*state).near, (*state).octant) = (*NEAR.get_unchecked(octant), octant as u8);
        let greater = _mm_cmpgt_ps(
            _mm_shuffle_ps::<0b01_00_00>(length, length),
            _mm_shuffle_ps::<0b10_10_01>(length, length),
        );
        let greatest = *GREATEST.get_unchecked(_mm_movemask_ps(greater) as usize & 7);
        let backward = _mm_movemask_ps(_mm_cmplt_ps(direction, zero)) as usize >> greatest & 1;
        let (places, axes) = SHEARED.get_unchecked(2 * greatest + backward);
        let places = _mm_loadu_si128(places.as_ptr().cast());
        let sheared = _mm_permutevar_ps(direction, places);
        let shear = _mm_div_ps(sheared, _mm_shuffle_ps::<0b10_10_10_10>(sheared, sheared));
        store(offset_of!(State, origin), origin);
        store(offset_of!(State, direction), direction);
        let sheared_origin = _mm_permutevar_ps(origin, places);
        store(offset_of!(State, sheared_origin), sheared_origin);
        _mm_storel_epi64((&raw mut (*state).shear).cast(), _mm_castps_si128(shear));
        (*state).axes = *axes;
        let nought = _mm_add_ps(_mm_mul_ps(zero, origin), _mm_mul_ps(zero, direction));
        (*state).end_unless(_mm_movemask_ps(_mm_cmpeq_ps(nought, zero)) & 7 == 7);
    }
}

/// Where the ray enters each child of a node, and where it leaves it or ends.
///
/// # Safety
/// The processor has AVX2 and FMA.
#[inline(always)]
pub(super) unsafe fn slabs(node: &Node, way: Option<&Slabs>, ray: &State) -> (__m256, __m256) {
    // SAFETY: the caller has the instructions; `ray.near` holds offsets of slabs of the node, whose
    // neighbours are 32 bytes away, and which go as those of the way do.
    unsafe {
        let at = |slabs: &[[f32; WIDTH]; 6], offset: u8| {
            _mm256_load_ps(slabs.as_ptr().byte_add(usize::from(offset)).cast())
        };
        let plane = |offset: u8| match way {
            Some(Slabs(way)) => _mm256_fmadd_ps(
                at(way, offset),
                _mm256_set1_ps(ray.part),
                at(&node.slabs, offset),
            ),
            None => at(&node.slabs, offset),
        };
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
    unsafe fn aim(ray: &Ray, state: &mut State) {
        // SAFETY: the caller has what is needed.
        unsafe { aim(ray, state) };
    }

    #[inline(always)]
    unsafe fn enter(node: &Node, way: Option<&Slabs>, ray: &State, stack: *mut Entry) -> u32 {
        // SAFETY: the caller has AVX2 and FMA and room for eight entries; a mask has eight bits, an octant three.
        unsafe {
            let (near, far) = slabs(node, way, ray);
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
            // From the top of a word: the instruction that counts from below is a slow one.
            let beyond = beyond(0) << 24 | beyond(4) << 28;
            7 - (!beyond | 1 << 24).leading_zeros()
        }
    }

    #[inline(always)]
    unsafe fn inside(block: &Block, way: Option<&Corners>, ray: &State) -> u32 {
        // SAFETY: the caller has AVX2; `ray.axes` holds offsets of the block's axes, and of those of the way.
        unsafe {
            let at = |corners: &[[[f32; BLOCK]; 3]; 3], axis: usize, corner: usize| {
                let offset = usize::from(ray.axes[axis]) + 16 * corner;
                _mm_load_ps(corners.as_ptr().byte_add(offset).cast())
            };
            let load = |axis: usize, corner: usize| {
                let first = at(&block.corners, axis, corner);
                match way {
                    Some(Corners(way)) => {
                        let part = _mm_set1_ps(ray.part);
                        _mm_add_ps(first, _mm_mul_ps(at(way, axis, corner), part))
                    }
                    None => first,
                }
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
    unsafe fn meet(block: &Block, way: Option<&Corners>, ray: &State) -> (f32, usize) {
        // SAFETY: the caller has what is needed.
        unsafe { meet(block, way, ray) }
    }

    #[inline(always)]
    unsafe fn file(slots: *const u32, currents: *const u32, count: usize, ends: &mut Ends) {
        for first in (0..count).step_by(WIDTH) {
            // SAFETY: the caller has AVX2, and room for whole groups in each array; a mask has eight bits.
            unsafe {
                let there = 0xff >> WIDTH.saturating_sub(count - first);
                let slots = _mm256_loadu_si256(slots.add(first).cast());
                let currents = _mm256_loadu_si256(currents.add(first).cast());
                let signs = |x: __m256i| _mm256_movemask_ps(_mm256_castsi256_ps(x)) as u32;
                let leaf = signs(currents);
                // Both of the highest bits.
                let rest = leaf & signs(_mm256_slli_epi32::<1>(currents));
                let put = |end: &mut *mut u32, lanes: u32| {
                    let packed = _mm_cvtsi64_si128(*PACKED.get_unchecked(lanes as usize) as i64);
                    let packed = _mm256_cvtepu8_epi32(packed);
                    let packed = _mm256_permute4x64_epi64::<0b11_01_10_00>(packed);
                    let lanes_slots = _mm256_permutevar8x32_epi32(slots, packed);
                    _mm256_storeu_si256(end.cast(), lanes_slots);
                    *end = end.add(lanes.count_ones() as usize);
                };
                put(&mut ends.nodes, there & !leaf);
                put(&mut ends.leaves, there & leaf & !rest);
                put(&mut ends.rest, there & rest);
            }
        }
    }
}

/// What [`Lanes::meet`] says: lane by lane, for seldom is there more than one.
///
/// # Safety
/// The processor has AVX2 and FMA.
#[inline(always)]
pub(super) unsafe fn meet(block: &Block, way: Option<&Corners>, ray: &State) -> (f32, usize) {
    let mut best = (f32::NAN, 0);
    let mut lanes = u32::from(ray.lanes);
    while lanes != 0 {
        let lane = lanes.trailing_zeros() as usize & (BLOCK - 1);
        // SAFETY: the caller's word.
        let t = unsafe { distance(block, way, lane, ray) };
        // The first of equal ones has the smallest number.
        let better = (t < best.0) | best.0.is_nan();
        best.0 = select_unpredictable(better, t, best.0);
        best.1 = select_unpredictable(better, lane, best.1);
        lanes &= lanes - 1;
    }
    best
}

/// Where the ray, whose line goes through the triangle in this lane, meets it; not a number where it does not.
///
/// # Safety
/// The processor has AVX2 and FMA, and the block this lane.
#[inline(always)]
unsafe fn distance(block: &Block, way: Option<&Corners>, lane: usize, ray: &State) -> f32 {
    // SAFETY: the caller has the instructions; four values from these fields on are in the ray.
    unsafe {
        let field = |offset: usize| _mm_loadu_ps((&raw const *ray).cast::<f32>().byte_add(offset));
        let of = |corners: &[[[f32; BLOCK]; 3]; 3], c: usize| {
            let [x, y, z] = [0, 1, 2].map(|axis| *corners[axis][c].get_unchecked(lane));
            _mm_setr_ps(x, y, z, 0.0)
        };
        let corner = |c: usize| match way {
            Some(Corners(way)) => {
                let gone = _mm_mul_ps(of(way, c), _mm_set1_ps(ray.part));
                _mm_add_ps(of(&block.corners, c), gone)
            }
            None => of(&block.corners, c),
        };
        let [p, q, r] = [corner(0), corner(1), corner(2)];
        // In double precision: Shear::distance.
        let from = _mm256_cvtps_pd(p);
        let a = _mm256_sub_pd(from, _mm256_cvtps_pd(field(offset_of!(State, origin))));
        let ab = _mm256_sub_pd(_mm256_cvtps_pd(q), from);
        let ac = _mm256_sub_pd(_mm256_cvtps_pd(r), from);
        let turned = |v: __m256d| _mm256_permute4x64_pd::<0b11_00_10_01>(v);
        let (one, other) = (_mm256_mul_pd(ab, turned(ac)), _mm256_mul_pd(turned(ab), ac));
        let normal = turned(_mm256_sub_pd(one, other));
        let direction = _mm256_cvtps_pd(field(offset_of!(State, direction)));
        let (above, along) = (_mm256_mul_pd(normal, a), _mm256_mul_pd(normal, direction));
        let xy = _mm_hadd_pd(_mm256_castpd256_pd128(above), _mm256_castpd256_pd128(along));
        let z = _mm_unpacklo_pd(
            _mm256_extractf128_pd::<1>(above),
            _mm256_extractf128_pd::<1>(along),
        );
        let dots = _mm_add_pd(xy, z);
        let t = _mm_cvtsd_f64(_mm_div_sd(dots, _mm_unpackhi_pd(dots, dots))) as f32;
        // Where the ray enters the triangle's box: RayBoxes::entry.
        let (low, high) = (
            _mm_min_ps(p, _mm_min_ps(q, r)),
            _mm_max_ps(p, _mm_max_ps(q, r)),
        );
        let inverse = field(offset_of!(State, inverse));
        // A selection by the sign.
        let first = _mm_blendv_ps(low, high, inverse);
        let last = _mm_blendv_ps(high, low, inverse);
        let enter = _mm_fmadd_ps(first, inverse, field(offset_of!(State, entering)));
        let leave = _mm_fmadd_ps(last, inverse, field(offset_of!(State, leaving)));
        let y = |v: __m128| _mm_movehdup_ps(v);
        let z = |v: __m128| _mm_movehl_ps(v, v);
        let near = _mm_max_ss(_mm_max_ss(enter, y(enter)), z(enter));
        let near = _mm_max_ss(near, _mm_setzero_ps());
        let far = _mm_min_ss(_mm_min_ss(leave, y(leave)), z(leave));
        let (near, far) = (_mm_cvtss_f32(near), _mm_cvtss_f32(far) * WIDEN);
        let passes = (near <= far) & (t > 0.0);
        let t = greatest(greatest(t, near), ray.entry);
        select_unpredictable(passes, t, f32::NAN)
    }
}
