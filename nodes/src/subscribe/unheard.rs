//! Why nothing comes from publishers that are there.

use isochrone_control::silence;
use isochrone_ipc::{FrameSubscriber, Participant, ipc, is_stopped, limit_reached};

type Service = ipc::Service;

/// What keeps the frames of a service from this process, and the way out, where that is known: a limit of the process
/// that let connections fail, or a publisher that is stopped.
pub(crate) fn obstacle(
    participant: &Participant<Service>,
    service: &str,
    subscriber: &FrameSubscriber<Service>,
) -> Option<String> {
    let limit = || limit_reached().filter(|_| has_failures(subscriber));
    let stopped = || {
        let publishers = participant.publishing_processes(service).unwrap_or_default();
        publishers.into_iter().find(|pid| is_stopped(*pid)).map(|pid| silence(Some(pid), true))
    };
    limit().or_else(stopped)
}

/// Whether a connection to a publisher failed, or taking a frame did.
pub(crate) fn has_failures(subscriber: &FrameSubscriber<Service>) -> bool {
    let counters = subscriber.counters();
    counters.connect_errors + counters.receive_errors > 0
}
