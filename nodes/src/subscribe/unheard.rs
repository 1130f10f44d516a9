//! Why nothing comes from publishers that are there.

use std::time::Duration;

use isochrone_control::{Client, silence};
use isochrone_ipc::{FrameSubscriber, Participant, ipc, is_stopped, limit_reached};

use crate::program;

type Service = ipc::Service;

/// How long a node may take to say whether it waits.
const PATIENCE: Duration = Duration::from_secs(1);

/// What keeps the frames of a service from this process, and the way out, where that is known: a limit of the process
/// that let connections fail, a publisher that is stopped, or a node that waits for `start`.
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
    let waits = || {
        let publishers = participant.publishers_at_once(service).unwrap_or_default();
        publishers.iter().find_map(|publisher| {
            let node = publisher.name.strip_prefix("isochrone/")?;
            let (alarms, _) = Client::connect(participant, node, PATIENCE).ok()?.alarms().ok()?;
            alarms.iter().any(|alarm| alarm.name == "warm_start").then(|| {
                let program = program::name();
                format!(
                    "node \"{node}\" goes on from its retained state and sends nothing before you run \
                     `{program} start {node}`"
                )
            })
        })
    };
    limit().or_else(stopped).or_else(waits)
}

/// Whether a connection to a publisher failed, or taking a frame did.
pub(crate) fn has_failures(subscriber: &FrameSubscriber<Service>) -> bool {
    let counters = subscriber.counters();
    counters.connect_errors + counters.receive_errors > 0
}
