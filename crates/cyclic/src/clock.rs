//! The clock that the loop asks, and the system's one.

use rustix::io::Errno;
use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, Timespec, clock_gettime};

const NS_PER_S: u64 = 1_000_000_000;

/// Everything the loop asks the system for, injected so that tests need neither privilege nor sleep.
pub trait Clock {
    /// Time now, in nanoseconds since an arbitrary origin. Never goes back.
    fn now_ns(&self) -> u64;

    /// Sleeps until the clock reads `deadline_ns` or later; returns at once if it already does.
    fn sleep_until_ns(&self, deadline_ns: u64);
}

impl<C: Clock + ?Sized> Clock for &C {
    fn now_ns(&self) -> u64 {
        (**self).now_ns()
    }

    fn sleep_until_ns(&self, deadline_ns: u64) {
        (**self).sleep_until_ns(deadline_ns);
    }
}

/// `CLOCK_MONOTONIC`: nanoseconds since boot, read in the vDSO without entering the kernel.
///
/// All processes of one machine read the same clock, so its times compare across processes.
/// 64 bits of nanoseconds last 584 years.
#[derive(Debug, Clone, Copy, Default)]
pub struct Monotonic;

impl Clock for Monotonic {
    #[inline]
    fn now_ns(&self) -> u64 {
        to_ns(clock_gettime(ClockId::Monotonic))
    }

    fn sleep_until_ns(&self, deadline_ns: u64) {
        let deadline = to_timespec(deadline_ns);
        // An absolute deadline may simply be asked for again when a signal interrupts the sleep.
        while clock_nanosleep_absolute(ClockId::Monotonic, &deadline) == Err(Errno::INTR) {}
    }
}

pub(crate) fn to_ns(time: Timespec) -> u64 {
    // Times since boot and CPU times are never negative.
    (time.tv_sec as u64).wrapping_mul(NS_PER_S).wrapping_add(time.tv_nsec as u64)
}

fn to_timespec(ns: u64) -> Timespec {
    Timespec { tv_sec: (ns / NS_PER_S) as _, tv_nsec: (ns % NS_PER_S) as _ }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nanoseconds_survive_the_way_to_a_timespec_and_back() {
        for ns in [0, 1, NS_PER_S - 1, NS_PER_S, 3_600_000_000_001, u64::MAX] {
            assert_eq!(to_ns(to_timespec(ns)), ns);
        }
    }

    #[test]
    fn a_sleep_never_ends_before_its_deadline() {
        let deadline_ns = Monotonic.now_ns() + 100_000;
        Monotonic.sleep_until_ns(deadline_ns);
        assert!(Monotonic.now_ns() >= deadline_ns);
    }
}
