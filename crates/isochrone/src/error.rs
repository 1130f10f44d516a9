//! Whatever a program with a node in it may meet.

use isochrone_control::ClientError;
use isochrone_control::desk::SaveError;
use isochrone_cyclic::GrantRefusal;
use isochrone_engine::{BuildError, Diagnostics, PlanError, ReadError};
use isochrone_ipc::{
    AnnouncementError, AnnouncingError, AnswerError, DomainError, JoinError, LayoutConflict,
    LayoutError, OpenError, RequestError, SeatError, ServiceNameError, SignalError,
};
use isochrone_machine::{NoSuchCpu, NoThrottling};
use isochrone_model::{NumberError, Refusal};
use isochrone_recording::WriteError;
use isochrone_runtime::journal::JournalError;
use isochrone_runtime::state::{DamagedState, StateError};
use isochrone_runtime::{ApplyError, JoinTwinError, NodePanicked, PrepareError, SendError};
use isochrone_timing::DecodeError;

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
    /// The plan cannot be stepped.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// The domain of iceoryx2 cannot be found or made.
    #[error(transparent)]
    Domain(#[from] DomainError),
    /// It cannot be joined.
    #[error(transparent)]
    Join(#[from] JoinError),
    /// A port cannot be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The thread that announces a layout does not run.
    #[error(transparent)]
    Announcing(#[from] AnnouncingError),
    /// Frames cannot have a layout.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// What announces the layout of frames cannot be understood.
    #[error(transparent)]
    Announcement(#[from] AnnouncementError),
    /// Frames do not carry what is needed of them.
    #[error(transparent)]
    Conflict(#[from] LayoutConflict),
    /// A frame has no value for a name.
    #[error(transparent)]
    Signal(#[from] SignalError),
    /// The node cannot be prepared.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// A process cannot be one of two of a node.
    #[error(transparent)]
    Twin(#[from] JoinTwinError),
    /// The machine refused a thread or the process what makes it punctual.
    #[error("{}; {}", .0, .0.remedy())]
    Grant(#[from] GrantRefusal),
    /// The journal cannot be written or read.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// The state that a node retains cannot be read or written.
    #[error(transparent)]
    State(#[from] StateError),
    /// Bytes are no state of a node.
    #[error(transparent)]
    DamagedState(#[from] DamagedState),
    /// A recording cannot be written.
    #[error("the recording cannot be written: {0}")]
    Recording(#[from] WriteError),
    /// A request to the node was not sent.
    #[error(transparent)]
    Send(#[from] SendError),
    /// Something is wrong with a request.
    #[error(transparent)]
    Refused(#[from] Refusal),
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
    /// An answer to another program was not sent.
    #[error(transparent)]
    Answer(#[from] AnswerError),
    /// A text is no number.
    #[error(transparent)]
    Number(#[from] NumberError),
    /// A text is no histogram.
    #[error(transparent)]
    Histogram(#[from] DecodeError),
    /// A CPU does not exist, or is offline.
    #[error(transparent)]
    Cpu(#[from] NoSuchCpu),
    /// A text does not describe real-time throttling.
    #[error(transparent)]
    Throttling(#[from] NoThrottling),
}

/// A configuration that cannot be read leads to no plan.
impl From<ReadError> for Error {
    fn from(error: ReadError) -> Self {
        Self::Plan(error.into())
    }
}

/// Nor does one with errors.
impl From<Diagnostics> for Error {
    fn from(diagnostics: Diagnostics) -> Self {
        Self::Plan(diagnostics.into())
    }
}

/// A name that no service can have opens no port.
impl From<ServiceNameError> for Error {
    fn from(error: ServiceNameError) -> Self {
        Self::Open(error.into())
    }
}

/// Nor can one without a seat.
impl From<SeatError> for Error {
    fn from(error: SeatError) -> Self {
        Self::Twin(error.into())
    }
}

/// A request that was not sent asks nobody.
impl From<RequestError> for Error {
    fn from(error: RequestError) -> Self {
        Self::Client(error.into())
    }
}

isochrone_model::debug_as_display!(Error);
