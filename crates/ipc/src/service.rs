//! Opening and creating the iceoryx2 services that carry frames, and those that carry their layouts.

use std::fmt::Debug;

use iceoryx2::prelude::{CallbackProgression, MessagingPattern, ServiceName, ZeroCopySend};
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
    FrameHeader, OpenError, Participant, Service, ServiceNameError, give_up_file_override,
};

/// A service of messages that are slices, each with a header.
pub(crate) type Opened<S, E, H> = EndsLocked<PortFactory<S, [E], H>>;
pub(crate) type FrameService<S> = Opened<S, f64, FrameHeader>;
pub(crate) type LayoutService<S> = Opened<S, u8, ()>;

/// What the name of a service of layouts is made of, before that of the service of frames.
const LAYOUT_PREFIX: &str = "isochrone/layout/";

/// One writer, one that is about to take over, and those of links between machines.
const MAX_PUBLISHERS: usize = 4;
const MAX_SUBSCRIBERS: usize = 16;
/// For the peer that a [`Repair`](crate::Repair) shows for a moment, also where all others are taken.
const SPARE_PLACES: usize = 1;
const MAX_NODES: usize = 40;
/// Finding the newest frame holds the best so far while it looks at the next.
const MAX_BORROWED: usize = 2;
/// Memory for the frames that one reader can be behind, and the bounds of their number.
const BUFFER_BYTES: usize = 1 << 20;
const BUFFER_FRAMES: (usize, usize) = (2, 256);

/// What a service is created with, where there is none. Whoever opens one takes it as it is.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Quality {
    buffer: usize,
    borrowed: usize,
}

impl Quality {
    /// Of a service whose frames have so many channels.
    pub(crate) fn of_frames(channels: usize) -> Self {
        Self { buffer: buffer_frames(channels), borrowed: MAX_BORROWED }
    }

    /// Of a service of layouts: the newest is all that counts.
    pub(crate) const fn of_layouts() -> Self {
        Self { buffer: 1, borrowed: 1 }
    }
}

/// Says whether `name` can be the name of a service of frames, and if not, why.
///
/// # Errors
/// The name is empty, longer than 238 bytes, begins with `iox2://` or `isochrone/layout/`, begins or
/// ends with a blank, or has a character that is not printable ASCII. (iceoryx2 itself takes 255 bytes,
/// and control characters except NUL; no tool shows them.)
pub fn check_service_name(name: &str) -> Result<(), ServiceNameError> {
    service_name(name).map(drop)
}

/// The name of the service that carries the layouts of the frames of `service`.
///
/// # Errors
/// As [`check_service_name`].
pub fn layout_service_name(service: &str) -> Result<String, ServiceNameError> {
    Ok(format!("{LAYOUT_PREFIX}{}", service_name(service)?.as_str()))
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
    if name.starts_with(LAYOUT_PREFIX) {
        return Err(ServiceNameError::OfLayouts { name: owned() });
    }
    ServiceName::new(name).map_err(|_| ServiceNameError::Reserved { name: owned() })
}

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
            Attempt::Done(opened) => return Ok(opened),
            Attempt::Again(cause) => cause,
            Attempt::Absent => match create(participant, name, quality) {
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

/// How many publishers a service has places for, the spare one left out.
pub(crate) fn publisher_places<S: Service, E: Element, H: Header>(
    opened: &PortFactory<S, [E], H>,
) -> usize {
    places(opened.static_config().max_publishers(), MAX_PUBLISHERS)
}

/// How many subscribers a service has places for, the spare one left out.
pub(crate) fn subscriber_places<S: Service, E: Element, H: Header>(
    opened: &PortFactory<S, [E], H>,
) -> usize {
    places(opened.static_config().max_subscribers(), MAX_SUBSCRIBERS)
}

/// Who created the service cannot be seen, but that it has a place more than ours are for. Programs
/// of another make, and ports that open at the very same moment, may still take that one.
fn places(provided: usize, ours: usize) -> usize {
    if provided == ours + SPARE_PLACES { ours } else { provided }
}

/// The memory that iceoryx2 sets aside for the messages of a publisher, each with `payload_bytes`: as
/// many as all readers together can be behind or hold, and those being written.
pub(crate) fn segment_bytes<S: Service, E: Element, H: Header>(
    opened: &PortFactory<S, [E], H>,
    max_loaned: usize,
    payload_bytes: usize,
) -> u64 {
    /// iceoryx2's own header.
    const SYSTEM_HEADER_BYTES: usize = 64;
    let config = opened.static_config();
    let behind = config.subscriber_max_buffer_size() + config.subscriber_max_borrowed_samples();
    let messages = config.max_subscribers() * behind + config.history_size() + max_loaned;
    let message_bytes = SYSTEM_HEADER_BYTES + size_of::<H>() + payload_bytes;
    messages as u64 * message_bytes as u64
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

/// What a service's messages are slices of.
pub(crate) trait Element: ZeroCopySend + Debug + 'static {
    /// How people call the messages.
    const MESSAGES: &'static str;
}

impl Element for f64 {
    const MESSAGES: &'static str = "frames";
}

impl Element for u8 {
    const MESSAGES: &'static str = "layouts";
}

/// What goes with each message.
pub(crate) trait Header: ZeroCopySend + Debug + 'static {}

impl<H: ZeroCopySend + Debug + 'static> Header for H {}

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

fn buffer_frames(channels: usize) -> usize {
    let frame_bytes = size_of::<FrameHeader>() + channels * size_of::<f64>();
    let (least, most) = BUFFER_FRAMES;
    (BUFFER_BYTES / frame_bytes).clamp(least, most)
}

fn needed_types<E: Element, H: Header>() -> String {
    describe(
        &TypeDetail::new::<E>(TypeVariant::Dynamic),
        &TypeDetail::new::<H>(TypeVariant::FixedSize),
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
    if header.size() == 0 {
        return format!(
            "{payload_name} (elements of {} bytes) without user header",
            payload.size()
        );
    }
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
        assert_eq!(buffer_frames(1000), (1 << 20) / 8072);
        assert_eq!(buffer_frames(1_000_000), 2);
    }
}
