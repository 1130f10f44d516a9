//! Watches what disturbs an arm while it has its turn.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_machine::{Disturbance, Machine};
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

use crate::error::BenchError;

/// How often a turn is looked after.
pub(crate) const LOOK_INTERVAL: Duration = Duration::from_millis(20);

/// A thread that watches, on another CPU than the arm's: reading the counts takes some 100 us in the
/// kernel, which would itself make the arm late.
pub(crate) struct Watching {
    stop: Arc<AtomicBool>,
    thread: JoinHandle<Watch>,
}

impl Watching {
    /// Begins to watch a CPU and a thread of this process.
    pub(crate) fn begin(cpu: usize, thread: Option<u32>) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = stop.clone();
        let thread = thread::spawn(move || {
            keep_off(cpu);
            let mut watch = Watch::begin(Some(cpu), thread);
            while !stopped.load(Ordering::Relaxed) {
                thread::sleep(LOOK_INTERVAL);
                watch.look();
            }
            watch
        });
        Self { stop, thread }
    }

    /// Looks once more; what there was.
    pub(crate) fn end(self) -> Watch {
        self.stop.store(true, Ordering::Relaxed);
        // It has nothing to panic at; without it nothing is known.
        self.thread.join().unwrap_or_else(|_| Watch::begin(None, None))
    }
}

/// The CPUs that the calling thread may use, ascending.
///
/// # Errors
/// The kernel does not say.
pub fn allowed_cpus() -> Result<Vec<usize>, BenchError> {
    let set = sched_getaffinity(None).map_err(|error| {
        let cause = std::io::Error::from(error);
        BenchError::Failed(format!(
            "cannot ask for the usable CPUs: {cause}; see that /proc and /sys are there"
        ))
    })?;
    Ok((0..CpuSet::MAX_CPU).filter(|cpu| set.is_set(*cpu)).collect())
}

/// Lets the calling thread run on any allowed CPU but this one, if there is another.
pub(crate) fn keep_off(cpu: usize) {
    if let Ok(mut allowed) = sched_getaffinity(None)
        && allowed.count() > 1
        && allowed.is_set(cpu)
    {
        allowed.unset(cpu);
        let _ = sched_setaffinity(None, &allowed);
    }
}

/// The kernel's counts at several instants of a turn.
pub(crate) struct Watch {
    machine: Machine,
    cpu: Option<usize>,
    thread: Option<u32>,
    looks: Vec<(u64, Disturbance)>,
}

impl Watch {
    /// Begins to watch a CPU (all if there is none) and a thread of this process.
    pub(crate) fn begin(cpu: Option<usize>, thread: Option<u32>) -> Self {
        let mut watch = Self { machine: Machine::here(), cpu, thread, looks: Vec::new() };
        watch.look();
        watch
    }

    /// Reads the counts. Called some fifty times a second, it tells what was around an instant.
    pub(crate) fn look(&mut self) {
        let counts = self.machine.disturbance(self.cpu, self.thread);
        self.looks.push((Monotonic.now_ns(), counts));
    }

    /// What there was since the last look at or before `from_ns`.
    pub(crate) fn since(&self, from_ns: u64) -> Disturbance {
        let before = self.last_before(from_ns);
        match (before.and_then(|index| self.looks.get(index)), self.looks.last()) {
            (Some((_, first)), Some((_, last))) => last.since(*first),
            _ => Disturbance::default(),
        }
    }

    /// What there was between the looks before and after an instant.
    pub(crate) fn around(&self, at_ns: u64) -> Disturbance {
        let Some(before) = self.last_before(at_ns) else { return Disturbance::default() };
        match (self.looks.get(before), self.looks.get(before + 1)) {
            (Some((_, first)), Some((_, second))) => second.since(*first),
            _ => Disturbance::default(),
        }
    }

    fn last_before(&self, at_ns: u64) -> Option<usize> {
        self.looks.partition_point(|(look_ns, _)| *look_ns <= at_ns).checked_sub(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn watch(interrupts: &[u64]) -> Watch {
        let look = |(index, count): (usize, &u64)| {
            (index as u64 * 20, Disturbance { interrupts: Some(*count), ..Disturbance::default() })
        };
        let looks = interrupts.iter().enumerate().map(look).collect();
        Watch { machine: Machine::here(), cpu: None, thread: None, looks }
    }

    #[test]
    fn around_an_instant_is_between_the_looks_before_and_after_it() {
        let watch = watch(&[5, 5, 9, 9]);
        assert_eq!(watch.around(19).interrupts, Some(0));
        assert_eq!(watch.around(20).interrupts, Some(4));
        assert_eq!(watch.around(39).interrupts, Some(4));
        assert_eq!(watch.around(40).interrupts, Some(0));
        assert_eq!(watch.around(99).interrupts, None, "nobody looked after it");
    }

    #[test]
    fn the_warm_up_before_a_look_does_not_count() {
        let watch = watch(&[1, 4, 9, 16]);
        assert_eq!(watch.since(0).interrupts, Some(15));
        assert_eq!(watch.since(45).interrupts, Some(7));
    }
}
