//! Large arrays in huge pages: the system gives memory when it is first written to, and in pages of 4 kB that takes longer than
//! writing.

#![allow(unsafe_code)]

use std::collections::TryReserveError;

use rayon::prelude::*;

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
    #[cfg(target_os = "linux")]
    advise(&values);
    values.par_extend((0..count).into_par_iter().map(|_| value()));
    Ok(values)
}

/// Asks for huge pages wherever an array's memory fills them.
#[cfg(target_os = "linux")]
fn advise<T>(values: &Vec<T>) {
    use rustix::mm::{Advice, madvise};
    /// On machines with others this only leaves less to be advised of.
    const PAGE: usize = 2 << 20;
    let size = values.capacity() * size_of::<T>();
    let start = values.as_ptr().cast::<u8>();
    let before = start.align_offset(PAGE);
    if size < PAGE || before > size - PAGE {
        return;
    }
    let size = (size - before) / PAGE * PAGE;
    // SAFETY: within the array's memory, whose contents the advice leaves as they are. Where it is not taken nothing but time is
    // lost.
    let _ = unsafe {
        madvise(
            start.add(before).cast_mut().cast(),
            size,
            Advice::LinuxHugepage,
        )
    };
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
