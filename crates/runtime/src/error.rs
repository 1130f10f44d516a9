//! What can go wrong with a node.

use std::io;

use isochrone_engine::BuildError;
use isochrone_engine::operate::Refusals;
use isochrone_ipc::{JoinError, OpenError};
use thiserror::Error;

/// Why a node could not be prepared. Nothing runs then, and nothing is left.
#[derive(Debug, Error)]
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
    /// The system has no thread for a task.
    #[error("cannot start the thread of task \"{task}\": {source}")]
    Thread {
        /// The task.
        task: String,
        /// The system's error.
        source: io::Error,
    },
    /// The thread of a task panicked in its set-up.
    #[error(transparent)]
    Panicked(#[from] TaskPanicked),
}

/// The thread of a task panicked, which only a block can make it do. The node ended with it.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("task \"{task}\" panicked: {message}")]
pub struct TaskPanicked {
    /// The task.
    pub task: String,
    /// What the panic said.
    pub message: String,
}

/// Why a request was not sent. Nothing happens then.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum RequestError {
    /// Something is wrong with it; all that is.
    #[error(transparent)]
    Refused(#[from] Refusals),
    /// A task has not yet applied the requests before. Try again after the next
    /// [`poll`](crate::Running::poll).
    #[error("task \"{task}\" has not applied the requests before this one; send fewer at a time")]
    Busy {
        /// The task.
        task: String,
    },
    /// The node has ended.
    #[error("the node has ended")]
    Ended,
}
