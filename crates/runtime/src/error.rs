//! Errors of a node.

use std::fmt::Display;
use std::io;

use isochrone_engine::{BuildError, Diagnostics};
use isochrone_ipc::{JoinError, OpenError};
use isochrone_model::Refusal;
use isochrone_timing::units::duration;
use thiserror::Error;

use crate::keeping::state::StateError;
use crate::node::outcome::Outcome;

/// Why a node could not be prepared. Nothing runs then, and nothing is left.
#[derive(Error)]
#[non_exhaustive]
pub enum PrepareError {
    /// The domain could not be joined for real time.
    #[error(transparent)]
    Join(#[from] JoinError),
    /// A port could not be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The plan was changed since it was made, and cannot be stepped.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// The state of the node could not be restored.
    #[error(transparent)]
    State(#[from] StateError),
    /// A node of this name lives in the domain.
    #[error(
        "node \"{node}\" runs already: {other}; end it, or give this one another name ([node] name)"
    )]
    RunsAlready {
        /// The name.
        node: String,
        /// Name, executable and process id of the one that runs.
        other: String,
    },
    /// A redundant node has more state than is handed over in every cycle.
    #[error(
        "node \"{node}\" has {bytes} bytes of state, and a redundant node at most 1048576, as a standby gets it after every \
         cycle; divide the node"
    )]
    StateTooLarge {
        /// The node.
        node: String,
        /// The bytes of all its tasks.
        bytes: usize,
    },
    /// A task of a redundant node has too little time to hand over its state in every cycle.
    #[error(
        "task \"{task}\" cannot be redundant: a copy of its state takes {took}, and may take a quarter of its period of \
         {period}; give it a longer period or fewer blocks",
        took = duration(*took_ns as f64),
        period = duration(*period_ns as f64)
    )]
    StateTooSlow {
        /// The task.
        task: String,
        /// The time of a copy, in ns.
        took_ns: u64,
        /// Its period, in ns.
        period_ns: u64,
    },
    /// The system has no thread for a task, for the supervisor or to serve the requests of other programs: which of
    /// them, why, and what to do about it.
    #[error("{0}")]
    Thread(String),
    /// The thread of a task panicked during set-up.
    #[error(transparent)]
    Panicked(#[from] TaskPanicked),
    /// The supervisor panicked during set-up.
    #[error(transparent)]
    SupervisorPanicked(#[from] SupervisorPanicked),
}

impl PrepareError {
    /// What the system has no thread for: the end of "cannot start".
    pub(crate) fn no_thread(what: impl Display, cause: io::Error) -> Self {
        let remedy = isochrone_ipc::thread_remedy();
        Self::Thread(format!("cannot start {what}: {cause}; {remedy}"))
    }
}

/// A block of a task panicked, and the node ended.
#[derive(Clone, PartialEq, Eq, Error)]
#[error(
    "task \"{task}\" panicked{}{}: {message}",
    .block.as_ref().map(|block| format!(" in block {block}")).unwrap_or_default(),
    .place.as_ref().map(|place| format!(" at {place}")).unwrap_or_default()
)]
pub struct TaskPanicked {
    /// The task.
    pub task: String,
    /// The block and its type: `"level" (Pid)`. Where blocks of one type are stepped together, those
    /// that it may have been: `"first" or "second" (Pid)`. `None` if it was in none.
    pub block: Option<String>,
    /// What the panic said.
    pub message: String,
    /// File, line and column of the source; `None` unless
    /// [`hold_panic_messages`](crate::hold_panic_messages) was called.
    pub place: Option<String>,
}

/// The supervisor of a node panicked, the thread that does everything that is not real time. The tasks were stopped
/// and the node ended. This is a bug in isochrone, or in something of the program that runs in this thread, such as
/// its `tracing` subscriber.
#[derive(Clone, PartialEq, Eq, Error)]
#[error("the node's supervisor panicked, and the node has ended: {message}")]
#[non_exhaustive]
pub struct SupervisorPanicked {
    /// What the panic said.
    pub message: String,
}

/// A thread of a node panicked, and the node ended with it. `Display` has a line for each panic.
#[derive(Error)]
#[non_exhaustive]
pub enum NodePanicked {
    /// Tasks panicked.
    #[error("{}", .panics.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    #[non_exhaustive]
    Tasks {
        /// The panics, in the order of the tasks; at least one.
        panics: Vec<TaskPanicked>,
        /// What all tasks did until then.
        outcome: Box<Outcome>,
    },
    /// The supervisor panicked.
    #[error("{panic}")]
    #[non_exhaustive]
    Supervisor {
        /// What the panic said.
        panic: SupervisorPanicked,
        /// What all tasks did until they ended. It has no tasks if the supervisor panicked while it put the outcome
        /// together.
        outcome: Box<Outcome>,
    },
}

impl NodePanicked {
    /// What all tasks did until then.
    pub fn outcome(&self) -> &Outcome {
        let (Self::Tasks { outcome, .. } | Self::Supervisor { outcome, .. }) = self;
        outcome
    }

    /// The same.
    pub fn into_outcome(self) -> Outcome {
        let (Self::Tasks { outcome, .. } | Self::Supervisor { outcome, .. }) = self;
        *outcome
    }
}

/// Why a node does not change to another configuration. Nothing has changed then.
#[derive(Error)]
#[non_exhaustive]
pub enum ApplyError {
    /// The configuration has errors; all that are found.
    #[error(transparent)]
    Configuration(#[from] Diagnostics),
    /// Its parts are inconsistent.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// The running node does not allow it; everything that is in the way.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// A task has too little time for it between two cycles.
    #[error(
        "task \"{task}\" has {slack_ns} ns left in each of 99 % of its last 1000 cycles and may spend half \
         of them on the change, which takes {cost_ns} ns; try again when those cycles are over, allow \
         missed cycles (--allow-missed), or stop the node for it"
    )]
    NoSlack {
        /// The task.
        task: String,
        /// The time that is left in the period after its longest cycle, in ns: of the last 1000 cycles, without the
        /// longest 1 %.
        slack_ns: u64,
        /// What the change takes, in ns.
        cost_ns: u64,
    },
    /// No cycle of a task has been seen yet, so the time that it has is unknown. Try again when it has run, or allow
    /// missed cycles.
    #[error("no cycle of task \"{task}\" has been seen yet; ask again when it has run")]
    NotMeasured {
        /// The task.
        task: String,
    },
    /// A task has not yet applied earlier requests. Try again when it has run.
    #[error("task \"{task}\" has not applied the requests before this one; ask again in a moment")]
    Busy {
        /// The task.
        task: String,
    },
    /// The node has ended.
    #[error("the node has ended")]
    Ended,
}

/// Why a request was not sent. Nothing has changed then.
#[derive(Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SendError {
    /// Something is wrong with it: all findings.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// A task has not yet applied earlier requests. Try again when it has run.
    #[error(
        "task \"{task}\" has not come to the requests before this one ({by}); send fewer at a time"
    )]
    Busy {
        /// The task.
        task: String,
        /// The clients whose requests it has not applied: `64 of "anna"`.
        by: String,
    },
    /// The node has ended.
    #[error("the node has ended")]
    Ended,
}

isochrone_model::debug_as_display!(
    PrepareError,
    TaskPanicked,
    SupervisorPanicked,
    NodePanicked,
    ApplyError,
    SendError
);
