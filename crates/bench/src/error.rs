//! Errors of a bench.

use std::fmt::Display;
use std::io;

use isochrone_engine::{BuildError, Diagnostics};
use isochrone_ipc::JoinError;
use isochrone_processes::{ChildError, CompanyError};

/// What can go wrong with a bench.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum BenchError {
    /// The settings are wrong, or ask for what is not there.
    #[error("{0}")]
    Usage(String),
    /// Something went wrong while it ran.
    #[error("{0}")]
    Failed(String),
    /// A configuration has errors.
    #[error("the configuration has errors")]
    Configuration(Diagnostics),
    /// An engine cannot be made of a plan.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// A domain of the bench's own cannot be had.
    #[error(transparent)]
    Company(#[from] CompanyError),
    /// The domain cannot be joined.
    #[error(transparent)]
    Join(#[from] JoinError),
    /// A process did not do what it should.
    #[error(transparent)]
    Process(#[from] ChildError),
}

impl BenchError {
    /// A thread cannot be started.
    pub(crate) fn no_thread(cause: io::Error) -> Self {
        Self::Failed(format!("cannot start a thread: {cause}; {}", isochrone_ipc::thread_remedy()))
    }

    /// A thread panicked.
    pub(crate) fn panicked(thread: &str) -> Self {
        Self::Failed(format!(
            "{thread} panicked; this is a bug of the bench, and stderr says where"
        ))
    }

    /// A file or a folder of the bench cannot be made.
    pub(crate) fn no_file(path: impl Display, cause: io::Error) -> Self {
        Self::Failed(format!("cannot write {path}: {cause}; see that there is room"))
    }

    /// An arm has no task to run.
    pub(crate) fn no_task(arm: &str) -> Self {
        Self::Failed(format!("arm \"{arm}\": it has no task; give its configuration one"))
    }
}

isochrone_model::debug_as_display!(BenchError);
