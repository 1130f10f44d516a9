//! A node that runs, as an ordinary thread sees it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use isochrone_cyclic::{StopReason, ThreadGrant};
use isochrone_ipc::{Service, ipc};
use isochrone_timing::CycleRecord;

use crate::error::{SetError, TaskPanicked};
use crate::layouts::Resolver;
use crate::limiter::Limiter;
use crate::outcome::{End, Outcome, TaskOutcome};
use crate::parts::Parts;
use crate::set_points::Transaction;
use crate::task::Done;
use crate::threads::Threads;

/// How often to [poll](Running::poll): the rings of the cycles hold 40 ms at the shortest period.
pub const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// A node that runs. Dropping it ends it.
#[must_use = "dropping it ends the node"]
pub struct Running<S: Service = ipc::Service> {
    // The threads end before what they use.
    threads: Threads,
    parts: Parts<S>,
    grants: Vec<ThreadGrant>,
    epoch_ns: u64,
    news: News,
    set_points: u64,
    limiter: Limiter,
}

/// What a poll found.
#[derive(Debug, Default)]
struct News {
    records: Vec<(usize, CycleRecord)>,
    applied: Vec<Applied>,
}

/// What came in since the last [`poll`](Running::poll).
#[derive(Debug)]
pub struct Poll<'a> {
    is_running: bool,
    is_ending: bool,
    news: &'a News,
}

/// Set-points that a task applied.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Applied {
    /// The number that [`Running::set`] returned.
    pub number: u64,
    /// The task, by its place in the plan.
    pub task: usize,
    /// The cycle at whose start they were applied.
    pub cycle: u64,
}

impl<'a> Poll<'a> {
    /// Whether a task still runs. When none does, everything has been seen.
    pub fn is_running(&self) -> bool {
        self.is_running
    }

    /// Whether the node ends or has ended: it was asked to, or one of its tasks has ended.
    pub fn is_ending(&self) -> bool {
        self.is_ending
    }

    /// The cycles since the last poll: the task, by its place in the plan, and its record.
    pub fn records(&self) -> &'a [(usize, CycleRecord)] {
        &self.news.records
    }

    /// The set-points that were applied since the last poll.
    pub fn applied(&self) -> &'a [Applied] {
        &self.news.applied
    }
}

impl<S: Service> Running<S> {
    pub(crate) fn new(
        threads: Threads,
        parts: Parts<S>,
        grants: Vec<ThreadGrant>,
        epoch_ns: u64,
    ) -> Self {
        let (news, limiter) = (News::default(), Limiter::default());
        Self { threads, parts, grants, epoch_ns, news, set_points: 0, limiter }
    }

    /// Takes in what the cycles did, and does what a cycle must not: connects what failed to connect,
    /// resolves and announces layouts, logs what blocks and inputs ran into, publishes telemetry.
    ///
    /// For an ordinary thread, every [`POLL_INTERVAL`] or so; it never waits. A node that is polled
    /// less often loses records, which are counted, and connects later to peers that were busy.
    pub fn poll(&mut self) -> Poll<'_> {
        // Asked first: what a task did before its end is then in its ring.
        let is_running = !self.threads.have_ended();
        self.drain();
        self.tend();
        let is_fresh = self.parts.snapshots.update();
        if let (true, Some(telemetry)) = (is_fresh, &mut self.parts.telemetry) {
            telemetry.publish(&self.parts.snapshots);
        }
        let is_ending = !is_running || self.threads.stop.load(Ordering::Relaxed);
        Poll { is_running, is_ending, news: &self.news }
    }

    /// Asks all tasks to end, which they do within 200 ms; go on polling until none runs.
    pub fn stop(&self) {
        self.threads.stop();
    }

    /// The flag that ends the node when it is set, for another thread or a signal's handler.
    pub fn stop_flag(&self) -> Arc<AtomicBool> {
        self.threads.stop.clone()
    }

    /// When the grid of all tasks begins, in ns of `CLOCK_MONOTONIC`.
    pub fn epoch_ns(&self) -> u64 {
        self.epoch_ns
    }

    /// Writes values to input pins that nothing is wired to, and to inputs that are read from no
    /// service: `"block.pin"`, `"input"`.
    ///
    /// All of a call's values for one task are applied together, at the start of one of its next
    /// cycles. Returns a number, by which [`Poll::applied`] says in which cycle that was. A pin that
    /// its block reads in the first call only takes the value without effect.
    ///
    /// # Errors
    /// There is no such pin, something else writes it, its type does not have the value, or a task is
    /// more than 64 calls behind. Nothing is written then.
    pub fn set<'a>(
        &mut self,
        values: impl IntoIterator<Item = (&'a str, f64)>,
    ) -> Result<u64, SetError> {
        let mut writes: Vec<Vec<(usize, f64)>> = vec![Vec::new(); self.parts.tasks.len()];
        for (name, value) in values {
            let found = self.parts.pins.find(name, value)?;
            if let (Some(service), Some(_)) = (found.service, &self.parts.participant) {
                let (input, service) = (name.to_owned(), service.to_owned());
                return Err(SetError::Fed { input, service });
            }
            if let Some(writes) = writes.get_mut(found.task) {
                writes.push((found.slot, value));
            }
        }
        if self.threads.have_ended() {
            return Err(SetError::Ended);
        }
        self.take_back();
        let wanted = || self.parts.tasks.iter().zip(&writes).filter(|(_, w)| !w.is_empty());
        if let Some((task, _)) = wanted().find(|(task, _)| !task.set_points.has_room()) {
            return Err(SetError::Busy { task: task.name.clone() });
        }
        let number = self.set_points;
        self.set_points += 1;
        for (task, writes) in self.parts.tasks.iter_mut().zip(writes) {
            if !writes.is_empty() {
                task.set_points.send(Transaction { number, writes: writes.into(), cycle: 0 });
            }
        }
        Ok(number)
    }

    /// The newest value of an input, of an output pin (`"block.pin"`), or of a task's timing
    /// (`"task.NAME.cycle"`): what telemetry shows, at most 20 ms before the last [`poll`](Self::poll).
    /// `None`: there is none of this name among the first 1024 signals of its task.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.parts.snapshots.value(name)
    }

    /// Ends the node if it still runs, and tells what it did.
    ///
    /// # Errors
    /// A task panicked.
    pub fn finish(mut self) -> Result<Outcome, TaskPanicked> {
        self.stop();
        while !self.threads.have_ended() {
            self.poll();
            std::thread::sleep(Duration::from_millis(1));
        }
        // What the last cycles ran into is still to be logged.
        self.poll();
        let Self { threads, mut parts, grants, .. } = self;
        let done = threads.join()?;
        let mut end = End::Asked;
        let mut tasks = Vec::new();
        let mut alarms = parts.alarms;
        for ((task, grant), done) in parts.tasks.iter_mut().zip(grants).zip(done) {
            alarms.extend(task.resolvers.iter_mut().flat_map(Resolver::alarms));
            let Some(done) = done else { continue };
            match done.stop_reason {
                Some(StopReason::Overrun) => {
                    end = End::Overrun { task: task.name.clone(), missed: task.timing.missed() };
                }
                None if end == End::Asked => end = End::Cycles,
                None | Some(StopReason::Requested) => {}
            }
            tasks.push(outcome(&task.name, &task.timing, grant, done));
        }
        Ok(Outcome { end, tasks, alarms })
    }

    fn drain(&mut self) {
        self.news.records.clear();
        self.news.applied.clear();
        for (index, task) in self.parts.tasks.iter_mut().enumerate() {
            let mut newest = None;
            while let Ok(record) = task.records.pop() {
                task.timing.record(&record);
                self.news.records.push((index, record));
                newest = Some(record);
            }
            if let Some(newest) = newest {
                self.parts.snapshots.note(index, &newest);
            }
        }
        self.take_back();
    }

    /// Frees the set-points that were applied.
    fn take_back(&mut self) {
        for (index, task) in self.parts.tasks.iter_mut().enumerate() {
            while let Some((number, cycle)) = task.set_points.applied() {
                self.news.applied.push(Applied { number, task: index, cycle });
            }
        }
    }

    fn tend(&mut self) {
        let Parts { tasks, announcers, telemetry, participant, .. } = &mut self.parts;
        for task in tasks.iter_mut() {
            task.log.write(&mut self.limiter);
        }
        let Some(participant) = participant.as_deref() else { return };
        participant.tend();
        for resolver in tasks.iter_mut().flat_map(|task| &mut task.resolvers) {
            resolver.tend(participant.ordinary());
        }
        for announcer in announcers {
            announcer.tend(participant.ordinary());
        }
        if let Some(telemetry) = telemetry {
            telemetry.tend(participant);
        }
    }
}

fn outcome(
    name: &str,
    timing: &isochrone_timing::TaskTiming,
    grant: ThreadGrant,
    done: Done,
) -> TaskOutcome {
    TaskOutcome {
        name: name.to_owned(),
        grant,
        margin_ns: done.margin_ns,
        timing: timing.clone(),
        costs: done.costs,
        block_errors: done.block_errors,
        input_rejects: done.input_rejects,
        connects: done.connects,
        connect_errors: done.connect_errors,
        lost_snapshots: done.lost_snapshots,
        links: done.links,
    }
}

impl<S: Service> std::fmt::Debug for Running<S> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Running").field("epoch_ns", &self.epoch_ns).finish_non_exhaustive()
    }
}
