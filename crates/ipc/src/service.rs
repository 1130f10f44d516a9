//! Opening and creating the iceoryx2 services that carry frames.

use iceoryx2::prelude::{AttributeSpecifier, MessagingPattern, ServiceName};
use iceoryx2::service::builder::publish_subscribe::{
    PublishSubscribeCreateError as CreateError, PublishSubscribeOpenError as Cause,
};
use iceoryx2::service::port_factory::PortFactory as _;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;
use iceoryx2::service::static_config::message_type_details::{TypeDetail, TypeVariant};

use crate::backoff::Backoff;
use crate::{
    FrameHeader, FrameLayout, LayoutError, OpenError, Participant, Service, ServiceNameError,
};

pub(crate) type FrameService<S> = PortFactory<S, [f64], FrameHeader>;

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

/// Says whether `name` can be the name of a service, and if not, why.
///
/// # Errors
/// The name is empty, longer than 255 bytes, begins with `iox2://`, or has a character that is
/// not printable ASCII. (iceoryx2 itself takes control characters except NUL; no tool shows them.)
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
    if name.len() > ServiceName::max_len() {
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
    let mut removed = false;
    loop {
        let cause = match open_once(participant, service, &name)? {
            Attempt::Done(opened) => return Ok(opened),
            Attempt::Again(cause) => cause,
            Attempt::Unfinished if backoff.try_again() => continue,
            Attempt::Unfinished if !removed => {
                remove_unfinished(participant, &name);
                removed = true;
                backoff = Backoff::new();
                continue;
            }
            Attempt::Unfinished => Cause::HangsInCreation.to_string(),
            Attempt::Absent => match create(participant, &name, &attributes, layout) {
                Ok(created) => return Ok(created),
                Err(cause) => cause.to_string(),
            },
        };
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
        match open_once(participant, service, &name)? {
            Attempt::Done(opened) => return Ok(Some(opened)),
            Attempt::Absent => return Ok(None),
            Attempt::Again(_) | Attempt::Unfinished if backoff.try_again() => {}
            // Whoever creates the service next removes what stands there.
            Attempt::Unfinished => return Ok(None),
            Attempt::Again(cause) => return Err(failed(participant, service, cause)),
        }
    }
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
    /// Somebody is creating it, or was killed while doing so.
    Unfinished,
    Again(String),
}

/// Removes what a process left that was killed while it created the service. iceoryx2 does not: to
/// it the service looks for ever as if its creator needed just a moment more.
fn remove_unfinished<S: Service>(participant: &Participant<S>, name: &ServiceName) {
    // SAFETY: iceoryx2 demands that no other process uses the service. It was unfinished for as
    // long as we tried to open it, most of a second, while a creation takes a millisecond; a
    // service that is not finished cannot be opened, so nobody has a port of it.
    #[allow(unsafe_code)]
    let removed = unsafe {
        participant.node().force_remove_service(name, MessagingPattern::PublishSubscribe)
    };
    // If it could not be removed, the next attempt to open it says why.
    let _ = removed;
}

/// Opens without a single wish about quality of service, so that every service of our types fits,
/// also one that a link between machines created with its own defaults.
fn open_once<S: Service>(
    participant: &Participant<S>,
    service: &str,
    name: &ServiceName,
) -> Result<Attempt<S>, OpenError> {
    let opened = participant
        .node()
        .service_builder(name)
        .publish_subscribe::<[f64]>()
        .user_header::<FrameHeader>()
        .open();
    let owned = || service.to_owned();
    let cause = match opened {
        Ok(opened) => return Ok(Attempt::Done(opened)),
        Err(cause) => cause,
    };
    Err(match cause {
        Cause::DoesNotExist => return Ok(Attempt::Absent),
        Cause::ExceedsMaxNumberOfNodes => {
            participant.clean_up();
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
        Cause::HangsInCreation => return Ok(Attempt::Unfinished),
        // Somebody creates or removes the service at this moment, or died while doing it.
        cause => return Ok(Attempt::Again(cause.to_string())),
    })
}

fn create<S: Service>(
    participant: &Participant<S>,
    name: &ServiceName,
    attributes: &AttributeSpecifier,
    layout: &FrameLayout,
) -> Result<FrameService<S>, CreateError> {
    participant
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
        .create_with_attributes(attributes)
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
