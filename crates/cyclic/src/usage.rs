//! Costs of a thread, as the kernel counts them.

use rustix::time::{ClockId, clock_gettime};

use crate::clock::to_ns;
use crate::realtime::thread_counters;

/// Totals of the calling thread since it began.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ThreadUsage {
    /// CPU time, user and system, in ns (`CLOCK_THREAD_CPUTIME_ID`).
    pub cpu_ns: u64,
    /// Page faults that needed no I/O.
    pub minor_faults: u64,
    /// Page faults that needed I/O.
    pub major_faults: u64,
    /// Times the thread gave up the CPU, as a sleep does.
    pub voluntary_switches: u64,
    /// Times the CPU was taken away.
    pub involuntary_switches: u64,
}

impl ThreadUsage {
    /// What was added since `earlier`; never negative.
    #[must_use]
    pub fn since(self, earlier: Self) -> Self {
        Self {
            cpu_ns: self.cpu_ns.saturating_sub(earlier.cpu_ns),
            minor_faults: self.minor_faults.saturating_sub(earlier.minor_faults),
            major_faults: self.major_faults.saturating_sub(earlier.major_faults),
            voluntary_switches: self.voluntary_switches.saturating_sub(earlier.voluntary_switches),
            involuntary_switches: self
                .involuntary_switches
                .saturating_sub(earlier.involuntary_switches),
        }
    }
}

/// Reads the calling thread's totals (`getrusage(RUSAGE_THREAD)`). Two system calls, no allocation.
pub fn thread_usage() -> ThreadUsage {
    // The times of getrusage are too coarse.
    let cpu_ns = to_ns(clock_gettime(ClockId::ThreadCPUTime));
    let counters = thread_counters();
    ThreadUsage {
        cpu_ns,
        minor_faults: counters.ru_minflt as u64,
        major_faults: counters.ru_majflt as u64,
        voluntary_switches: counters.ru_nvcsw as u64,
        involuntary_switches: counters.ru_nivcsw as u64,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::{Clock, Monotonic};

    #[test]
    fn a_sleep_is_a_voluntary_switch_and_work_costs_cpu_time() {
        let before = thread_usage();
        for _ in 0..3 {
            Monotonic.sleep_until_ns(Monotonic.now_ns() + 1_000_000);
        }
        let after = thread_usage().since(before);
        assert!(after.voluntary_switches >= 3, "{after:?}");
        assert!(after.cpu_ns > 0, "{after:?}");
    }

    #[test]
    fn touching_new_memory_is_a_minor_fault() {
        let before = thread_usage();
        std::hint::black_box(vec![1u8; 16 << 20]);
        assert!(thread_usage().since(before).minor_faults > 0);
    }
}
