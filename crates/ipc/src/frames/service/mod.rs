//! Opening and creating the iceoryx2 services that carry frames, and those that carry their layouts.

mod attempt;
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

use crate::domain::{EndsLocked, LockGuard};
use crate::{
    FrameHeader, OpenError, Participant, Service, ServiceNameError, give_up_file_override,
};
pub(crate) use attempt::{Attempt, Obstacle, clean_up, failed, repeat, repeat_port};
pub(crate) use name::service_name;
pub use name::{check_service_name, layout_service_name, refuse_own_service};
pub use quality::READERS;
pub(crate) use quality::{Pool, Quality, publisher_places, subscriber_places};
pub(crate) use types::{Element, Header, describe};
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
    let name = ServiceName::new(&service).map_err(|_| ServiceNameError::reserved(&service))?;
    open_or_create_of(participant, &service, &name, Quality::of_layouts())
}

fn open_or_create_of<S: Service, E: Element, H: Header>(
    participant: &Participant<S>,
    service: &str,
    name: &ServiceName,
    quality: Quality,
) -> Result<Opened<S, E, H>, OpenError> {
    let open = |held: &LockGuard| {
        let attempt = open_once(participant, service, name, held)?;
        if let Attempt::Done(opened) = &attempt
            && let Some(shortfall) = quality.shortfall(opened)
        {
            tracing::info!("service {service:?} is used as its creator made it: {shortfall}");
        }
        Ok(attempt)
    };
    let create = || match create(participant, name, quality) {
        Ok(created) => {
            tracing::debug!("created service {service:?} with {quality}");
            Ok(Some(created))
        }
        Err(cause) => Err(cause.to_string()),
    };
    let opened = repeat(participant, service, open, create)?;
    opened.ok_or_else(|| failed(participant, service, "it was neither opened nor created"))
}

/// Opens the service as it is, or returns `None` when there is none.
pub(crate) fn open_existing<S: Service>(
    participant: &Participant<S>,
    service: &str,
) -> Result<Option<FrameService<S>>, OpenError> {
    let name = service_name(service)?;
    let open = |held: &LockGuard| open_once(participant, service, &name, held);
    repeat(participant, service, open, || Ok(None))
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

/// Opens a port of a service, see [`repeat_port`].
pub(crate) fn open_port<S: Service, E: Element, H: Header, P>(
    participant: &Participant<S>,
    opened: &Opened<S, E, H>,
    open: impl Fn() -> Result<P, OpenError>,
) -> Result<P, OpenError> {
    let service = opened.name().as_str();
    let ports = || {
        let mut ports = Vec::new();
        opened.dynamic_config().list_publishers(|port| {
            ports.push((port.node_id, port.publisher_id.value()));
            CallbackProgression::Continue
        });
        opened.dynamic_config().list_subscribers(|port| {
            ports.push((port.node_id, port.subscriber_id.value()));
            CallbackProgression::Continue
        });
        ports
    };
    let clean_up = || clean_up(participant, service, opened.service_hash(), ports);
    repeat_port(participant, service, open, clean_up)
}

/// Opens without a single wish about quality of service, so that every service of our types fits,
/// also one that a link between machines created with its own defaults.
fn open_once<S: Service, E: Element, H: Header>(
    participant: &Participant<S>,
    service: &str,
    name: &ServiceName,
    held: &LockGuard,
) -> Result<Attempt<Opened<S, E, H>>, OpenError> {
    // Root can open what nobody may read yet, and would wait for it in iceoryx2 for ever.
    let _given_up = give_up_file_override();
    let opened = participant
        .node()
        .service_builder(name)
        .publish_subscribe::<[E]>()
        .user_header::<H>()
        .open();
    let obstacle = match opened {
        Ok(opened) => return Ok(Attempt::Done(participant.membership().keep(opened))),
        Err(cause) => match cause {
            Cause::DoesNotExist => Obstacle::Absent,
            Cause::ExceedsMaxNumberOfNodes => Obstacle::NoPlaceForNode,
            Cause::IncompatibleTypes | Cause::IncompatibleMessagingPattern => {
                Obstacle::OtherTypes {
                    carries: types_of(participant, name),
                    needs: format!("{} are {}", E::MESSAGES, needed_types::<E, H>()),
                }
            }
            Cause::VersionMismatch => Obstacle::OtherVersion,
            Cause::ServiceInCorruptedState => Obstacle::Damaged,
            Cause::InsufficientPermissions => Obstacle::Forbidden,
            cause => Obstacle::Passing(cause.to_string()),
        },
    };
    obstacle.judge(participant, service, held)
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
        .max_publishers(quality.max_publishers())
        .max_subscribers(quality.max_subscribers())
        .max_nodes(quality.max_nodes())
        .create();
    created.map(|created| participant.membership().keep(created))
}
