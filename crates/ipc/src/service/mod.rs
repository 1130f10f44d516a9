//! Opening and creating the iceoryx2 services that carry frames, and those that carry their layouts.

pub(crate) mod holders;
mod name;
mod quality;
mod types;

use iceoryx2::prelude::{CallbackProgression, ServiceName};
use iceoryx2::service::builder::publish_subscribe::{
    PublishSubscribeCreateError as CreateError, PublishSubscribeOpenError as Cause,
};
use iceoryx2::service::port_factory::PortFactory as _;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;

use crate::backoff::Backoff;
use crate::domain::{EndsLocked, Held};
use crate::{
    FrameHeader, OpenError, Participant, Service, ServiceNameError, give_up_file_override,
};
use name::service_name;
pub use name::{check_service_name, layout_service_name};
use quality::{MAX_NODES, MAX_PUBLISHERS, MAX_SUBSCRIBERS, SPARE_PLACES};
pub(crate) use quality::{Quality, publisher_places, segment_bytes, subscriber_places};
pub(crate) use types::{Element, Header};
use types::{needed_types, types_of};

/// A service of messages that are slices, each with a header.
pub(crate) type Opened<S, E, H> = EndsLocked<PortFactory<S, [E], H>>;
pub(crate) type FrameService<S> = Opened<S, f64, FrameHeader>;
pub(crate) type LayoutService<S> = Opened<S, u8, ()>;

/// Opens the service as it is; creates it with `quality` when there is none.
pub(crate) fn open_or_create<S: Service>(
    participant: &Participant<S>,
    service: &str,
    quality: Quality,
) -> Result<FrameService<S>, OpenError> {
    let name = service_name(service)?;
    open_or_create_of(participant, service, &name, quality)
}

/// As [`open_or_create`], of the service that carries the layouts of the frames of `service`.
pub(crate) fn open_or_create_layouts<S: Service>(
    participant: &Participant<S>,
    service: &str,
) -> Result<LayoutService<S>, OpenError> {
    let service = layout_service_name(service)?;
    let name = ServiceName::new(&service)
        .map_err(|_| ServiceNameError::Reserved { name: service.clone() })?;
    open_or_create_of(participant, &service, &name, Quality::of_layouts())
}

fn open_or_create_of<S: Service, E: Element, H: Header>(
    participant: &Participant<S>,
    service: &str,
    name: &ServiceName,
    quality: Quality,
) -> Result<Opened<S, E, H>, OpenError> {
    let mut backoff = Backoff::new();
    loop {
        let held = participant.lock(service)?;
        let cause = match open_once(participant, service, name, &held)? {
            Attempt::Done(opened) => {
                if let Some(shortfall) = quality.shortfall(&opened) {
                    tracing::info!(
                        "service {service:?} is used as its creator made it: {shortfall}"
                    );
                }
                return Ok(opened);
            }
            Attempt::Again(cause) => cause,
            Attempt::Absent => match create(participant, name, quality) {
                Ok(created) => {
                    tracing::debug!("created service {service:?} with {quality}");
                    return Ok(created);
                }
                Err(cause) => cause.to_string(),
            },
        };
        drop(held);
        if !backoff.try_again() {
            return Err(failed(participant, service, cause));
        }
    }
}

/// Opens the service as it is, or returns `None` when there is none.
pub(crate) fn open_existing<S: Service>(
    participant: &Participant<S>,
    service: &str,
) -> Result<Option<FrameService<S>>, OpenError> {
    let name = service_name(service)?;
    let mut backoff = Backoff::new();
    loop {
        let held = participant.lock(service)?;
        let cause = match open_once(participant, service, &name, &held)? {
            Attempt::Done(opened) => return Ok(Some(opened)),
            Attempt::Absent => return Ok(None),
            Attempt::Again(cause) => cause,
        };
        drop(held);
        if !backoff.try_again() {
            return Err(failed(participant, service, cause));
        }
    }
}

/// As [`open_existing`], but an error at once where that would have to wait: for processes that run, and
/// are not held up by others that start or end.
pub(crate) fn open_existing_at_once<S: Service>(
    participant: &Participant<S>,
    service: &str,
) -> Result<Option<FrameService<S>>, OpenError> {
    let held = participant.lock_at_once(service)?;
    match open_once(participant, service, &service_name(service)?, &held)? {
        Attempt::Done(opened) => Ok(Some(opened)),
        Attempt::Absent => Ok(None),
        Attempt::Again(cause) => Err(failed(participant, service, cause)),
    }
}

/// Opens a port of a service under the domain's lock, and tries again while whoever is in the way may
/// be dead, or about to leave.
pub(crate) fn open_port<S: Service, E: Element, H: Header, P>(
    participant: &Participant<S>,
    opened: &Opened<S, E, H>,
    open: impl Fn() -> Result<P, OpenError>,
) -> Result<P, OpenError> {
    let mut backoff = Backoff::new();
    loop {
        let held = participant.lock(opened.name().as_str())?;
        let port = open();
        drop(held);
        match port {
            Ok(port) => return Ok(port),
            Err(refusal) => {
                clean_up(participant, opened);
                if !backoff.try_again() {
                    return Err(refusal);
                }
            }
        }
    }
}

/// Removes what the dead left in the domain and in this service: they may take the places of the living.
fn clean_up<S: Service, E: Element, H: Header>(
    participant: &Participant<S>,
    opened: &Opened<S, E, H>,
) {
    let Ok(held) = participant.lock(opened.name().as_str()) else { return };
    let domain = participant.membership();
    domain.sweep::<S>(&held);
    let mut ports = Vec::new();
    opened.dynamic_config().list_publishers(|port| {
        ports.push((port.node_id, port.publisher_id.value()));
        CallbackProgression::Continue
    });
    opened.dynamic_config().list_subscribers(|port| {
        ports.push((port.node_id, port.subscriber_id.value()));
        CallbackProgression::Continue
    });
    domain.remove_strangers::<S>(opened.service_hash(), &ports, &held);
}

pub(crate) fn failed<S: Service>(
    participant: &Participant<S>,
    service: &str,
    cause: impl ToString,
) -> OpenError {
    OpenError::Failed {
        service: service.to_owned(),
        domain: participant.domain(),
        cause: crate::exhausted::or(
            participant.membership().config(),
            cause.to_string(),
            "see that /dev/shm is not full and that no peer hangs in its start, then try again",
        ),
    }
}

enum Attempt<S: Service, E: Element, H: Header> {
    Done(Opened<S, E, H>),
    Absent,
    /// It is between being and not being, or has no place: what stands in the way is removed, or too
    /// young for it.
    Again(String),
}

/// Opens without a single wish about quality of service, so that every service of our types fits,
/// also one that a link between machines created with its own defaults.
fn open_once<S: Service, E: Element, H: Header>(
    participant: &Participant<S>,
    service: &str,
    name: &ServiceName,
    held: &Held,
) -> Result<Attempt<S, E, H>, OpenError> {
    // Root can open what nobody may read yet, and would wait for it in iceoryx2 for ever.
    let _given_up = give_up_file_override();
    let opened = participant
        .node()
        .service_builder(name)
        .publish_subscribe::<[E]>()
        .user_header::<H>()
        .open();
    let owned = || service.to_owned();
    let cause = match opened {
        Ok(opened) => {
            return Ok(Attempt::Done(participant.membership().keep(opened)));
        }
        Err(cause) => cause,
    };
    Err(match cause {
        Cause::DoesNotExist => return Ok(Attempt::Absent),
        Cause::ExceedsMaxNumberOfNodes => {
            participant.membership().sweep::<S>(held);
            return Ok(Attempt::Again("all its places for nodes are taken".to_owned()));
        }
        Cause::IncompatibleTypes | Cause::IncompatibleMessagingPattern => OpenError::OtherTypes {
            service: owned(),
            carries: types_of(participant, name),
            needs: format!("{} are {}", E::MESSAGES, needed_types::<E, H>()),
        },
        Cause::VersionMismatch => {
            OpenError::OtherVersion { service: owned(), ours: "0.10.0".to_owned() }
        }
        Cause::ServiceInCorruptedState => {
            OpenError::Corrupted { service: owned(), domain: participant.domain() }
        }
        Cause::InsufficientPermissions => {
            OpenError::Permission { service: owned(), domain: participant.domain() }
        }
        // No process that knows the lock creates or removes it at this moment.
        cause => {
            participant.membership().sweep::<S>(held);
            return Ok(Attempt::Again(cause.to_string()));
        }
    })
}

fn create<S: Service, E: Element, H: Header>(
    participant: &Participant<S>,
    name: &ServiceName,
    quality: Quality,
) -> Result<Opened<S, E, H>, CreateError> {
    let created = participant
        .node()
        .service_builder(name)
        .publish_subscribe::<[E]>()
        .user_header::<H>()
        .enable_safe_overflow(true)
        // A late reader waits for the next cycle. With a history it would first get a frame that
        // may be as old as the writer's last sign of life, and a frame can be a command.
        .history_size(0)
        .subscriber_max_buffer_size(quality.buffer)
        .subscriber_max_borrowed_samples(quality.borrowed)
        .max_publishers(MAX_PUBLISHERS + SPARE_PLACES)
        .max_subscribers(MAX_SUBSCRIBERS + SPARE_PLACES)
        .max_nodes(MAX_NODES)
        .create();
    created.map(|created| participant.membership().keep(created))
}
