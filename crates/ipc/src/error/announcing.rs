//! Errors of announcing a layout beside the thread that sends.

use std::io;

use thiserror::Error;

use crate::{OpenError, thread_remedy};

/// Why the thread that [announces](crate::Announcing) a layout does not run.
#[derive(Error)]
#[non_exhaustive]
pub enum AnnouncingError {
    /// The layout's service could not be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The thread could not be started.
    #[error("cannot start a thread: {0}; {remedy}", remedy = thread_remedy())]
    Thread(io::Error),
    /// The thread panicked.
    #[error("the thread that announces the layout ended in its start")]
    Ended,
}

isochrone_model::debug_as_display!(AnnouncingError);
