//! Frames of values between processes, over [iceoryx2] shared memory, without copying.
//!
//! A **frame** is a consistent snapshot of one cycle: a slice of `f64` with a [`FrameHeader`]. A
//! [`FramePublisher`] writes the frames of one service, a [`FrameSubscriber`] reads them; both
//! belong to a [`Participant`] of a [`Domain`]. All are generic over the service variant, so the
//! same ports work across processes ([`ipc::Service`]) and within one ([`local::Service`]).
//!
//! Set-up (`join`, `open`) allocates, accesses files, may wait for some hundred milliseconds and
//! returns `Result`. The cycle (`send`, `newest`) never waits or logs, and counts errors. Anything
//! that allocates or maps memory belongs in the *slack* between two cycles:
//! [`FramePublisher::prepare`] and [`FrameSubscriber::maintain`]. An ordinary thread retries
//! failed connections with [`Participant::tend`]. Ports for real-time threads are opened by
//! [`RealTime`], and become usable in the thread that [enters](ForRealTime::enter) with them.
//!
//! The services are plain iceoryx2 services, visible to every program, tool or language binding of
//! the same version. The channels of a frame are announced on a separate service: a
//! [`LayoutAnnouncer`] sends the announcement and a [`LayoutWatcher`] receives it, both in an
//! ordinary thread. [`Announcing`] is such a thread of a publisher.
//!
//! A [`SignalReader`] puts reading, layouts and waiting together for a program's ordinary thread: it gives the
//! values of each frame by their names. Nothing wakes a reader, since that would cost the thread that sends a
//! system call; it sleeps until the next frame is due.
//!
//! Beside the frames, a [`RequestServer`] answers the requests of up to eight [`RequestClient`]s: bytes
//! both ways, in ordinary threads.
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

mod backoff;
mod config;
mod config_keys;
mod domain;
mod error;
mod exhausted;
mod file_override;
mod for_real_time;
mod frames;
mod listed_node;
mod listing;
mod participant;
mod participant_ref;
mod process_state;
mod real_time;
mod requests;
mod space;
mod twins;
mod variant;

pub use domain::{Domain, IsolatedDomain, interrupt_waiting_by};
pub use error::{
    AnnouncementError, AnnouncingError, DomainError, JoinError, LayoutConflict, LayoutError,
    OpenError, ServiceNameError, SignalError,
};
pub use exhausted::{descriptors as descriptor_shortage, limit as limit_reached, thread_remedy};
pub(crate) use file_override::give_up_file_override;
pub use for_real_time::{ForRealTime, InRealTime};
pub use frames::announcement::Announcement;
pub use frames::announcing::Announcing;
pub use frames::following::longest_silence_ns;
pub use frames::frame_ref::FrameRef;
pub use frames::header::{Credible, FrameHeader, SenderClock, Stamps};
pub use frames::kept::KeptService;
pub use frames::layout::{FrameLayout, SignalSpec};
pub use frames::layout_ports::{LayoutAnnouncer, LayoutWatcher};
pub use frames::publisher::{FramePublisher, PublisherCounters, Stamp};
pub use frames::raw::{raw_publisher, raw_subscriber};
pub use frames::service::{READERS, check_service_name, layout_service_name, refuse_own_service};
pub use frames::signal_frame::{LayoutKey, Receipt, SignalFrame};
pub use frames::signal_reader::SignalReader;
pub use frames::subscriber::{Depth, FrameSubscriber};
pub use frames::subscriber_counters::SubscriberCounters;
pub use frames::told_layouts::ToldLayouts;
pub use frames::writers::{PUBLISHER_PORT_NAME, TWIN_PORT_NAME};
pub use iceoryx2::config::Config;
pub use iceoryx2::prelude::LogLevel;
pub use iceoryx2::service::{ipc, ipc_threadsafe, local};
pub use isochrone_model::Flags;
pub use listed_node::ListedNode;
pub use listing::ListedService;
pub use participant::Participant;
pub use participant_ref::ParticipantRef;
pub use process_state::is_stopped;
pub use real_time::RealTime;
pub use requests::{
    Answer, AnswerError, Delivery, MAX_CLIENTS, MAX_MESSAGE_BYTES, MAX_SERVERS, PLACES_TO_ACT,
    Request, RequestClient, RequestError, RequestServer, RequestUpkeep, ServingProcess, Unanswered,
};
pub use twins::{MAX_TWIN_TASKS, Seat, SeatError, Takeover, TwinPage};
pub use variant::Service;

/// Restricts iceoryx2's messages to `level` and above.
///
/// Messages go to `tracing` (the workspace enables iceoryx2's feature of that name), but iceoryx2
/// checks its own level first, which is `Info` until this function is called. [`Participant::join`]
/// sets it to [`LogLevel::Warn`] unless this was called before.
pub fn set_log_level(level: LogLevel) {
    participant::LOG_LEVEL.get_or_init(|| ());
    iceoryx2::prelude::set_log_level(level);
}
