//! The walk, compiled for each set of instructions, and the choice between them: once a batch.

#![allow(unsafe_code)]

use super::batch as walks;
use super::portable::Portable;
use super::{Flight, Tree, Walker};
use crate::accel::Counts;
use crate::lanes::{Kernel, Set};

/// Walks `count` rays; with `FETCH`, asks for memory ahead, with `LATER`, through trees that move.
pub(super) fn batch<'t, W: Walker<'t>, const ANY: bool, const FETCH: bool, const LATER: bool>(
    kernel: Kernel,
    tree: &'t Tree,
    walker: &mut W,
    count: usize,
    flight: &mut Flight,
    counts: &mut Counts,
) {
    assert!(flight.levels() > tree.levels(), "room for the tree");
    // SAFETY: a `Kernel` exists only where the processor has its instructions, and there is room.
    unsafe {
        match kernel.set() {
            Set::Portable => {
                walks::batch::<Portable, W, ANY, FETCH, LATER>(tree, walker, count, flight, counts);
            }
            #[cfg(target_arch = "x86_64")]
            Set::Avx2 => avx2::batch::<W, ANY, FETCH, LATER>(tree, walker, count, flight, counts),
            #[cfg(target_arch = "x86_64")]
            Set::Avx512 => {
                avx512::batch::<W, ANY, FETCH, LATER>(tree, walker, count, flight, counts)
            }
        }
    }
}

/// A module with the walk, compiled for some instructions.
#[cfg(target_arch = "x86_64")]
macro_rules! compile {
    ($name:ident, $kernel:ident::$lanes:ident, $features:literal) => {
        mod $name {
            use super::super::$kernel::$lanes;
            use super::{Counts, Flight, Tree, Walker, walks};

            /// # Safety
            /// As for the walk itself.
            #[target_feature(enable = $features)]
            pub(super) unsafe fn batch<
                't,
                W: Walker<'t>,
                const ANY: bool,
                const FETCH: bool,
                const LATER: bool,
            >(
                tree: &'t Tree,
                walker: &mut W,
                count: usize,
                flight: &mut Flight,
                counts: &mut Counts,
            ) {
                // SAFETY: the caller's word.
                unsafe {
                    walks::batch::<$lanes, W, ANY, FETCH, LATER>(
                        tree, walker, count, flight, counts,
                    )
                }
            }
        }
    };
}

#[cfg(target_arch = "x86_64")]
compile!(avx2, avx2::Avx2, "avx2,fma,bmi1,bmi2,lzcnt,popcnt");
#[cfg(target_arch = "x86_64")]
compile!(
    avx512,
    avx512::Avx512,
    "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt"
);
