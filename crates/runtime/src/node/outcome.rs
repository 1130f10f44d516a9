//! The outcome of a node.

use std::time::SystemTime;

use isochrone_control::desk::Changes;
use isochrone_cyclic::GrantRefusal;
use isochrone_model::{AlarmTotals, Force};
use isochrone_timing::{LinkReport, TaskReport};

use crate::keeping::recorder::RecordingOutcome;
use crate::node::alarms::Alarm;

/// What a node did, and why it ended.
#[derive(Debug)]
#[non_exhaustive]
pub struct Outcome {
    /// Why it ended.
    pub end: End,
    /// When it was started.
    pub started: SystemTime,
    /// What the machine refused its tasks.
    pub refusals: Vec<GrantRefusal>,
    /// What its tasks did and cost, in the order of the configuration. A task that panicked, or of which no
    /// cycle ran after the warm-up, has no costs.
    pub tasks: Vec<TaskReport>,
    /// What the ports of its tasks received or sent. How long that took is measured by the readers.
    pub links: Vec<LinkReport>,
    /// The alarms of the run: those that were logged, and for each task the block steps that reported an error and
    /// the releases that it missed.
    pub alarms: Vec<Alarm>,
    /// What its process alarms did, if it had any.
    pub process_alarms: Option<AlarmTotals>,
    /// The forces that were in place when it ended.
    pub forces: Vec<Force>,
    /// Parameters and variables that were set and not saved since: their values are lost.
    pub unsaved: Changes,
    /// Its recording, if it had one.
    pub recording: Option<RecordingOutcome>,
}

impl Outcome {
    /// The outcome of a node of which nothing else is known.
    pub(crate) fn begun(started: SystemTime, refusals: Vec<GrantRefusal>) -> Self {
        let (tasks, links, alarms, forces) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let (end, process_alarms, recording) = (End::Asked, None, None);
        let unsaved = Changes::default();
        Self {
            end,
            started,
            refusals,
            tasks,
            links,
            alarms,
            process_alarms,
            forces,
            unsaved,
            recording,
        }
    }
}

/// Why a node ended.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum End {
    /// It was asked to end.
    Asked,
    /// Its first task ran all its cycles.
    Cycles,
    /// A block of a task panicked; the first task, if there are several.
    Panicked {
        /// The task.
        task: String,
    },
    /// The supervisor panicked, the thread that does everything that is not real time.
    SupervisorPanicked,
    /// A task overran, and its configuration makes that end the node.
    Overrun {
        /// The task.
        task: String,
        /// How many releases it missed. If none, a cycle ended after the next release.
        missed: u64,
    },
}
