//! What a node did.

use std::time::SystemTime;

use isochrone_cyclic::{Refusal, ThreadGrant, ThreadUsage};
use isochrone_engine::operate::Forced;
use isochrone_timing::{Direction, TaskTiming};

use crate::alarms::Alarm;
use crate::recorder::RecordingOutcome;

/// What a node did, and why it ended.
#[derive(Debug)]
#[non_exhaustive]
pub struct Outcome {
    /// Why it ended.
    pub end: End,
    /// When it was started.
    pub started: SystemTime,
    /// What the machine refused its tasks.
    pub refusals: Vec<Refusal>,
    /// Its tasks, in the order of the configuration.
    pub tasks: Vec<TaskOutcome>,
    /// What came up while it ran: what was logged, and for each task the steps of blocks that reported
    /// an error and the releases that it missed.
    pub alarms: Vec<Alarm>,
    /// What was still forced when it ended.
    pub forces: Vec<Forced>,
    /// Its recording, where it had one.
    pub recording: Option<RecordingOutcome>,
}

/// Why a node ended.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum End {
    /// It was asked to.
    Asked,
    /// Its first task ran all its cycles.
    Cycles,
    /// A block of a task panicked, the first one's if there are several.
    Panicked {
        /// The task.
        task: String,
    },
    /// A task overran, and its configuration says that this ends the node.
    Overrun {
        /// The task.
        task: String,
        /// Its releases that were missed. A task without any ended a cycle after its next release.
        missed: u64,
    },
}

/// What a task did and cost.
#[derive(Debug)]
pub struct TaskOutcome {
    /// Its name.
    pub name: String,
    /// What the machine granted its thread.
    pub grant: ThreadGrant,
    /// Why its CPU was chosen, if the configuration leaves it open.
    pub cpu_reason: Option<String>,
    /// How long before a release a hybrid wait was awake in the end, in ns; `None` for other waits.
    pub margin_ns: Option<u64>,
    /// How punctual its cycles were.
    pub timing: TaskTiming,
    /// What its thread used after the warm-up; `None` if no cycle ran after it, or the task panicked:
    /// a panic has costs of its own.
    pub costs: Option<Costs>,
    /// Steps of blocks that reported an error.
    pub block_errors: u64,
    /// Samples that an input did not take: its type cannot hold them, or the frame has none for it.
    pub input_rejects: u64,
    /// How often a port's peers were seen to come or go.
    pub connects: u64,
    /// Connections to a peer that failed at first.
    pub connect_errors: u64,
    /// Snapshots of its signals that were not fetched in time.
    pub lost_snapshots: u64,
    /// What each of its ports received or sent.
    pub links: Vec<Link>,
    /// Whether its inputs were ok, in the order of the plan.
    pub inputs: Vec<InputOutcome>,
}

/// Whether an input was ok.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputOutcome {
    /// The input.
    pub name: String,
    /// Its service; none if it is set by hand.
    pub service: Option<String>,
    /// Whether it was ok in the end.
    pub is_ok: bool,
    /// How often it ceased to be ok.
    pub falls: u64,
    /// How long it was not ok in all, the wait for its first sample included, in ns.
    pub not_ok_ns: u64,
}

impl InputOutcome {
    /// How long the first sample may take to come before that is worth a word.
    const PATIENCE_NS: u64 = 1_000_000_000;

    pub(crate) fn alarm(&self) -> Option<Alarm> {
        let Self { falls, not_ok_ns, is_ok, .. } = *self;
        let never_came = self.service.is_some() && !is_ok && not_ok_ns >= Self::PATIENCE_NS;
        let input = || self.name.clone();
        (falls > 0 || never_came).then(|| Alarm::InputNotOk {
            input: input(),
            is_ok,
            falls,
            not_ok_ns,
        })
    }
}

/// What a thread used, from the end of its [warm-up](isochrone_timing::warm_up_cycles) to its end.
#[derive(Debug, Clone, Copy)]
pub struct Costs {
    /// CPU time, page faults and switches.
    pub usage: ThreadUsage,
    /// How long that was, in ns.
    pub elapsed_ns: u64,
    /// Allocations; `None` if the program does not count them with
    /// [`CountingAllocator`](isochrone_cyclic::CountingAllocator).
    pub allocations: Option<Allocations>,
}

impl Costs {
    /// CPU time per elapsed time, 0 to 1; waiting by watching the clock counts.
    pub fn cpu_fraction(&self) -> f64 {
        self.usage.cpu_ns as f64 / self.elapsed_ns.max(1) as f64
    }
}

/// How often memory was asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Allocations {
    /// By the node itself: none, unless a block of the program's own allocates.
    pub cycle: u64,
    /// By iceoryx2: one for each frame, in the slack, and those with which it connects a peer, in the
    /// slack or, for a peer that joined just before the release, as it receives or sends.
    pub library: u64,
}

/// What a port received or sent. How long that took is for the readers to say. What only a receiver
/// can count is `None` for a port that sent.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Link {
    /// The service.
    pub service: String,
    /// Whether the port received or sent.
    pub direction: Direction,
    /// Frames received or sent.
    pub frames: u64,
    /// Frames published and not received, or that could not be sent. A control input reads the newest
    /// frame, so a faster publisher loses by design.
    pub lost: u64,
    /// Times that a publisher began anew, or that another one was followed.
    pub restarts: Option<u64>,
    /// Frames of other publishers than the one that is followed.
    pub other_writers: Option<u64>,
    /// Frames whose stamps lay in the future.
    pub future_stamps: Option<u64>,
    /// Frames that arrived with stamps older than any wait here explains.
    pub past_stamps: Option<u64>,
    /// Frames that could not be read, because nobody had announced their layout yet.
    pub unknown_layouts: Option<u64>,
}
