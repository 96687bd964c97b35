//! Which instructions a walk uses: picked once, by what the processor can do.

#![allow(unsafe_code)]

use super::node::{Block, Node};
use super::state::State;

/// The four steps of a walk that are done on lanes.
///
/// # Safety
/// An implementation may need instructions that not every processor has: its functions must be called, or
/// rather expanded, only where those may be used.
pub(super) unsafe trait Lanes: Copy {
    /// Writes the children that the ray enters, farthest first, and returns how many. With `ANY` their
    /// distances are not written.
    ///
    /// # Safety
    /// Eight entries can be written at each pointer.
    unsafe fn enter<const ANY: bool>(
        node: &Node,
        ray: &State,
        distances: *mut f32,
        references: *mut u32,
    ) -> u32;

    /// The last of eight distances that is not beyond the limit; the first where all are.
    ///
    /// # Safety
    /// Eight distances can be read.
    unsafe fn pop(distances: *const f32, limit: f32) -> u32;

    /// A bit for each triangle of the block that the ray's line goes through.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn inside(block: &Block, ray: &State) -> u32;

    /// The first hit among the triangles `ray.lanes`: its distance, not a number where there is none, and
    /// its lane.
    ///
    /// # Safety
    /// See the trait.
    unsafe fn meet(block: &Block, ray: &State) -> (f32, usize);
}

/// Instructions with which rays are traced. All find the same hits, to the bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kernel(pub(super) Set);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Set {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Kernel {
    /// All that this processor has the instructions for, the fastest last; the first is portable.
    pub fn all() -> Vec<Self> {
        let mut all = vec![Self(Set::Portable)];
        #[cfg(target_arch = "x86_64")]
        {
            let avx2 = is_x86_feature_detected!("avx2")
                && is_x86_feature_detected!("bmi1")
                && is_x86_feature_detected!("bmi2")
                && is_x86_feature_detected!("lzcnt")
                && is_x86_feature_detected!("popcnt");
            if avx2 {
                all.push(Self(Set::Avx2));
            }
            let avx512 = is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512bw");
            if avx2 && avx512 {
                all.push(Self(Set::Avx512));
            }
        }
        all
    }

    /// The fastest on this processor.
    pub fn best() -> Self {
        *Self::all().last().expect("there is a portable one")
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self.0 {
            Set::Portable => "portable",
            #[cfg(target_arch = "x86_64")]
            Set::Avx2 => "AVX2",
            #[cfg(target_arch = "x86_64")]
            Set::Avx512 => "AVX-512",
        }
    }
}

impl Default for Kernel {
    fn default() -> Self {
        Self::best()
    }
}
