//! A running node, for the program that embeds it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, SystemTime};

use crate::error::NodePanicked;
use crate::node::operating::Shared;
use crate::node::outcome::Outcome;
use crate::supervisor::{Events, Supervisor};

/// A node that runs. Dropping it ends it.
///
/// It needs nothing from the program: its tasks run in threads of their own, and a supervisor does everything that is
/// not real time. Threads of the program may share it and operate it.
///
/// Dropping it waits for every task to end its cycle. A block that never returns from its step holds
/// that up for ever, as it does [`finish`](Self::finish); a thread cannot be ended from outside. A
/// program that must end all the same asks the node to [`stop`](Self::stop), waits for it
/// [for a time](Self::wait_within) of its own, and then calls
/// [`std::process::exit`] without dropping the node. What the process leaves in the domain is removed
/// by the next one that joins.
///
/// In a process that forks, the child has none of the threads and must not touch the node: fork only
/// to `exec`, as [`std::process::Command`] does.
#[must_use = "dropping it ends the node"]
pub struct Running {
    supervisor: Supervisor,
    pub(crate) shared: Shared,
    stop: Arc<AtomicBool>,
    epoch_ns: u64,
}

impl Running {
    pub(crate) fn new(
        supervisor: Supervisor,
        shared: Shared,
        stop: Arc<AtomicBool>,
        epoch_ns: u64,
    ) -> Self {
        Self { supervisor, shared, stop, epoch_ns }
    }

    /// Whether the node has not ended: a task still runs, or the last changes wait for the journal, which takes a
    /// second at most.
    pub fn is_running(&self) -> bool {
        self.supervisor.is_running()
    }

    /// Waits until the node ends: because its first task has run all its cycles, a task overran or a thread panicked,
    /// or because it was asked to [`stop`](Self::stop).
    pub fn wait(&self) {
        self.supervisor.await_end(None);
    }

    /// As [`wait`](Self::wait), but no longer than this; whether it has ended.
    pub fn wait_within(&self, time: Duration) -> bool {
        self.supervisor.await_end(Some(time))
    }

    /// The events from now on: cycles, and outcomes of requests. Use [`Prepared::events`](crate::Prepared::events)
    /// for the events from the first cycle on. Without a call, no events are kept.
    pub fn events(&self) -> Events {
        self.supervisor.events()
    }

    /// Asks all tasks to end, which they do within 200 ms.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
        self.supervisor.wake();
    }

    /// Lets a node send that goes on from its retained state and waits for this, as its configuration says
    /// (`warm_start = "confirm"`); whether it waited.
    pub fn start_sending(&self) -> bool {
        self.shared.lock().start_sending()
    }

    /// The names of the tasks that run. Of a node that was asked to [`stop`](Self::stop) 200 ms ago or
    /// earlier, those whose cycle takes long or hangs.
    pub fn unfinished_tasks(&self) -> impl Iterator<Item = String> + use<> {
        let unfinished: Vec<_> = self.shared.lock().unfinished().map(str::to_owned).collect();
        unfinished.into_iter()
    }

    /// The flag that ends the node when it is set, for another thread or a signal's handler.
    pub fn stop_flag(&self) -> Arc<AtomicBool> {
        self.stop.clone()
    }

    /// The number of each task's first cycle: more than 0 where it goes on from an earlier run.
    pub fn first_cycles(&self) -> Vec<u64> {
        self.shared.lock().first_numbers()
    }

    /// When the grid of all tasks begins, in ns of `CLOCK_MONOTONIC`.
    pub fn epoch_ns(&self) -> u64 {
        self.epoch_ns
    }

    /// The newest value of an input, of a variable, of an output pin (`"block.pin"`), or of a task's timing
    /// (`"task.NAME.cycle"`), as telemetry shows it: at most 40 ms or a period old. The values of a task are all of one
    /// cycle. `None`: the name is not among the first 1024 signals of its task, or no cycle of the task was shown yet.
    pub fn value(&self, name: &str) -> Option<f64> {
        self.shared.lock().snapshots.value(name)
    }

    /// Ends the node if it still runs, and returns its outcome.
    ///
    /// Waits for every task to end its cycle: for ever, if a block never returns from its step (see
    /// [`Running`]).
    ///
    /// # Errors
    /// Tasks panicked, or the supervisor; what all tasks did until then is in the error.
    pub fn finish(mut self) -> Result<Outcome, NodePanicked> {
        self.stop();
        let ended = self.supervisor.join();
        ended.unwrap_or_else(|| Ok(Outcome::begun(SystemTime::now(), Vec::new())))
    }

    /// Wakes the supervisor, to look for the outcome of a request.
    pub(crate) fn wake(&self) {
        self.supervisor.wake();
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stop();
    }
}

impl std::fmt::Debug for Running {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Running").field("epoch_ns", &self.epoch_ns).finish_non_exhaustive()
    }
}
