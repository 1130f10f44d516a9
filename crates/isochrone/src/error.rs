//! Whatever a program with a node in it may meet.

use isochrone_control::ClientError;
use isochrone_control::desk::SaveError;
use isochrone_engine::{Diagnostics, PlanError};
use isochrone_ipc::{DomainError, JoinError, LayoutError, OpenError};
use isochrone_recording::WriteError;
use isochrone_runtime::journal::JournalError;
use isochrone_runtime::{ApplyError, NodePanicked, PrepareError, SendError};

/// What can go wrong with a node in a program, from its configuration to its end. Each variant is the error of the
/// function that failed; `?` makes it.
///
/// `Display` and `Debug` are both the sentence of that error, with what to do about it, so `main` may return it:
///
/// ```
/// use isochrone::prelude::*;
///
/// fn main() -> Result<(), isochrone::Error> {
/// #   fn main() -> Result<(), isochrone::Error> {
///     let plan = Plan::read("level.toml", &Rules::default())?;
///     let node = Node::prepare(&plan, Participant::join("level", Domain::find()?)?)?.start();
///     node.finish()?;
///     Ok(())
/// #   }
/// #   let error = main().unwrap_err();
/// #   assert!(format!("{error:?}").starts_with("cannot read level.toml: "));
/// #   Ok(())
/// }
/// ```
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// There is no plan.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The domain of iceoryx2 cannot be found or made.
    #[error(transparent)]
    Domain(#[from] DomainError),
    /// It cannot be joined.
    #[error(transparent)]
    Join(#[from] JoinError),
    /// A port cannot be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// Frames cannot have a layout.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// The node cannot be prepared.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// The journal cannot be written or read.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// A recording cannot be written.
    #[error("the recording cannot be written: {0}")]
    Recording(#[from] WriteError),
    /// A request to the node was not sent.
    #[error(transparent)]
    Send(#[from] SendError),
    /// The node does not run another configuration.
    #[error(transparent)]
    Apply(#[from] ApplyError),
    /// The running values cannot be written into a configuration.
    #[error(transparent)]
    Save(#[from] SaveError),
    /// A thread of the node panicked.
    #[error(transparent)]
    Panicked(#[from] NodePanicked),
    /// Another node was not asked, or did not do what it was asked for.
    #[error(transparent)]
    Client(#[from] ClientError),
}

impl From<Diagnostics> for Error {
    fn from(diagnostics: Diagnostics) -> Self {
        Self::Plan(diagnostics.into())
    }
}

isochrone_model::debug_as_display!(Error);
