//! What keeps a reader from a signal of a frame that came.

use thiserror::Error;

use super::layout::LayoutConflict;

/// Why a frame has no value for a name, see [`SignalFrame`](crate::SignalFrame).
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum SignalError {
    /// Nobody announces what the frame carries, so its values have no names: a plain writer sends it, or
    /// the announcement did not come in time. [`SignalFrame::channels`](crate::SignalFrame::channels) has
    /// its values in their order.
    #[error(
        "the frames of service {service:?} do not say what their {channels} values are; its publisher \
         announces no names"
    )]
    Unnamed {
        /// The service.
        service: String,
        /// Values of the frame.
        channels: usize,
    },
    /// The frame has no such signal. Its publisher may have started again with others, and may come back
    /// with this one.
    #[error("service {service:?} of {publisher:?} does not fit: {conflict}")]
    Unfit {
        /// The service.
        service: String,
        /// Who writes the frames.
        publisher: String,
        /// What is missing, and what is there.
        conflict: LayoutConflict,
    },
}
