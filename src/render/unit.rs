//! Units of work, handed to threads in order. What they come to is taken in that same order, whichever is ready
//! first, so that the bits do not depend on scheduling, and so that what was taken when a render stops is
//! a beginning of it.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use super::progress::Progress;

/// What is taken while units are made.
struct Reduction<P, E, T> {
    /// The first unit that was not taken.
    next: usize,
    /// Units that came too early.
    early: BTreeMap<usize, P>,
    take: T,
    /// Why no more are taken.
    failed: Option<E>,
}

impl<P, E, T: FnMut(P) -> Result<(), E>> Reduction<P, E, T> {
    /// Whether to go on.
    fn add(&mut self, unit: usize, part: P) -> bool {
        self.early.insert(unit, part);
        while self.failed.is_none()
            && let Some(part) = self.early.remove(&self.next)
        {
            self.failed = (self.take)(part).err();
            self.next += 1;
        }
        self.failed.is_none()
    }
}

/// Makes `units` until all are done or `progress` asks to stop, and gives them to `take`; the answer is the first that was
/// not taken.
///
/// # Errors
/// The first that `take` answers with.
pub(super) fn run<P: Send, E: Send>(
    units: Range<usize>,
    progress: &dyn Progress,
    take: impl FnMut(P) -> Result<(), E> + Send,
    make: impl Fn(usize) -> P + Sync,
) -> Result<usize, E> {
    let next = AtomicUsize::new(units.start);
    let failed = AtomicBool::new(false);
    let reduction = Mutex::new(Reduction {
        next: units.start,
        early: BTreeMap::new(),
        take,
        failed: None,
    });
    rayon::broadcast(|_| {
        // A unit that was begun is always finished: no unit after it counts without it.
        while !progress.stop() && !failed.load(Ordering::Relaxed) {
            let unit = next.fetch_add(1, Ordering::Relaxed);
            if unit >= units.end {
                break;
            }
            let part = make(unit);
            let goes_on = reduction
                .lock()
                .expect("no thread panics while it adds")
                .add(unit, part);
            if !goes_on {
                failed.store(true, Ordering::Relaxed);
            }
        }
    });
    let reduction = reduction.into_inner().expect("no thread panicked");
    match reduction.failed {
        Some(error) => Err(error),
        None => Ok(reduction.next),
    }
}
