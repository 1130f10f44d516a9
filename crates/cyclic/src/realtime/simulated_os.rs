//! An operating system for tests: grants by the kernel's rules, and remembers what was asked.

use std::cell::{Cell, RefCell};
use std::io;
use std::num::NonZeroU64;

use isochrone_machine::{CpuList, GroupBudget};
use rustix::thread::CpuSet;

use super::os::{Limit, Os, Scheduler};

/// By default: no capability, limits as in a fresh distribution, CPUs 0 and 1.
pub(crate) struct SimulatedOs {
    pub(crate) can_lock_memory: bool,
    pub(crate) can_set_priority: bool,
    pub(crate) lock_memory_errno: Option<i32>,
    pub(crate) set_fifo_errno: Option<i32>,
    pub(crate) affinity_errno: Option<i32>,
    pub(crate) group_budget: Option<GroupBudget>,
    pub(crate) memory_lock_limit: Cell<Limit>,
    pub(crate) priority_limit: Cell<Limit>,
    pub(crate) scheduler: Cell<Scheduler>,
    pub(crate) affinity: Cell<CpuSet>,
    pub(crate) calls: RefCell<Vec<&'static str>>,
}

impl Default for SimulatedOs {
    fn default() -> Self {
        Self {
            can_lock_memory: false,
            can_set_priority: false,
            lock_memory_errno: None,
            set_fifo_errno: None,
            affinity_errno: None,
            group_budget: None,
            memory_lock_limit: Cell::new(Limit { soft: 65_536, hard: 65_536 }),
            priority_limit: Cell::new(Limit { soft: 0, hard: 0 }),
            scheduler: Cell::new(Scheduler::Other),
            affinity: Cell::new(cpus(&[0, 1])),
            calls: RefCell::default(),
        }
    }
}

impl SimulatedOs {
    pub(crate) fn memlock(self, limit: Limit) -> Self {
        self.memory_lock_limit.set(limit);
        self
    }

    pub(crate) fn rtprio(self, limit: Limit) -> Self {
        self.priority_limit.set(limit);
        self
    }

    /// The calls that change something, in order.
    pub(crate) fn calls(&self) -> Vec<&'static str> {
        self.calls.borrow().clone()
    }

    fn called(&self, name: &'static str) {
        self.calls.borrow_mut().push(name);
    }
}

/// A set of these CPUs.
pub(crate) fn cpus(numbers: &[usize]) -> CpuSet {
    let mut cpus = CpuSet::new();
    numbers.iter().for_each(|cpu| cpus.set(*cpu));
    cpus
}

fn outcome(errno: Option<i32>) -> io::Result<()> {
    errno.map_or(Ok(()), |errno| Err(io::Error::from_raw_os_error(errno)))
}

fn raised(limit: Limit) -> Limit {
    Limit { soft: limit.hard, ..limit }
}

impl Os for SimulatedOs {
    fn can_lock_memory(&self) -> bool {
        self.can_lock_memory
    }

    fn can_set_priority(&self) -> bool {
        self.can_set_priority
    }

    fn memory_lock_limit(&self) -> Limit {
        self.memory_lock_limit.get()
    }

    fn priority_limit(&self) -> Limit {
        self.priority_limit.get()
    }

    fn raise_memory_lock_limit(&self) {
        self.called("raise_memory_lock_limit");
        self.memory_lock_limit.set(raised(self.memory_lock_limit.get()));
    }

    fn raise_priority_limit(&self) {
        self.called("raise_priority_limit");
        self.priority_limit.set(raised(self.priority_limit.get()));
    }

    fn lock_memory(&self) -> io::Result<()> {
        self.called("lock_memory");
        outcome(self.lock_memory_errno)
    }

    fn keep_freed_memory(&self) {
        self.called("keep_freed_memory");
    }

    fn set_timer_slack_ns(&self, _slack_ns: NonZeroU64) {
        self.called("set_timer_slack_ns");
    }

    fn block_signals(&self) {
        self.called("block_signals");
    }

    fn online_cpus(&self) -> Option<CpuList> {
        CpuList::parse("0-1")
    }

    fn affinity(&self) -> io::Result<CpuSet> {
        Ok(self.affinity.get())
    }

    fn set_affinity(&self, cpus: &CpuSet) -> io::Result<()> {
        self.called("set_affinity");
        outcome(self.affinity_errno)?;
        self.affinity.set(*cpus);
        Ok(())
    }

    fn set_fifo(&self, priority: u8) -> io::Result<()> {
        self.called("set_fifo");
        outcome(self.set_fifo_errno)?;
        if !self.can_set_priority && self.priority_limit.get().soft < u64::from(priority) {
            return outcome(Some(libc::EPERM));
        }
        self.scheduler.set(Scheduler::Fifo(priority));
        Ok(())
    }

    fn set_other(&self) {
        self.called("set_other");
        self.scheduler.set(Scheduler::Other);
    }

    fn scheduler(&self) -> Scheduler {
        self.scheduler.get()
    }

    fn group_budget(&self) -> Option<GroupBudget> {
        self.group_budget.clone()
    }
}
