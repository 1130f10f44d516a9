//! Both ends of a layout service. For ordinary threads: they allocate and access files.

use std::time::{Duration, Instant};

use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::{AllocationStrategy, BackpressureStrategy};
use iceoryx2::service::port_factory::PortFactory as _;

use crate::exhausted;
use crate::frames::announcement::Announcement;
use crate::frames::peers::Peers;
use crate::frames::service::{self, LayoutService, Pool, holders};
use crate::space::{self, Shortage};
use crate::{FrameLayout, OpenError, Participant, Service, give_up_file_override};

/// How often a layout is announced while there is a reader.
const INTERVAL: Duration = Duration::from_millis(500);
/// Between two attempts to make good a connection that failed.
const PAUSE: Duration = Duration::from_millis(100);
/// Layouts of one service that are remembered. A service has one writer, which has one layout.
const MAX_KNOWN: usize = 8;
/// The announcement that is being sent.
const MAX_LOANED: usize = 1;
/// A reader holds a layout while it reads it. Where more of them do so at once than there is memory for, the next one is
/// announced later.
const MOST_MESSAGES: usize = 20;

/// Announces the layout of a service's frames until it is dropped.
///
/// Use it in an ordinary thread of the publisher that calls [`tend`](Self::tend) about 50 times a
/// second. Its service, `isochrone/layout/<service>`, is separate from that of the frames, so readers
/// that wait for a layout do not affect the thread that sends frames.
#[derive(Debug)]
pub struct LayoutAnnouncer<S: Service> {
    // Dropped before its service.
    port: Option<Publisher<S, [u8], ()>>,
    service: LayoutService<S>,
    peers: Peers,
    retry: Retry,
    json: Vec<u8>,
    readers: usize,
    sent: Option<Instant>,
}

impl<S: Service> LayoutAnnouncer<S> {
    /// Opens the layout service of `service`, and announces `layout` if a reader is waiting.
    ///
    /// `publisher` is the publisher's name, for display.
    ///
    /// # Errors
    /// The name or the layout is not possible, the existing service does not fit, or shared memory
    /// has no room for the announcement.
    pub fn open(
        participant: &Participant<S>,
        service: &str,
        publisher: &str,
        layout: &FrameLayout,
    ) -> Result<Self, OpenError> {
        let source = |source| OpenError::Layout { service: service.to_owned(), source };
        layout.check().map_err(source)?;
        let opened = service::open_or_create_layouts(participant, service)?;
        let json = Announcement::new(publisher, layout).to_json();
        let peers = Peers::default();
        let bytes = json.len();
        let publish = || publish(participant, &opened, &peers, bytes);
        let port = service::open_port(participant, &opened, publish)?;
        let retry = Retry::default();
        let port = Some(port);
        let mut announcer =
            Self { port, service: opened, peers, retry, json, readers: 0, sent: None };
        announcer.tend(participant);
        Ok(announcer)
    }

    /// Announces the layout if a reader has joined, and every 500 ms while there is one.
    pub fn tend(&mut self, participant: &Participant<S>) {
        self.tend_once(participant, false);
    }

    /// As [`tend`](Self::tend), and announces the layout to whatever readers there are: before the end, after which nothing
    /// is sent again that did not arrive.
    pub fn tend_at_end(&mut self, participant: &Participant<S>) {
        self.tend_once(participant, true);
    }

    fn tend_once(&mut self, participant: &Participant<S>, is_end: bool) {
        let readers = self.service.dynamic_config().number_of_subscribers();
        let has_more = readers > self.readers;
        self.readers = readers;
        let is_due = is_end || self.sent.is_none_or(|sent| sent.elapsed() >= INTERVAL);
        let retries = self.retry.is_due(self.peers.failures());
        if readers == 0 || !(has_more || is_due || retries) {
            return;
        }
        if retries || self.port.is_none() {
            // iceoryx2 comes back to a connection that failed only in a new port.
            self.port = None;
            let held = participant.lock_at_once(self.service.name().as_str());
            let port = held.and_then(|_held| {
                publish(participant, &self.service, &self.peers, self.json.len())
            });
            self.port = port.ok();
        }
        self.sent = Some(Instant::now());
        // As root, a half-made reader would hold up the thread for ever.
        let _given_up = give_up_file_override();
        let Some(mut message) = self.port.as_ref().and_then(|p| p.loan_slice(self.json.len()).ok())
        else {
            return;
        };
        message.payload_mut().copy_from_slice(&self.json);
        // What does not arrive is sent again.
        let _ = message.send();
    }
}

/// Receives the layouts of a service's frames from its publishers.
///
/// Use it in an ordinary thread that calls [`look`](Self::look) about 50 times a second.
#[derive(Debug)]
pub struct LayoutWatcher<S: Service> {
    // Dropped before its service.
    port: Option<Subscriber<S, [u8], ()>>,
    service: LayoutService<S>,
    peers: Peers,
    retry: Retry,
    /// The newest stands last.
    known: Vec<Announcement>,
    has_warned: bool,
}

impl<S: Service> LayoutWatcher<S> {
    /// Opens the layout service of `service`, whether or not a layout has been announced yet.
    ///
    /// # Errors
    /// The name is not possible, the existing service does not fit, or it has no place left.
    pub fn open(participant: &Participant<S>, service: &str) -> Result<Self, OpenError> {
        let opened = service::open_or_create_layouts(participant, service)?;
        let peers = Peers::default();
        let subscribe = || subscribe(participant, &opened, &peers);
        let port = service::open_port(participant, &opened, subscribe)?;
        let port = Some(port);
        let retry = Retry::default();
        Ok(Self { port, service: opened, peers, retry, known: Vec::new(), has_warned: false })
    }

    /// Takes the announcements since the last call; returns whether there is a new one.
    pub fn look(&mut self, participant: &Participant<S>) -> bool {
        self.hear(participant, |_| ())
    }

    /// As [`look`](Self::look), and notes each announcement, also one that was heard before: while a publisher
    /// has readers, one comes every 500 ms.
    pub fn hear(
        &mut self,
        participant: &Participant<S>,
        mut note: impl FnMut(&Announcement),
    ) -> bool {
        if self.retry.is_due(self.peers.failures()) || self.port.is_none() {
            // As with the announcer.
            self.port = None;
            let held = participant.lock_at_once(self.service.name().as_str());
            let port = held.and_then(|_held| subscribe(participant, &self.service, &self.peers));
            self.port = port.ok();
        }
        let mut is_new = false;
        for _ in 0..self.service.static_config().max_publishers() * 2 {
            let received = {
                let _given_up = give_up_file_override();
                self.port.as_ref().and_then(|port| port.receive().ok().flatten())
            };
            let Some(message) = received else { break };
            match Announcement::from_json(message.payload()) {
                Ok(announcement) => {
                    note(&announcement);
                    is_new |= self.learn(announcement);
                }
                Err(error) => {
                    let text = format!("{error}");
                    drop(message);
                    self.warn(&text);
                }
            }
        }
        is_new
    }

    /// What keeps it from hearing announcements, if a publisher's connection failed: what has run out, and the
    /// way out.
    pub fn obstacle(&self) -> Option<String> {
        let is_deaf = self.port.is_none() || self.peers.failures() != self.retry.answered;
        is_deaf.then(|| {
            exhausted::limit().unwrap_or_else(|| {
                "their announcement could not be connected to; see that the file descriptors (ulimit -n) and \
                 the memory of both processes suffice"
                    .to_owned()
            })
        })
    }

    /// The announcement of the frames with this number.
    pub fn find(&self, number: u64) -> Option<&Announcement> {
        self.known.iter().rfind(|known| known.number == number)
    }

    /// What was announced last.
    pub fn newest(&self) -> Option<&Announcement> {
        self.known.last()
    }

    /// The newest stands last.
    pub(crate) fn known(&self) -> &[Announcement] {
        &self.known
    }

    /// Returns whether it is news.
    fn learn(&mut self, announcement: Announcement) -> bool {
        if self.known.last() == Some(&announcement) {
            return false;
        }
        self.known.retain(|known| known.number != announcement.number);
        if self.known.len() == MAX_KNOWN {
            self.known.remove(0);
        }
        self.known.push(announcement);
        true
    }

    fn warn(&mut self, error: &str) {
        if !std::mem::replace(&mut self.has_warned, true) {
            let service = self.service.name().as_str();
            tracing::warn!("a message of service {service:?} is not understood: {error}");
        }
    }
}

/// When to try again what failed.
#[derive(Debug, Default)]
struct Retry {
    answered: u64,
    not_before: Option<Instant>,
}

impl Retry {
    fn is_due(&mut self, failures: u64) -> bool {
        let now = Instant::now();
        if failures == self.answered || self.not_before.is_some_and(|instant| now < instant) {
            return false;
        }
        self.answered = failures;
        self.not_before = Some(now + PAUSE);
        true
    }
}

fn publish<S: Service>(
    participant: &Participant<S>,
    opened: &LayoutService<S>,
    peers: &Peers,
    bytes: usize,
) -> Result<Publisher<S, [u8], ()>, OpenError> {
    let service = opened.name().as_str();
    let places = service::publisher_places(opened);
    if opened.dynamic_config().number_of_publishers() >= places {
        let service = service.to_owned();
        let holders = holders::of_publishers(opened);
        return Err(OpenError::Full { service, what: "publisher", limit: places, holders });
    }
    let full = |shortage: Shortage| shortage.of_service(service);
    let pool = Pool::new(opened, MAX_LOANED, bytes).of_at_most(MOST_MESSAGES);
    space::require(pool.bytes).map_err(full)?;
    // Root can open what nobody may read yet, and would wait for it in iceoryx2 for ever.
    let _given_up = give_up_file_override();
    let created = opened
        .publisher_builder()
        .max_loaned_samples(MAX_LOANED)
        .initial_max_slice_len(bytes)
        .override_sample_preallocation(move |_| pool.messages)
        .allocation_strategy(AllocationStrategy::Static)
        .backpressure_strategy(BackpressureStrategy::DiscardData)
        .set_degradation_handler(peers.counting_handler())
        .create();
    let port = created.map_err(|cause| service::failed(participant, service, cause))?;
    space::reserve_messages(participant.node().config(), port.id().value()).map_err(full)?;
    Ok(port)
}

fn subscribe<S: Service>(
    participant: &Participant<S>,
    opened: &LayoutService<S>,
    peers: &Peers,
) -> Result<Subscriber<S, [u8], ()>, OpenError> {
    let service = opened.name().as_str();
    let places = service::subscriber_places(opened);
    if opened.dynamic_config().number_of_subscribers() >= places {
        let service = service.to_owned();
        let holders = holders::of_subscribers(opened);
        return Err(OpenError::Full { service, what: "subscriber", limit: places, holders });
    }
    // As with the publisher.
    let _given_up = give_up_file_override();
    let created = opened
        .subscriber_builder()
        .history_request(0)
        .set_degradation_handler(peers.counting_handler())
        .create();
    created.map_err(|cause| service::failed(participant, service, cause))
}
