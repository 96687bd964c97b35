//! Large arrays in huge pages: the system gives memory when it is first written to, and in pages of 4 kB that takes longer than
//! writing.

#![allow(unsafe_code)]

use std::alloc::{Layout, alloc_zeroed};
use std::sync::atomic::AtomicU64;

/// The size of a huge page. On machines with others this is only an alignment, and less is advised of.
pub(crate) const HUGE: usize = 2 << 20;

/// Numbers that are 0 where all their bits are.
///
/// # Safety
/// So it must be.
pub(crate) unsafe trait Zero {}

// SAFETY: as IEEE 754 has it.
unsafe impl Zero for f64 {}
// SAFETY: an integer's memory.
unsafe impl Zero for AtomicU64 {}

/// So many zeros, which the system makes when they are first touched, for the thread that does so; `None` where there is no
/// memory for them.
pub(crate) fn zeros<T: Zero>(count: usize) -> Option<Vec<T>> {
    let layout = Layout::array::<T>(count).ok()?;
    if layout.size() == 0 {
        return Some(Vec::new());
    }
    // SAFETY: the layout has a size.
    let array = unsafe { alloc_zeroed(layout) }.cast::<T>();
    if array.is_null() {
        return None;
    }
    advise(array, count);
    // SAFETY: allocated with the layout of so many values, all of them zeros.
    Some(unsafe { Vec::from_raw_parts(array, count, count) })
}

/// Asks for huge pages wherever an array's memory fills them.
pub(crate) fn advise<T>(array: *const T, count: usize) {
    let start = array.cast::<u8>();
    let size = count.saturating_mul(size_of::<T>());
    let before = start.align_offset(HUGE);
    if size < HUGE || before > size - HUGE {
        return;
    }
    #[cfg(target_os = "linux")]
    {
        use rustix::mm::{Advice, madvise};
        let first = start.wrapping_add(before).cast_mut().cast();
        let size = (size - before) / HUGE * HUGE;
        // SAFETY: the advice leaves what memory holds as it is, whosever it is. Where it is not taken nothing but time is lost.
        let _ = unsafe { madvise(first, size, Advice::LinuxHugepage) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_of_any_size_are_zeros() {
        for count in [0, 1, 1000, (5 << 20) / 8, (9 << 20) / 8 + 3] {
            let mut values = zeros::<f64>(count).unwrap();
            assert_eq!(values.len(), count);
            assert!(values.iter().all(|value| value.to_bits() == 0));
            values.fill(7.0);
            values.push(8.0);
            assert_eq!(values.iter().sum::<f64>(), 7.0 * count as f64 + 8.0);
        }
        assert!(zeros::<f64>(usize::MAX / 4).is_none());
    }
}
