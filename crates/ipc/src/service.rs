//! Opening and creating the iceoryx2 services that carry frames.

use iceoryx2::prelude::{AttributeSpecifier, CallbackProgression, MessagingPattern, ServiceName};
use iceoryx2::service::builder::publish_subscribe::{
    PublishSubscribeCreateError as CreateError, PublishSubscribeOpenError as Cause,
};
use iceoryx2::service::port_factory::PortFactory as _;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;
use iceoryx2::service::static_config::message_type_details::{TypeDetail, TypeVariant};

use crate::backoff::Backoff;
use crate::domain::{EndsLocked, Held};
use crate::error::MAX_SERVICE_NAME_BYTES;
use crate::{
    FrameHeader, FrameLayout, LayoutError, OpenError, Participant, Service, ServiceNameError,
    give_up_file_override,
};

pub(crate) type FrameService<S> = EndsLocked<PortFactory<S, [f64], FrameHeader>>;

/// One writer, and a place for the publisher of a link between machines.
const MAX_PUBLISHERS: usize = 2;
const MAX_SUBSCRIBERS: usize = 16;
/// For the peer that a [`Repair`](crate::Repair) shows for a moment, also where all others are taken.
const SPARE_PLACES: usize = 1;
const MAX_NODES: usize = 40;
/// Finding the newest frame holds the best so far while it looks at the next.
const MAX_BORROWED: usize = 2;
/// Memory for the frames that one reader can be behind, and the bounds of their number.
const BUFFER_BYTES: usize = 1 << 20;
const BUFFER_FRAMES: (usize, usize) = (2, 256);

/// Says whether `name` can be the name of a service of frames, and if not, why.
///
/// # Errors
/// The name is empty, longer than 238 bytes, begins with `iox2://`, begins or ends with a blank, or
/// has a character that is not printable ASCII. (iceoryx2 itself takes 255 bytes, and control
/// characters except NUL; no tool shows them.)
pub fn check_service_name(name: &str) -> Result<(), ServiceNameError> {
    service_name(name).map(drop)
}

fn service_name(name: &str) -> Result<ServiceName, ServiceNameError> {
    let owned = || name.to_owned();
    if name.is_empty() {
        return Err(ServiceNameError::Empty);
    }
    let printable = |c: char| c.is_ascii_graphic() || c == ' ';
    if let Some(character) = name.chars().find(|c| !printable(*c)) {
        return Err(ServiceNameError::Character { name: owned(), character });
    }
    if name.trim_matches(' ') != name {
        return Err(ServiceNameError::Blank { name: owned() });
    }
    if name.len() > MAX_SERVICE_NAME_BYTES {
        return Err(ServiceNameError::TooLong { name: owned(), length: name.len() });
    }
    ServiceName::new(name).map_err(|_| ServiceNameError::Reserved { name: owned() })
}

/// Opens the service as it is; creates it with `layout` when there is none.
pub(crate) fn open_or_create<S: Service>(
    participant: &Participant<S>,
    service: &str,
    layout: &FrameLayout,
) -> Result<FrameService<S>, OpenError> {
    let name = service_name(service)?;
    let attributes = layout.to_attributes().map_err(layout_error(service))?;
    let mut backoff = Backoff::new();
    loop {
        let held = participant.lock(service)?;
        let cause = match open_once(participant, service, &name, &held)? {
            Attempt::Done(opened) => return Ok(opened),
            Attempt::Again(cause) => cause,
            Attempt::Absent => match create(participant, &name, &attributes, layout) {
                Ok(created) => return Ok(created),
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

/// Removes what the dead left in the domain and in this service: they may take the places of the living.
pub(crate) fn clean_up<S: Service>(participant: &Participant<S>, opened: &FrameService<S>) {
    let Ok(held) = participant.lock(opened.name().as_str()) else { return };
    let domain = participant.place();
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

/// How many publishers a service has places for, the spare one left out.
pub(crate) fn publisher_places<S: Service>(opened: &FrameService<S>) -> usize {
    places(opened.static_config().max_publishers(), MAX_PUBLISHERS)
}

/// How many subscribers a service has places for, the spare one left out.
pub(crate) fn subscriber_places<S: Service>(opened: &FrameService<S>) -> usize {
    places(opened.static_config().max_subscribers(), MAX_SUBSCRIBERS)
}

/// Who created the service cannot be seen, but that it has a place more than ours are for. Programs
/// of another make, and ports that open at the very same moment, may still take that one.
fn places(provided: usize, ours: usize) -> usize {
    match provided == ours + SPARE_PLACES {
        true => ours,
        false => provided,
    }
}

/// The layout that a service tells.
pub(crate) fn layout_of<S: Service>(
    opened: &FrameService<S>,
    service: &str,
) -> Result<FrameLayout, OpenError> {
    FrameLayout::from_attributes(opened.attributes()).map_err(layout_error(service))
}

pub(crate) fn failed<S: Service>(
    participant: &Participant<S>,
    service: &str,
    cause: impl ToString,
) -> OpenError {
    OpenError::Failed {
        service: service.to_owned(),
        domain: participant.domain(),
        cause: cause.to_string(),
    }
}

fn layout_error(service: &str) -> impl Fn(LayoutError) -> OpenError {
    move |source| OpenError::Layout { service: service.to_owned(), source }
}

enum Attempt<S: Service> {
    Done(FrameService<S>),
    Absent,
    /// It is between being and not being, or has no place: what stands in the way is removed, or too
    /// young for it.
    Again(String),
}

/// Opens without a single wish about quality of service, so that every service of our types fits,
/// also one that a link between machines created with its own defaults.
fn open_once<S: Service>(
    participant: &Participant<S>,
    service: &str,
    name: &ServiceName,
    held: &Held,
) -> Result<Attempt<S>, OpenError> {
    // Root can open what nobody may read yet, and would wait for it in iceoryx2 for ever.
    let _given_up = give_up_file_override();
    let opened = participant
        .node()
        .service_builder(name)
        .publish_subscribe::<[f64]>()
        .user_header::<FrameHeader>()
        .open();
    let owned = || service.to_owned();
    let cause = match opened {
        Ok(opened) => {
            let lock = participant.place().lock();
            return Ok(Attempt::Done(EndsLocked::new(opened, lock)));
        }
        Err(cause) => cause,
    };
    Err(match cause {
        Cause::DoesNotExist => return Ok(Attempt::Absent),
        Cause::ExceedsMaxNumberOfNodes => {
            participant.place().sweep::<S>(held);
            return Ok(Attempt::Again("all its places for nodes are taken".to_owned()));
        }
        Cause::IncompatibleTypes | Cause::IncompatibleMessagingPattern => OpenError::OtherTypes {
            service: owned(),
            carries: types_of(participant, name),
            needs: needed_types(),
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
            participant.place().sweep::<S>(held);
            return Ok(Attempt::Again(cause.to_string()));
        }
    })
}

fn create<S: Service>(
    participant: &Participant<S>,
    name: &ServiceName,
    attributes: &AttributeSpecifier,
    layout: &FrameLayout,
) -> Result<FrameService<S>, CreateError> {
    let created = participant
        .node()
        .service_builder(name)
        .publish_subscribe::<[f64]>()
        .user_header::<FrameHeader>()
        .enable_safe_overflow(true)
        // A late reader waits for the next cycle. With a history it would first get a frame that
        // may be as old as the writer's last sign of life, and a frame can be a command.
        .history_size(0)
        .subscriber_max_buffer_size(buffer_frames(layout.signals.len()))
        .subscriber_max_borrowed_samples(MAX_BORROWED)
        .max_publishers(MAX_PUBLISHERS + SPARE_PLACES)
        .max_subscribers(MAX_SUBSCRIBERS + SPARE_PLACES)
        .max_nodes(MAX_NODES)
        .create_with_attributes(attributes);
    created.map(|created| EndsLocked::new(created, participant.place().lock()))
}

fn buffer_frames(channels: usize) -> usize {
    let frame_bytes = size_of::<FrameHeader>() + channels * size_of::<f64>();
    let (least, most) = BUFFER_FRAMES;
    (BUFFER_BYTES / frame_bytes).clamp(least, most)
}

fn needed_types() -> String {
    describe(
        &TypeDetail::new::<f64>(TypeVariant::Dynamic),
        &TypeDetail::new::<FrameHeader>(TypeVariant::FixedSize),
    )
}

fn types_of<S: Service>(participant: &Participant<S>, name: &ServiceName) -> String {
    let details = S::details(name, participant.node().config(), MessagingPattern::PublishSubscribe);
    match details {
        Ok(Some(details)) => {
            let types = details.static_details.publish_subscribe().message_type_details();
            describe(&types.payload, &types.user_header)
        }
        _ => "messages of unknown type".to_owned(),
    }
}

fn describe(payload: &TypeDetail, header: &TypeDetail) -> String {
    let payload_name = match payload.variant() {
        TypeVariant::Dynamic => format!("[{}]", payload.type_name()),
        TypeVariant::FixedSize => payload.type_name().to_string(),
    };
    format!(
        "{payload_name} (elements of {} bytes) with user header {} ({} bytes)",
        payload.size(),
        header.type_name(),
        header.size()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buffers_are_deep_for_small_frames_and_bounded_for_large_ones() {
        assert_eq!(buffer_frames(1), 256);
        assert_eq!(buffer_frames(1000), (1 << 20) / 8048);
        assert_eq!(buffer_frames(1_000_000), 2);
    }
}
