//! Arrays in huge pages: a tree of many megabytes is read all over, and with pages of 4 kB the processor looks
//! for most of them in tables that are in memory too. Second bounces in 3.5 M triangles gain a third.

#![allow(unsafe_code)]

use std::alloc::{Layout, alloc, dealloc, handle_alloc_error};
use std::fmt;
use std::mem::MaybeUninit;
use std::ops::{Deref, DerefMut};
use std::ptr::NonNull;

use rayon::prelude::*;

/// The size of a huge page; on machines with others this is only an alignment.
const PAGE: usize = 2 << 20;

/// A fixed number of plain values.
pub(super) struct Huge<T: Copy> {
    start: NonNull<T>,
    count: usize,
}

// SAFETY: it owns its values, as a boxed slice does.
unsafe impl<T: Copy + Send> Send for Huge<T> {}
// SAFETY: as above.
unsafe impl<T: Copy + Sync> Sync for Huge<T> {}

fn layout<T>(count: usize) -> Layout {
    let layout = Layout::array::<T>(count).expect("less than the address space");
    // Small arrays share pages with others.
    let align = if layout.size() < PAGE / 2 {
        layout.align()
    } else {
        PAGE
    };
    layout.align_to(align).expect("a power of two")
}

impl<T: Copy + Send + Sync> Huge<T> {
    /// `count` times `value`.
    pub(super) fn filled(count: usize, value: T) -> Self {
        let layout = layout::<T>(count);
        if layout.size() == 0 {
            return Self {
                start: NonNull::dangling(),
                count,
            };
        }
        // SAFETY: the layout has a size.
        let start = NonNull::new(unsafe { alloc(layout) }.cast::<T>());
        let start = start.unwrap_or_else(|| handle_alloc_error(layout));
        #[cfg(target_os = "linux")]
        if layout.align() == PAGE {
            use rustix::mm::{Advice, madvise};
            let memory = start.as_ptr().cast();
            // SAFETY: memory that was just allocated. Where the advice is not taken nothing but time is lost.
            let _ = unsafe { madvise(memory, layout.size(), Advice::LinuxHugepage) };
        }
        // SAFETY: there is room for `count` values, which nobody else has.
        let values = unsafe {
            std::slice::from_raw_parts_mut(start.as_ptr().cast::<MaybeUninit<T>>(), count)
        };
        // By all threads: the system clears each page when it is first written to.
        let parts = values.par_chunks_mut(PAGE / size_of::<T>());
        parts.for_each(|part| part.fill(MaybeUninit::new(value)));
        Self { start, count }
    }
}

impl<T: Copy> Drop for Huge<T> {
    fn drop(&mut self) {
        let layout = layout::<T>(self.count);
        if layout.size() > 0 {
            // SAFETY: it was allocated with this layout.
            unsafe { dealloc(self.start.as_ptr().cast(), layout) };
        }
    }
}

impl<T: Copy> Deref for Huge<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        // SAFETY: that many values were written.
        unsafe { std::slice::from_raw_parts(self.start.as_ptr(), self.count) }
    }
}

impl<T: Copy> DerefMut for Huge<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T] {
        // SAFETY: as for `deref`; nobody else has it.
        unsafe { std::slice::from_raw_parts_mut(self.start.as_ptr(), self.count) }
    }
}

impl<T: Copy + fmt::Debug> fmt::Debug for Huge<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}
