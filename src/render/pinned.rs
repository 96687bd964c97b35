//! Threads that stay where they are: the first on the first processor that this process may use, and so on
//! around. For measuring only; a render is faster where the system may move its threads.

/// Keeps the calling thread, a pool's number `index`, on one processor, where the system allows it.
pub(crate) fn pin(index: usize) {
    #[cfg(target_os = "linux")]
    {
        use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};
        let Ok(allowed) = sched_getaffinity(None) else {
            return;
        };
        let processors = (0..CpuSet::MAX_CPU).filter(|cpu| allowed.is_set(*cpu));
        let processors: Vec<usize> = processors.collect();
        if let Some(processor) = processors.get(index % processors.len().max(1)) {
            let mut own = CpuSet::new();
            own.set(*processor);
            // Where it is refused the measurement is noisier, and nothing else.
            let _ = sched_setaffinity(None, &own);
        }
    }
    #[cfg(not(target_os = "linux"))]
    let _ = index;
}
