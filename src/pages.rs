//! Large arrays in huge pages: the system gives memory when it is first written to, and in pages of 4 kB that takes longer than
//! writing.

#![allow(unsafe_code)]

use std::collections::TryReserveError;

use rayon::prelude::*;

/// The size of a huge page. On machines with others this is only an alignment, and less is advised of.
pub(crate) const HUGE: usize = 2 << 20;

/// So many values, made by all threads.
///
/// # Errors
/// Where there is no memory for them.
pub(crate) fn filled<T: Send>(
    count: usize,
    value: impl Fn() -> T + Sync + Send,
) -> Result<Vec<T>, TryReserveError> {
    let mut values = Vec::new();
    values.try_reserve_exact(count)?;
    advise(values.as_ptr(), values.capacity());
    values.par_extend((0..count).into_par_iter().map(|_| value()));
    Ok(values)
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
    fn arrays_of_any_size_are_filled() {
        for count in [0, 1, 1000, (5 << 20) / 8, (9 << 20) / 8 + 3] {
            let values = filled(count, || 7_u64).unwrap();
            assert_eq!(values.len(), count);
            assert!(values.iter().all(|value| *value == 7));
        }
        assert!(filled(usize::MAX / 8, || 7_u64).is_err());
    }
}
