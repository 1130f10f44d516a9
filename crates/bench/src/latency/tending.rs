//! Looking after the ports of a process, between the turns.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, Scope, Thread};
use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{RealTime, ipc};

use super::turn::Span;

const INTERVAL_NS: u64 = 20_000_000;
/// How long before a turn counts the thread no longer wakes up: the kernel's counts are read then.
const AHEAD_NS: u64 = 5_000_000;

/// An ordinary thread that has failed connections tried again. It sleeps while a turn counts, so that
/// it takes no CPU from those who measure, and ends when this is dropped.
pub(super) struct Tending {
    shared: Arc<Shared>,
    thread: Thread,
}

#[derive(Default)]
struct Shared {
    is_over: AtomicBool,
    quiet_from_ns: AtomicU64,
    quiet_until_ns: AtomicU64,
}

impl Tending {
    pub(super) fn start<'scope>(
        scope: &'scope Scope<'scope, '_>,
        participant: &'scope RealTime<ipc::Service>,
    ) -> Self {
        let shared = Arc::new(Shared::default());
        let seen = shared.clone();
        let thread = scope.spawn(move || {
            while !seen.is_over.load(Ordering::Relaxed) {
                if seen.pause_ns(Monotonic.now_ns(), 0) == 0 {
                    participant.tend();
                }
                let pause_ns = seen.pause_ns(Monotonic.now_ns(), INTERVAL_NS);
                thread::park_timeout(Duration::from_nanos(pause_ns));
            }
        });
        Self { shared, thread: thread.thread().clone() }
    }

    /// Sleeps through a turn that is to begin.
    pub(super) fn keep_quiet(&self, span: &Span) {
        self.shared.keep_quiet(span);
        // It may be about to wake up in the middle of the turn.
        self.thread.unpark();
    }
}

impl Drop for Tending {
    fn drop(&mut self) {
        self.shared.is_over.store(true, Ordering::Relaxed);
        self.thread.unpark();
    }
}

impl Shared {
    fn keep_quiet(&self, span: &Span) {
        self.quiet_from_ns.store(span.from_ns.saturating_sub(AHEAD_NS), Ordering::Relaxed);
        self.quiet_until_ns.store(span.end_ns, Ordering::Relaxed);
    }

    /// How long to sleep, where nothing else speaks against `wanted_ns`.
    fn pause_ns(&self, now_ns: u64, wanted_ns: u64) -> u64 {
        let from_ns = self.quiet_from_ns.load(Ordering::Relaxed);
        let until_ns = self.quiet_until_ns.load(Ordering::Relaxed);
        if (from_ns..until_ns).contains(&(now_ns + wanted_ns)) {
            until_ns - now_ns
        } else {
            wanted_ns
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nobody_wakes_up_while_a_turn_counts() {
        let shared = Shared::default();
        assert_eq!(shared.pause_ns(7, INTERVAL_NS), INTERVAL_NS, "there was no turn yet");
        let (start_ns, from_ns, end_ns) = (980_000_000, 1_000_000_000, 2_000_000_000);
        shared.keep_quiet(&Span { start_ns, from_ns, end_ns, first: 0 });
        assert_eq!(shared.pause_ns(start_ns, 0), 0, "the turn is still in its warm-up");
        assert_eq!(shared.pause_ns(start_ns, INTERVAL_NS), end_ns - start_ns);
        assert_eq!(shared.pause_ns(from_ns, 0), end_ns - from_ns);
        assert_eq!(shared.pause_ns(end_ns, INTERVAL_NS), INTERVAL_NS);
    }
}
