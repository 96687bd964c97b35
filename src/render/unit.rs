//! Units of work, handed to threads in order. Their sums are added in that same order, whichever is ready
//! first, so that the bits do not depend on scheduling, and so that what was summed when a render stops is
//! a beginning of it.

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::checkpoint::Keeper;
use super::progress::Progress;
use crate::film::{Accumulator, Summed};

/// The sums while units are added to them.
struct Reduction<'k, A: Accumulator> {
    summed: Summed<A>,
    /// Units that came too early.
    early: BTreeMap<usize, A::Part>,
    keeper: Option<&'k mut Keeper>,
}

impl<A: Accumulator> Reduction<'_, A> {
    fn take(&mut self, unit: usize, part: A::Part) {
        self.early.insert(unit, part);
        while let Some(part) = self.early.remove(&self.summed.next) {
            self.summed.sums.add(&part);
            self.summed.next += 1;
        }
        if let Some(keeper) = &mut self.keeper {
            keeper.keep_when_due(&self.summed);
        }
    }
}

/// Goes on from `summed` until so many units are done or `progress` asks to stop; `render` makes one.
pub(super) fn run<A: Accumulator>(
    units: usize,
    summed: Summed<A>,
    progress: &dyn Progress,
    keeper: Option<&mut Keeper>,
    render: impl Fn(usize) -> A::Part + Sync,
) -> Summed<A> {
    let taken = AtomicUsize::new(summed.next);
    let reduction = Mutex::new(Reduction {
        summed,
        early: BTreeMap::new(),
        keeper,
    });
    rayon::broadcast(|_| {
        // A unit that was taken is always finished: no unit after it counts without it.
        while !progress.stop() {
            let unit = taken.fetch_add(1, Ordering::Relaxed);
            if unit >= units {
                break;
            }
            let part = render(unit);
            reduction
                .lock()
                .expect("no thread panics while it adds")
                .take(unit, part);
        }
    });
    let reduction = reduction.into_inner().expect("no thread panicked");
    reduction.summed
}
