//! The start of one of two processes: whether it holds the node, and what it follows if not.

use std::sync::Arc;
use std::thread;
use std::time::Duration;

use isochrone_engine::Plan;
use isochrone_ipc::{Participant, Seat, SeatError, Service, Takeover};
use thiserror::Error;

use super::twin::{Twin, number_of};

/// Between two looks whether the holder has started.
const PAUSE: Duration = Duration::from_millis(5);
/// Names of services beside those of the tasks' states.
const RESERVED: [&str; 2] = [super::relay::ACK, super::relay::DESK];

/// Why a process cannot be one of two of a node: what does not fit, and what to do.
#[derive(Error)]
#[non_exhaustive]
pub enum JoinTwinError {
    /// It has no seat beside the other.
    #[error(transparent)]
    Seat(#[from] SeatError),
    /// The holder has another configuration.
    #[error(
        "node \"{node}\" (process {process}) runs another configuration (sha256 {theirs:016x}…) than this one \
         (sha256 {ours:016x}…), and a standby goes on where the holder was: start it with the same file"
    )]
    OtherConfiguration {
        /// The node.
        node: String,
        /// The process that holds it.
        process: u32,
        /// The beginning of the SHA-256 of its configuration.
        theirs: u64,
        /// That of this one.
        ours: u64,
    },
    /// A task has a name that the services between the twins need.
    #[error(
        "a redundant node has no task called \"{task}\": its service would be that of the twins' messages; give it \
         another name"
    )]
    TaskName {
        /// The name.
        task: String,
    },
}

isochrone_model::debug_as_display!(JoinTwinError);

/// What one of two processes of a node is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TwinRole {
    /// It follows the holder, and does not have all that the holder has done yet, or not any more.
    Joining,
    /// It follows the holder, and can take over.
    Standby,
    /// It holds the node.
    Holder,
}

/// This process as one of two of a node, before that is [prepared](crate::Node::prepare_redundant).
#[derive(Debug, Clone)]
pub struct Redundancy {
    pub(crate) twin: Arc<Twin>,
    /// The process that holds the node at the start.
    holder: Option<u32>,
}

impl Redundancy {
    /// Joins as one of two processes of a node: the first one holds it, the other follows and takes over after so many
    /// silent releases. Waits until the holder has started; `None`: `is_due` said to give up meanwhile.
    ///
    /// # Errors
    /// There are two already, or the holder has another configuration.
    pub fn join<S: Service>(
        plan: &Plan,
        participant: &Participant<S>,
        after: u32,
        is_due: impl Fn() -> bool,
    ) -> Result<Option<Self>, JoinTwinError> {
        let tasks: Vec<&str> = plan.tasks.iter().map(|task| task.name.as_str()).collect();
        if let Some(task) = tasks.iter().find(|task| RESERVED.contains(task)) {
            return Err(JoinTwinError::TaskName { task: (*task).to_owned() });
        }
        let tasks = tasks.as_slice();
        while !is_due() {
            let seat = Arc::new(participant.take_seat(&plan.node, tasks)?);
            let joined = Self::follow(plan, seat, after, &is_due)?;
            if joined.is_some() {
                return Ok(joined);
            }
        }
        Ok(None)
    }

    /// In this seat, as the holder or as soon as the holder has started; `None`: it died before it could be followed, or
    /// `is_due` said to give up.
    fn follow(
        plan: &Plan,
        seat: Arc<Seat>,
        after: u32,
        is_due: impl Fn() -> bool,
    ) -> Result<Option<Self>, JoinTwinError> {
        let ours = number_of(&plan.source.sha256());
        if seat.term().is_some() {
            return Ok(Some(Self::new(seat, ours, after)));
        }
        let of_holder = || {
            let has_started = seat.is_held_by_other() && seat.page().epoch_ns().is_some();
            seat.page().configuration().filter(|_| has_started)
        };
        let theirs = loop {
            if let Some(theirs) = of_holder() {
                break theirs;
            }
            if is_due() || !seat.has_twin() {
                return Ok(None);
            }
            thread::sleep(PAUSE);
        };
        if theirs != ours {
            let (node, process) = (plan.node.clone(), seat.other_process().unwrap_or(0));
            return Err(JoinTwinError::OtherConfiguration { node, process, theirs, ours });
        }
        Ok(Some(Self::new(seat, ours, after)))
    }

    fn new(seat: Arc<Seat>, configuration: u64, after: u32) -> Self {
        let holder = seat.term().is_none().then(|| seat.other_process()).flatten();
        Self { twin: Arc::new(Twin::new(seat, configuration, after)), holder }
    }

    /// The process that held the node when this one joined; `None`: this one holds it from the start.
    pub fn holder(&self) -> Option<u32> {
        self.holder
    }

    /// What this process is now.
    pub fn role(&self) -> TwinRole {
        if self.twin.holds() {
            TwinRole::Holder
        } else if self.twin.can_take_over(self.twin.seat().page().term()) {
            TwinRole::Standby
        } else {
            TwinRole::Joining
        }
    }

    /// The last takeover of the node; `None`: there was none.
    pub fn last_takeover(&self) -> Option<Takeover> {
        self.twin.seat().page().last_takeover()
    }

    /// Whether the holder died before this process had a state of each task: the node is to be started anew.
    pub fn is_orphaned(&self) -> bool {
        self.twin.is_orphaned()
    }

    /// Whether it once had all, and the holder did things without it since.
    pub fn was_complete(&self) -> bool {
        self.twin.is_complete(self.twin.seat().page().term())
    }

    /// Goes on as the holder of a node that is to be started anew; before, the node of this has
    /// [finished](crate::Running::finish).
    ///
    /// # Errors
    /// The domain cannot be locked.
    pub fn start_over<S: Service>(
        self,
        plan: &Plan,
        participant: &Participant<S>,
        is_due: impl Fn() -> bool,
    ) -> Result<Option<Self>, JoinTwinError> {
        let (seat, after) = (Arc::clone(self.twin.seat()), self.twin.after);
        participant.start_over(&seat)?;
        if let Some(joined) = Self::follow(plan, Arc::clone(&seat), after, &is_due)? {
            return Ok(Some(joined));
        }
        drop((self, seat));
        Self::join(plan, participant, after, is_due)
    }
}
