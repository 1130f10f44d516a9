//! A clock for tests: time passes only when it is read or slept on.

use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::clock::Clock;

pub(crate) struct SimulatedClock {
    now_ns: Cell<u64>,
    sleeps: Cell<u64>,
    wake_latency_ns: u64,
    read_cost_ns: u64,
    raise: Option<(u64, Arc<AtomicBool>)>,
}

impl SimulatedClock {
    pub(crate) fn at(now_ns: u64) -> Self {
        Self {
            now_ns: Cell::new(now_ns),
            sleeps: Cell::new(0),
            wake_latency_ns: 0,
            read_cost_ns: 0,
            raise: None,
        }
    }

    /// Every sleep ends this much after its deadline.
    pub(crate) fn wake_latency_ns(self, wake_latency_ns: u64) -> Self {
        Self { wake_latency_ns, ..self }
    }

    /// Every reading takes this long.
    pub(crate) fn read_cost_ns(self, read_cost_ns: u64) -> Self {
        Self { read_cost_ns, ..self }
    }

    /// Sets `flag` as soon as the clock reaches `at_ns`.
    pub(crate) fn raises_at(self, at_ns: u64, flag: Arc<AtomicBool>) -> Self {
        Self { raise: Some((at_ns, flag)), ..self }
    }

    /// Lets time pass, as a computation would.
    pub(crate) fn advance_to(&self, now_ns: u64) {
        self.now_ns.set(self.now_ns.get().max(now_ns));
        if let Some((at_ns, flag)) = &self.raise
            && self.now_ns.get() >= *at_ns
        {
            flag.store(true, Ordering::Relaxed);
        }
    }

    pub(crate) fn sleeps(&self) -> u64 {
        self.sleeps.get()
    }
}

impl Clock for SimulatedClock {
    fn now_ns(&self) -> u64 {
        let now_ns = self.now_ns.get();
        self.advance_to(now_ns + self.read_cost_ns);
        now_ns
    }

    fn sleep_until_ns(&self, deadline_ns: u64) {
        if self.now_ns.get() < deadline_ns {
            self.sleeps.set(self.sleeps.get() + 1);
            self.advance_to(deadline_ns + self.wake_latency_ns);
        }
    }
}
