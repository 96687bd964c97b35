//! Arrays in huge pages: a tree of many megabytes is read all over, and with pages of 4 kB the processor looks
//! for most of them in tables that are in memory too. Second bounces in 3.5 M triangles gain a third.
//!
//! An array begins as zeros that the system gives: each page is made when it is first written to, by the thread that
//! does so.

#![allow(unsafe_code)]

use std::alloc::{Layout, alloc_zeroed, dealloc, handle_alloc_error};
use std::fmt;
use std::fs::File;
use std::io;
use std::ops::{Deref, DerefMut};
use std::ptr::NonNull;

use rayon::prelude::*;

use super::node::{Block, MovingBlock, MovingNode, Node};
use crate::file::read_at;
use crate::pages::{self, HUGE};

/// Values that any bits make, zeros too, and that have no gaps between their fields.
///
/// # Safety
/// So it must be.
pub(super) unsafe trait Plain: Copy + Send + Sync {}

// SAFETY: numbers, whose sizes add up to the whole.
unsafe impl Plain for Node {}
// SAFETY: as above.
unsafe impl Plain for Block {}

// SAFETY: as above.
unsafe impl Plain for MovingNode {}
// SAFETY: as above.
unsafe impl Plain for MovingBlock {}

/// A fixed number of plain values.
pub(super) struct Huge<T: Plain> {
    start: NonNull<T>,
    count: usize,
    memory: Memory,
}

/// What an array lies in.
#[derive(Clone, Copy, Debug)]
enum Memory {
    /// The allocator's; nothing where it has no size.
    Allocated(Layout),
    /// Pages from here on, so many bytes.
    #[cfg(unix)]
    Pages(NonNull<u8>, usize),
}

// SAFETY: it owns its values, as a boxed slice does.
unsafe impl<T: Plain> Send for Huge<T> {}
// SAFETY: as above.
unsafe impl<T: Plain> Sync for Huge<T> {}

impl<T: Plain> Huge<T> {
    /// `count` values of nothing but zeros.
    pub(super) fn zeroed(count: usize) -> Self {
        let layout = Layout::array::<T>(count).expect("less than the address space");
        #[cfg(target_os = "linux")]
        // Small arrays share pages with others.
        if layout.size() >= HUGE / 2 {
            return Self::in_pages(count, layout);
        }
        let start = match layout.size() {
            0 => NonNull::dangling(),
            // SAFETY: the layout has a size.
            _ => NonNull::new(unsafe { alloc_zeroed(layout) }.cast())
                .unwrap_or_else(|| handle_alloc_error(layout)),
        };
        Self {
            start,
            count,
            memory: Memory::Allocated(layout),
        }
    }

    #[cfg(target_os = "linux")]
    fn in_pages(count: usize, layout: Layout) -> Self {
        use rustix::mm::{MapFlags, ProtFlags, mmap_anonymous};
        let size = layout.size() + HUGE;
        let access = ProtFlags::READ | ProtFlags::WRITE;
        let nowhere = std::ptr::null_mut();
        // SAFETY: new memory, where the system has room for it.
        let pages = unsafe { mmap_anonymous(nowhere, size, access, MapFlags::PRIVATE) };
        let pages = pages
            .ok()
            .and_then(|pages| NonNull::new(pages.cast::<u8>()));
        let pages = pages.unwrap_or_else(|| handle_alloc_error(layout));
        // SAFETY: less than a page beyond the beginning, of which there is one more than is asked for.
        let start = unsafe { pages.add(pages.align_offset(HUGE)) }.cast::<T>();
        pages::advise(start.as_ptr(), count);
        Self {
            start,
            count,
            memory: Memory::Pages(pages, size),
        }
    }

    /// What a file holds from a place on, read by all threads.
    pub(super) fn read(file: &File, at: u64, count: usize) -> io::Result<Self> {
        let values = Self::zeroed(count);
        // SAFETY: of these values any bits are good, and nobody else has them.
        let bytes = unsafe {
            std::slice::from_raw_parts_mut(
                values.start.as_ptr().cast::<u8>(),
                size_of_val(&*values),
            )
        };
        let parts = bytes.par_chunks_mut(HUGE).enumerate();
        parts.try_for_each(|(part, bytes)| read_at(file, at + (part * HUGE) as u64, bytes))?;
        Ok(values)
    }

    /// The same, of which what is never looked at is never copied. `at` is where a page begins.
    #[cfg(unix)]
    pub(super) fn mapped(file: &File, at: u64, count: usize) -> io::Result<Self> {
        use rustix::mm::{MapFlags, ProtFlags, mmap};
        let layout = Layout::array::<T>(count).map_err(io::Error::other)?;
        if layout.size() == 0 {
            return Ok(Self::zeroed(count));
        }
        let access = ProtFlags::READ | ProtFlags::WRITE;
        let (nowhere, flags) = (std::ptr::null_mut(), MapFlags::PRIVATE);
        // SAFETY: new memory, in pages of which what is written stays here. Whoever changes the file meanwhile changes
        // numbers of which any bits are good; whoever cuts it off ends the process.
        let pages = unsafe { mmap(nowhere, layout.size(), access, flags, file, at) }?;
        let pages = NonNull::new(pages.cast::<u8>()).ok_or(io::ErrorKind::OutOfMemory)?;
        Ok(Self {
            start: pages.cast(),
            count,
            memory: Memory::Pages(pages, layout.size()),
        })
    }

    /// The same, on systems where it is read at once.
    #[cfg(not(unix))]
    pub(super) fn mapped(file: &File, at: u64, count: usize) -> io::Result<Self> {
        Self::read(file, at, count)
    }

    /// The values as they are in memory.
    pub(super) fn bytes(&self) -> &[u8] {
        // SAFETY: they have no gaps.
        unsafe { std::slice::from_raw_parts(self.start.as_ptr().cast(), size_of_val(&**self)) }
    }

    /// This one value.
    pub(super) fn of(value: T) -> Self {
        let mut one = Self::zeroed(1);
        one[0] = value;
        one
    }
}

impl<T: Plain> Drop for Huge<T> {
    fn drop(&mut self) {
        match self.memory {
            Memory::Allocated(layout) if layout.size() > 0 => {
                // SAFETY: it was allocated with this layout.
                unsafe { dealloc(self.start.as_ptr().cast(), layout) };
            }
            Memory::Allocated(_) => {}
            #[cfg(unix)]
            Memory::Pages(pages, size) => {
                // SAFETY: the pages are this array's. What cannot be given back is left to the process's end.
                let _ = unsafe { rustix::mm::munmap(pages.as_ptr().cast(), size) };
            }
        }
    }
}

impl<T: Plain> Deref for Huge<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        // SAFETY: there are so many values, of which any bits are good.
        unsafe { std::slice::from_raw_parts(self.start.as_ptr(), self.count) }
    }
}

impl<T: Plain> DerefMut for Huge<T> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [T] {
        // SAFETY: as for `deref`; nobody else has it.
        unsafe { std::slice::from_raw_parts_mut(self.start.as_ptr(), self.count) }
    }
}

impl<T: Plain + fmt::Debug> fmt::Debug for Huge<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}
