//! The reading end of a service.

use std::fmt::Debug;
use std::marker::PhantomData;

use iceoryx2::port::subscriber::{Subscriber, SubscriberCreateError};
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::sample::Sample;
use iceoryx2::service::port_factory::PortFactory as _;

use crate::backoff::Backoff;
use crate::peers::Peers;
use crate::repair::{Peer, Repair};
use crate::service::{self, FrameService};
use crate::{FrameHeader, FrameLayout, OpenError, Participant, Service, give_up_file_override};

/// How many frames [`Depth::Newest`] lets wait: with two, a frame that arrives just early does
/// not push out the one before it, so a reader of the same period can count losses.
const NEWEST_FRAMES: usize = 2;

/// How many frames may wait for a reader before the oldest is dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Depth {
    /// Two: for control inputs, which read the newest.
    Newest,
    /// As many as the service provides (2 to 256 when isochrone created it): for recorders.
    All,
}

/// What a subscriber received and what went wrong, since it was opened.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SubscriberCounters {
    /// Frames taken out of the buffer, including those that `newest` passed over.
    pub received: u64,
    /// Frames that were sent and pushed out by newer ones before they were taken: gaps in the
    /// sequence, between the first frame and the last.
    pub lost: u64,
    /// Calls into iceoryx2 that failed.
    pub receive_errors: u64,
    /// How often the number of publishers was seen to change. One that left and one that joined
    /// between two calls are not seen.
    pub connects: u64,
    /// Connections to a publisher that failed. Its frames do not arrive until a [`Repair`], or the
    /// next peer that joins or leaves, makes iceoryx2 try again.
    pub connect_errors: u64,
}

/// Reads the frames of one service.
#[derive(Debug)]
pub struct FrameSubscriber<S: Service> {
    port: Subscriber<S, [f64], FrameHeader>,
    service: FrameService<S>,
    layout: FrameLayout,
    /// Most frames that one call of `newest` looks at.
    drain_limit: usize,
    /// Whether two frames may be held at once.
    can_compare: bool,
    peers: Peers,
    last_sequence: Option<u64>,
    counters: SubscriberCounters,
}

impl<S: Service> FrameSubscriber<S> {
    /// Opens `service` for reading frames that have at least the channels of `expected`.
    ///
    /// When there is no such service, it is created with the expected types, so that writer and
    /// reader may start in any order. Of `expected`, the names and the period do not matter.
    ///
    /// # Errors
    /// The name or the existing service does not fit, or the service has no place left.
    pub fn open(
        participant: &Participant<S>,
        service: &str,
        expected: &FrameLayout,
        depth: Depth,
    ) -> Result<Self, OpenError> {
        let expected = expected.as_expectation();
        let opened = service::open_or_create(participant, service, &expected)?;
        let layout = service::layout_of(&opened, service)?;
        layout.serves(&expected).map_err(|conflict| OpenError::LayoutConflict {
            service: service.to_owned(),
            conflict,
        })?;
        Self::connect(participant, service, opened, layout, depth)
    }

    /// Opens `service` for reading whatever frames it carries; `None` when it does not exist.
    ///
    /// # Errors
    /// The name is not possible, the service carries no frames, or it has no place left.
    pub fn open_existing(
        participant: &Participant<S>,
        service: &str,
        depth: Depth,
    ) -> Result<Option<Self>, OpenError> {
        let Some(opened) = service::open_existing(participant, service)? else {
            return Ok(None);
        };
        let layout = service::layout_of(&opened, service)?;
        Self::connect(participant, service, opened, layout, depth).map(Some)
    }

    fn connect(
        participant: &Participant<S>,
        service: &str,
        opened: FrameService<S>,
        layout: FrameLayout,
        depth: Depth,
    ) -> Result<Self, OpenError> {
        let provided = opened.static_config().subscriber_max_buffer_size();
        let buffer = match depth {
            Depth::Newest => NEWEST_FRAMES.min(provided),
            Depth::All => provided,
        };
        let peers = Peers::default();
        let mut backoff = Backoff::new();
        let places = service::subscriber_places(&opened);
        let full =
            || OpenError::Full { service: service.to_owned(), what: "subscriber", limit: places };
        let create = || {
            let _held = participant.lock(service)?;
            let _given_up = give_up_file_override();
            if opened.dynamic_config().number_of_subscribers() >= places {
                return Err(full());
            }
            let created = opened
                .subscriber_builder()
                .buffer_size(buffer)
                // Should the service have a history: what was sent before we came may be stale.
                .history_request(0)
                .set_degradation_handler(peers.counting_handler())
                .create();
            created.map_err(|cause| match cause {
                SubscriberCreateError::ExceedsMaxSupportedSubscribers => full(),
                cause => service::failed(participant, service, cause),
            })
        };
        let port = loop {
            let error = match create() {
                Ok(port) => break port,
                Err(error) => error,
            };
            service::clean_up(participant, &opened);
            if !backoff.try_again() {
                return Err(error);
            }
        };
        let publishers = opened.static_config().max_publishers();
        let mut subscriber = Self {
            // Each publisher's buffer, and the leftovers of one that was replaced.
            drain_limit: buffer * (publishers + 1),
            can_compare: opened.static_config().subscriber_max_borrowed_samples() > 1,
            port,
            service: opened,
            layout,
            peers,
            last_sequence: None,
            counters: SubscriberCounters::default(),
        };
        subscriber.maintain();
        Ok(subscriber)
    }

    /// What the service says about its frames; see [`FrameLayout`] for when it knows how much.
    pub fn layout(&self) -> &FrameLayout {
        &self.layout
    }

    /// Takes all frames that wait and returns the newest of them; `None` when none waited.
    ///
    /// Newest is the latest `publish_ns`, not the last in line: what a publisher left that has
    /// ended comes out before, and its restarted successor counts its sequence from 0. Bounded:
    /// looks at a full buffer per possible publisher at most. Never waits or logs.
    pub fn newest(&mut self) -> Option<FrameRef<'_, S>> {
        let mut newest: Option<Sample<S, [f64], FrameHeader>> = None;
        for _ in 0..self.drain_limit {
            if !self.can_compare && newest.is_some() {
                if !self.port.has_samples().unwrap_or(false) {
                    break;
                }
                newest = None;
            }
            let Some(sample) = self.receive() else {
                break;
            };
            let age = |sample: &Sample<S, [f64], FrameHeader>| {
                let header = sample.user_header();
                (header.publish_ns, header.sequence)
            };
            if newest.as_ref().is_none_or(|best| age(best) <= age(&sample)) {
                newest = Some(sample);
            }
        }
        newest.map(FrameRef::new)
    }

    /// Takes the next frame in line, for readers that want them all; `None` when none waits.
    #[expect(
        clippy::should_implement_trait,
        reason = "an iterator cannot lend, and this is not exhausted when it says `None`"
    )]
    pub fn next(&mut self) -> Option<FrameRef<'_, S>> {
        self.receive().map(FrameRef::new)
    }

    /// Connects to publishers that joined; for the slack, since iceoryx2 maps memory for that.
    pub fn maintain(&mut self) {
        // Failures are counted by the handler that the port was given.
        let _ = self.port.update_connections();
        self.peers.note(self.publishers());
    }

    /// How many publishers the service has now, connected or not.
    ///
    /// Not for the cycle: counting writes to shared memory and may repeat while peers come or go.
    pub fn publishers(&self) -> usize {
        self.service.dynamic_config().number_of_publishers()
    }

    /// What makes good the port's failed connections; for an ordinary thread.
    pub fn repair(&self) -> Repair {
        let service = self.service.name().as_str();
        Repair::new(service, Peer::Publisher, self.peers.failure_count())
    }

    /// What happened since the subscriber was opened.
    pub fn counters(&self) -> SubscriberCounters {
        SubscriberCounters {
            connects: self.peers.changes(),
            connect_errors: self.peers.failures(),
            ..self.counters
        }
    }

    fn receive(&mut self) -> Option<Sample<S, [f64], FrameHeader>> {
        match self.port.receive() {
            Ok(Some(sample)) => {
                self.counters.received += 1;
                let sequence = sample.user_header().sequence;
                // A sequence that falls is that of a publisher that began anew.
                if let Some(last) = self.last_sequence.replace(sequence)
                    && sequence > last
                {
                    self.counters.lost += sequence - last - 1;
                }
                Some(sample)
            }
            Ok(None) => None,
            Err(_) => {
                self.counters.receive_errors += 1;
                None
            }
        }
    }
}

/// A received frame, read where the publisher wrote it. Dropping it gives the memory back.
pub struct FrameRef<'a, S: Service> {
    sample: Sample<S, [f64], FrameHeader>,
    /// One at a time: iceoryx2 lets a reader hold only so many.
    subscriber: PhantomData<&'a mut ()>,
}

impl<S: Service> FrameRef<'_, S> {
    fn new(sample: Sample<S, [f64], FrameHeader>) -> Self {
        Self { sample, subscriber: PhantomData }
    }

    /// When and from what the frame was made.
    pub fn header(&self) -> &FrameHeader {
        self.sample.user_header()
    }

    /// One value per channel. How many is the publisher's choice: ask with `get`.
    pub fn values(&self) -> &[f64] {
        self.sample.payload()
    }
}

impl<S: Service> Debug for FrameRef<'_, S> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FrameRef")
            .field("header", self.header())
            .field("values", &self.values())
            .finish()
    }
}
