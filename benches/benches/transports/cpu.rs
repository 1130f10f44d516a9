//! The CPUs of the two processes: where both poll they must not share one.

use isochrone_benches::Failure;
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

/// Keeps the calling thread on a CPU until this is dropped. The threads of a library that were there
/// before may run on any.
pub(crate) struct Pinned {
    before: CpuSet,
}

/// Pins the thread to the last CPU but so many.
pub(crate) fn pin(but: usize) -> Result<Pinned, Failure> {
    let before = sched_getaffinity(None)?;
    let usable: Vec<usize> = (0..CpuSet::MAX_CPU).filter(|cpu| before.is_set(*cpu)).collect();
    let cpu = usable.iter().rev().nth(but).ok_or("both processes need a CPU each")?;
    let mut set = CpuSet::new();
    set.set(*cpu);
    sched_setaffinity(None, &set)?;
    Ok(Pinned { before })
}

impl Drop for Pinned {
    fn drop(&mut self) {
        // What was allowed before is allowed now.
        let _ = sched_setaffinity(None, &self.before);
    }
}
