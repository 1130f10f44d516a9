//! The port of a publisher, of which a service has one.

use iceoryx2::port::publisher::{Publisher, PublisherCreateError};
use iceoryx2::prelude::{AllocationStrategy, BackpressureStrategy, PortName};
use iceoryx2::service::port_factory::PortFactory as _;

use crate::frames::peers::Peers;
use crate::frames::service::{self, FrameService, holders};
use crate::frames::writers::{self, PUBLISHER_PORT_NAME, Rival, TWIN_PORT_NAME};
use crate::{FrameHeader, OpenError, Participant, Service, give_up_file_override};

/// The frame that is being written, and the one that is on its way.
pub(crate) const MAX_LOANED: usize = 2;

/// Creates the port, and makes sure that nobody else writes the service.
pub(super) fn sole_port<S: Service>(
    participant: &Participant<S>,
    service: &str,
    opened: &FrameService<S>,
    channels: usize,
    frames: usize,
    peers: &Peers,
    takes_over: bool,
) -> Result<Publisher<S, [f64], FrameHeader>, OpenError> {
    let name = if participant.is_twin() { TWIN_PORT_NAME } else { PUBLISHER_PORT_NAME };
    let name = PortName::new(name).map_err(|cause| service::failed(participant, service, cause))?;
    let places = service::publisher_places(opened);
    let full = || OpenError::Full {
        service: service.to_owned(),
        what: "publisher",
        limit: places,
        holders: holders::of_publishers(opened),
    };
    service::open_port(participant, opened, || {
        let _given_up = give_up_file_override();
        // Looking first spares the readers a connection to a port that must go at once.
        refuse_second(participant, opened, service, None, takes_over)?;
        if opened.dynamic_config().number_of_publishers() >= places {
            return Err(full());
        }
        let created = opened
            .publisher_builder()
            .name(&name)
            .max_loaned_samples(MAX_LOANED)
            .initial_max_slice_len(channels)
            .override_sample_preallocation(move |_| frames)
            // Anything else would map new memory in the middle of a cycle.
            .allocation_strategy(AllocationStrategy::Static)
            // With overflow on this never matters. With it off (somebody else created the
            // service) the alternative is to wait for the reader, maybe for ever.
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .set_degradation_handler(peers.counting_handler())
            .create();
        let port = created.map_err(|cause| match cause {
            PublisherCreateError::ExceedsMaxSupportedPublishers => full(),
            cause => service::failed(participant, service, cause),
        })?;
        // A program of another make may have opened at the same time, and knows no lock.
        refuse_second(participant, opened, service, Some(port.id().value()), takes_over)?;
        Ok(port)
    })
}

/// Fails when somebody other than `own` writes the service: a publisher of ours, or one of another make unless
/// the service is taken over from that.
fn refuse_second<S: Service>(
    participant: &Participant<S>,
    opened: &FrameService<S>,
    service: &str,
    own: Option<u128>,
    takes_over: bool,
) -> Result<(), OpenError> {
    let name = |node| holders::node(&**opened, node);
    let service = service.to_owned();
    let is_own_twin = |node| {
        let details = participant.is_twin().then(|| holders::details(&**opened, node)).flatten();
        details.is_some_and(|details| details.name == participant.name())
    };
    match writers::rival(opened, own, is_own_twin) {
        Some(Rival::Ours(node)) => Err(OpenError::SecondPublisher { service, other: name(node) }),
        Some(Rival::Plain(node)) if !takes_over => {
            Err(OpenError::PlainWriter { service, other: name(node) })
        }
        _ => Ok(()),
    }
}
