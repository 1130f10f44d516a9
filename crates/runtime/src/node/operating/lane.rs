//! One task of a running node: when its cycles are due, and the channels to and from them.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;

use isochrone_cyclic::{Schedule, ThreadGrant};
use isochrone_timing::{CycleRecord, TaskReport};

use crate::node::standing::StateChange;
use crate::task::faults::Faults;
use crate::task::last_second::{Seconds, longest_pause_ns};
use crate::task::messages::Messages;
use crate::task::orders;
use crate::task::responses::Responses;
use crate::task::traces::Traced;
use isochrone_control::{Followed, Placement};

/// What the operating state holds of one task.
pub(crate) struct Lane {
    pub(crate) name: String,
    pub(crate) ob: Option<i16>,
    pub(crate) schedule: Schedule,
    /// The number of its first cycle: more than 0 where it goes on from an earlier run.
    pub(crate) first_cycle: u64,
    /// Why it has its phase, with `phase = "auto"`.
    pub(crate) phase_reason: Option<String>,
    pub(crate) follow: Option<Followed>,
    /// The services that it publishes.
    pub(crate) sends: Vec<String>,
    pub(crate) orders: orders::Sender,
    pub(crate) traces: Vec<Traced>,
    pub(crate) faults: Faults,
    /// To the log.
    pub(crate) messages: Sender<Arc<Messages>>,
    /// Its last known cycle.
    pub(crate) last: Option<CycleRecord>,
    /// Why its CPU was chosen, if the configuration leaves it open.
    pub(crate) cpu_reason: Option<String>,
    pub(crate) responses: Responses,
    pub(crate) seconds: Seconds,
    /// What the machine granted its thread; `None` while that is set up.
    pub(crate) grant: Option<ThreadGrant>,
    /// Set by its thread when the rings have everything that the task did.
    pub(crate) has_ended: Arc<AtomicBool>,
}

impl Lane {
    /// Records faults of services that began or ended, as of its last cycle.
    pub(crate) fn change_states(&mut self, changes: Vec<StateChange>) {
        let cycle = self.last.map_or(self.first_cycle, |last| last.cycle);
        self.faults.change_states(changes, cycle);
    }

    /// Whether its thread has stopped running cycles.
    pub(super) fn has_ended(&self) -> bool {
        self.has_ended.load(Ordering::Acquire)
    }

    /// The first cycle that has not begun.
    pub(super) fn next_cycle(&self, epoch_ns: u64, now_ns: u64) -> u64 {
        let since = now_ns.checked_sub(self.first_ns(epoch_ns));
        let count = since.map_or(0, |since| since / self.schedule.period_ns + 1);
        self.first_cycle.saturating_add(count)
    }

    /// The first cycle that is due at an instant or later.
    pub(super) fn cycle_due_at(&self, epoch_ns: u64, instant_ns: u64) -> u64 {
        let since = instant_ns.saturating_sub(self.first_ns(epoch_ns));
        self.first_cycle.saturating_add(since.div_ceil(self.schedule.period_ns))
    }

    /// When a cycle is due, in ns of `CLOCK_MONOTONIC`.
    pub(super) fn release_ns(&self, epoch_ns: u64, cycle: u64) -> u64 {
        let count = cycle.saturating_sub(self.first_cycle);
        let offset_ns = count.saturating_mul(self.schedule.period_ns);
        self.first_ns(epoch_ns).saturating_add(offset_ns)
    }

    /// When cycle 0 was due, or would have been, and the period, in ns; modulo 2^64.
    pub(super) fn grid(&self, epoch_ns: u64) -> (u64, u64) {
        let period_ns = self.schedule.period_ns;
        let before_ns = self.first_cycle.wrapping_mul(period_ns);
        (self.first_ns(epoch_ns).wrapping_sub(before_ns), period_ns)
    }

    /// How long ago the cycle after its last one was due, in ns, if that is longer than the
    /// [longest pause](longest_pause_ns). `None`: the task runs.
    pub(super) fn stands_ns(&self, epoch_ns: u64, now_ns: u64) -> Option<u64> {
        let next = self.last.map_or(self.first_cycle, |last| last.cycle.saturating_add(1));
        let stands_ns = now_ns.checked_sub(self.release_ns(epoch_ns, next))?;
        let longest_ns = longest_pause_ns(self.schedule.period_ns);
        Some(stands_ns).filter(|stands_ns| *stands_ns > longest_ns)
    }

    /// When it needs which CPU; `None` before its start.
    pub(super) fn placement(&self, epoch_ns: u64) -> Option<Placement> {
        let grant = self.grant.as_ref()?;
        Some(Placement {
            cpu: grant.cpu.and_then(|cpu| u32::try_from(cpu).ok()),
            scheduler: grant.scheduler.clone(),
            wake: self.schedule.wake.as_str().to_owned(),
            first_release_ns: self.first_ns(epoch_ns),
            longest_watch_ns: self.schedule.longest_watch_ns(),
            response_ns: self.responses.median_ns(),
            phase_reason: self.phase_reason.clone(),
            cpu_reason: self.cpu_reason.clone(),
            follow: self.follow.clone(),
            sends: self.sends.clone(),
        })
    }

    /// Adds to the report of its task when and where it ran.
    pub(crate) fn complete(&self, report: TaskReport) -> TaskReport {
        let grant = self.grant.as_ref();
        TaskReport {
            name: self.name.clone(),
            phase_ns: Some(self.schedule.phase_ns),
            phase_reason: self.phase_reason.clone(),
            wake: self.schedule.wake.as_str().to_owned(),
            scheduler: grant.map(|grant| grant.scheduler.clone()).unwrap_or_default(),
            cpu: grant.and_then(|grant| grant.cpu),
            cpu_reason: self.cpu_reason.clone(),
            ..report
        }
    }

    /// When its first cycle is due.
    fn first_ns(&self, epoch_ns: u64) -> u64 {
        epoch_ns.saturating_add(self.schedule.phase_ns)
    }
}
