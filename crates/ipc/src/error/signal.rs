//! Errors of reading a signal of a received frame.

use thiserror::Error;

/// Why a frame has no value for a name, see [`SignalFrame`](crate::SignalFrame).
#[derive(Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
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
    #[error(
        "service {service:?} of {publisher:?} does not fit: its frames have no signal {name:?}; there is: \
         {available}"
    )]
    Missing {
        /// The service.
        service: String,
        /// Who writes the frames.
        publisher: String,
        /// The signal.
        name: String,
        /// The names of the frame's signals.
        available: String,
    },
    /// The frame is shorter than the layout that is announced for it.
    #[error(
        "service {service:?} of {publisher:?} does not fit: it announces at least {needed} values in a \
         frame and sent {channels}"
    )]
    TooShort {
        /// The service.
        service: String,
        /// Who writes the frames.
        publisher: String,
        /// Values of the frame.
        channels: usize,
        /// Values that are needed.
        needed: usize,
    },
}

isochrone_model::debug_as_display!(SignalError);
