//! Frames of values between processes, over [iceoryx2] shared memory and without copying.
//!
//! A **frame** is one consistent snapshot of one cycle: a slice of `f64` with a [`FrameHeader`].
//! A [`FramePublisher`] writes frames of one service, a [`FrameSubscriber`] reads them; both belong
//! to a [`Participant`] of a [`Domain`]. All are generic over the service variant, so the same ports run across
//! processes ([`ipc::Service`]) and inside one ([`local::Service`]).
//!
//! Set-up (`join`, `open`) allocates, touches files, may wait for some hundred milliseconds and
//! returns `Result`. The cycle (`send`, `newest`) never waits, never logs and counts what went
//! wrong. What allocates or maps memory belongs in the *slack* between two cycles:
//! [`FramePublisher::prepare`] and [`FrameSubscriber::maintain`]. Connections that fail are made
//! good by an ordinary thread, with a [`Repair`].
//!
//! The services are plain iceoryx2: every other program, tool or language binding of the same
//! version sees them. What the channels of a frame are is announced beside it, on a service of its
//! own: a [`LayoutAnnouncer`] tells it, a [`LayoutWatcher`] learns it, both in an ordinary thread.
//!
//! [iceoryx2]: https://docs.rs/iceoryx2/0.10.0
#![cfg_attr(
    not(test),
    warn(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::print_stdout,
        clippy::print_stderr
    )
)]

mod announcement;
mod backoff;
mod config;
mod config_keys;
mod domain;
mod error;
mod exhausted;
mod following;
mod header;
mod layout;
mod layout_ports;
mod listing;
mod participant;
mod peers;
mod publisher;
mod real_time;
mod repair;
mod service;
mod space;
mod subscriber;
mod variant;
pub mod yardstick;

pub use announcement::Announcement;
pub use domain::{Domain, IsolatedDomain, interrupt_waiting_by};
pub use error::{
    AnnouncementError, DomainError, JoinError, LayoutConflict, LayoutError, OpenError,
    ServiceNameError,
};
pub use header::{Credible, FrameHeader, SenderClock, Stamps};
pub use iceoryx2::config::Config;
pub use iceoryx2::prelude::LogLevel;
pub use iceoryx2::service::{ipc, local};
pub use layout::{Binding, FrameLayout, SignalSpec, Wanted};
pub use layout_ports::{LayoutAnnouncer, LayoutWatcher};
pub use listing::{ListedNode, ListedService};
pub use participant::{FileOverrideGivenUp, Participant, give_up_file_override};
pub use publisher::{FramePublisher, PUBLISHER_PORT_NAME, PublisherCounters, Stamp};
pub use real_time::RealTime;
pub use repair::Repair;
pub use service::{check_service_name, layout_service_name};
pub use subscriber::{Depth, FrameRef, FrameSubscriber, SubscriberCounters};
pub use variant::Service;

/// Makes iceoryx2 hand on only messages of `level` and above.
///
/// Messages go to `tracing` (the workspace enables iceoryx2's feature of that name), but
/// iceoryx2 asks its own level first, and that is `Info` until somebody calls this.
/// [`Participant::join`] makes it [`LogLevel::Warn`] unless this was called before.
pub fn set_log_level(level: LogLevel) {
    participant::LOG_LEVEL.get_or_init(|| ());
    iceoryx2::prelude::set_log_level(level);
}
