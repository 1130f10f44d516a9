//! Who writes a service here, and whether another machine does.

use std::thread;
use std::time::{Duration, Instant};

use iceoryx2::identifiers::UniqueNodeId;
use iceoryx2::prelude::CallbackProgression;
use iceoryx2::service::port_factory::PortFactory as _;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;

use crate::following::Writer;
use crate::service::{self, holders};
use crate::{
    Depth, Flags, FrameHeader, FrameSubscriber, LayoutWatcher, OpenError, PUBLISHER_PORT_NAME,
    Participant, SenderClock, Service,
};

/// For how long the frames of another machine are looked for: its writer announces their layout every 500 ms.
const LOOK: Duration = Duration::from_millis(750);
const INTERVAL: Duration = Duration::from_millis(2);

/// Replaces `writers` by those that are there, and returns whether one of them may turn out to be a link: that
/// opens its other end last. iceoryx2 allocates for this.
pub(crate) fn list<S: Service>(
    opened: &PortFactory<S, [f64], FrameHeader>,
    writers: &mut Vec<Writer>,
) -> bool {
    writers.clear();
    let mut may_be_link = false;
    each(opened, |writer| {
        may_be_link |= !writer.is_ours && writer.link.is_none();
        writers.push(Writer { id: writer.id, is_far: writer.link.is_some() });
    });
    may_be_link
}

/// The node that keeps a publisher of ours from being the only writer, other than `own`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Rival {
    /// It has another publisher of ours.
    Ours(UniqueNodeId),
    /// It has a publisher of another make, which is no link.
    Plain(UniqueNodeId),
}

/// Who writes the service beside `own`, one of ours first.
pub(crate) fn rival<S: Service>(
    opened: &PortFactory<S, [f64], FrameHeader>,
    own: Option<u128>,
) -> Option<Rival> {
    let mut rival = None;
    each(opened, |writer| match rival {
        _ if Some(writer.id) == own || writer.link.is_some() => {}
        _ if writer.is_ours => rival = Some(Rival::Ours(writer.node)),
        None => rival = Some(Rival::Plain(writer.node)),
        Some(_) => {}
    });
    rival
}

/// A publisher of a service.
struct ServicePublisher {
    id: u128,
    node: UniqueNodeId,
    is_ours: bool,
    /// The node, if it is a link.
    link: Option<UniqueNodeId>,
}

/// A link has both ends of the service in one node. Nodes of ours have too, where they read what they write,
/// and are known by the name of their publishers.
fn each<S: Service>(
    opened: &PortFactory<S, [f64], FrameHeader>,
    mut note: impl FnMut(ServicePublisher),
) {
    opened.dynamic_config().list_publishers(|publisher| {
        let is_ours = publisher.publisher_name.as_str() == PUBLISHER_PORT_NAME;
        let mut has_both = false;
        if !is_ours {
            opened.dynamic_config().list_subscribers(|subscriber| {
                has_both |= subscriber.node_id == publisher.node_id;
                CallbackProgression::Continue
            });
        }
        let link = has_both.then_some(publisher.node_id);
        note(ServicePublisher {
            id: publisher.publisher_id.value(),
            node: publisher.node_id,
            is_ours,
            link,
        });
        CallbackProgression::Continue
    });
}

impl<S: Service> Participant<S> {
    /// Makes sure that no other machine writes one of the services, as far as a link brings its frames here.
    ///
    /// Where no link has one of them, this takes some milliseconds; where one has, it listens for 750 ms. Call it
    /// before a publisher is opened, which itself only looks at this machine.
    ///
    /// # Errors
    /// Another machine writes one of them, or one cannot be opened.
    pub fn refuse_far_writers(&self, services: &[&str]) -> Result<(), OpenError> {
        let mut watched = Vec::new();
        for service in services {
            watched.extend(Watched::open(self, service)?);
        }
        let began = Instant::now();
        let is_open = |watched: &[Watched<S>]| watched.iter().any(|service| !service.is_clear());
        while is_open(&watched) && began.elapsed() < LOOK {
            thread::sleep(INTERVAL);
            watched.iter_mut().for_each(|service| service.look(self));
        }
        watched.into_iter().find_map(Watched::refusal).map_or(Ok(()), Err)
    }
}

/// A service that a link has.
struct Watched<S: Service> {
    service: String,
    frames: FrameSubscriber<S>,
    layouts: LayoutWatcher<S>,
    /// The link whose last frame was not that of a writer that ends.
    through: Option<UniqueNodeId>,
}

impl<S: Service> Watched<S> {
    fn open(participant: &Participant<S>, service: &str) -> Result<Option<Self>, OpenError> {
        let Some(opened) = service::open_existing(participant, service)? else { return Ok(None) };
        let mut has_link = false;
        each(&opened, |writer| has_link |= writer.link.is_some());
        let frames = has_link
            .then(|| FrameSubscriber::open_existing(participant, service, Depth::Newest))
            .transpose()?
            .flatten();
        let Some(frames) = frames else { return Ok(None) };
        let layouts = LayoutWatcher::open(participant, service)?;
        Ok(Some(Self { service: service.to_owned(), frames, layouts, through: None }))
    }

    fn look(&mut self, participant: &Participant<S>) {
        self.layouts.look(participant);
        while let Some((writer, header)) = self.frames.next_of_any() {
            let mut link = None;
            each(self.frames.service(), |found| {
                link = link.or(found.link.filter(|_| found.id == writer));
            });
            if link.is_some() {
                self.through = link.filter(|_| !header.flags().contains(Flags::STOPPED));
            }
        }
    }

    /// Whether all is known that the refusal says.
    fn is_clear(&self) -> bool {
        self.through.is_some() && self.layouts.newest().is_some()
    }

    fn refusal(self) -> Option<OpenError> {
        let announced = self.layouts.newest();
        let is_foreign = announced.is_some_and(|known| known.clock() == SenderClock::Foreign);
        if self.through.is_none() && !is_foreign {
            return None;
        }
        let opened = self.frames.service();
        let mut link = self.through;
        each(opened, |writer| link = link.or(writer.link));
        Some(OpenError::FarWriter {
            service: self.service,
            publisher: announced.map(|known| known.publisher.clone()).unwrap_or_default(),
            through: link.map(|node| holders::node(&**opened, node)).unwrap_or_default(),
        })
    }
}
