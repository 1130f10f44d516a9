//! The writing end of a service.

mod port;

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::sample_mut::SampleMut;
use iceoryx2::service::port_factory::PortFactory as _;

use isochrone_cyclic::Release;
use isochrone_model::Flags;

use crate::file_override::Guard;
use crate::frames::peers::Peers;
use crate::frames::repair::Peer;
use crate::frames::service::{self, FrameService, Pool, Quality};
use crate::space::{self, Shortage};
use crate::{ForRealTime, FrameHeader, FrameLayout, OpenError, Participant, Service};
pub(crate) use port::MAX_LOANED;
use port::sole_port;

/// What the sender knows about the frame it sends; see [`FrameHeader`] for the rest.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Stamp {
    /// The cycle's index, skipped cycles included.
    pub cycle: u64,
    /// When the cycle was due, `CLOCK_MONOTONIC` nanoseconds.
    pub release_ns: u64,
    /// Time of the oldest sample that the frame was computed from, see [`Credible::source_ns`]; 0: none.
    ///
    /// [`Credible::source_ns`]: crate::Credible::source_ns
    pub source_ns: u64,
    /// Cycles lost since start.
    pub missed: u64,
    /// What the values are worth.
    pub flags: Flags,
}

impl From<Release> for Stamp {
    /// That of values without a source, such as a sensor's, of which all is well.
    fn from(Release { cycle, release_ns, missed, .. }: Release) -> Self {
        Self { cycle, release_ns, missed, ..Self::default() }
    }
}

/// Counts of a publisher's work and failures since it was opened.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct PublisherCounters {
    /// Frames sent.
    pub sent: u64,
    /// Calls of `send` without a frame, because none could be loaned.
    pub unsent: u64,
    /// Frames that iceoryx2 refused or could deliver only in part.
    pub send_errors: u64,
    /// Calls of `prepare` that got no frame, because readers hold too many.
    pub loan_errors: u64,
    /// How often the number of subscribers was seen to change; each change costs one `prepare`
    /// or `send` some hundred microseconds. One that left and one that joined between two calls
    /// are not seen, and cost the same.
    pub connects: u64,
    /// Connections to a subscriber that failed. The subscriber gets nothing until
    /// [`Participant::tend`], or the next peer that joins or leaves, makes iceoryx2 try again.
    pub connect_errors: u64,
    /// Frames that reached fewer subscribers than there were, as `prepare` finds out afterwards.
    /// A number that goes on growing means a failed connection.
    pub silent: u64,
}

/// Publishes the frames of one service; its only writer.
///
/// [`prepare`](Self::prepare) in the slack, then in the cycle [`values_mut`](Self::values_mut) and
/// [`send`](Self::send).
#[derive(Debug)]
pub struct FramePublisher<S: Service> {
    prepared: Option<SampleMut<S, [f64], FrameHeader>>,
    port: Publisher<S, [f64], FrameHeader>,
    service: FrameService<S>,
    channels: usize,
    next_sequence: u64,
    term: u64,
    layout: u64,
    /// How many subscribers the last frame was given to.
    reached: Option<usize>,
    peers: Peers,
    guard: Guard,
    counters: PublisherCounters,
}

impl<S: Service> FramePublisher<S> {
    /// Opens `service` for writing frames of `layout`; creates it when there is none.
    ///
    /// The frames carry the layout's number, and nodes do not read them before they have learned what
    /// it stands for: announce it with a [`LayoutAnnouncer`](crate::LayoutAnnouncer), or make the
    /// publisher [plain](Self::plain).
    ///
    /// The publisher of a killed process is removed; a live one is an error. From one of another make, which
    /// lacks the port name [`PUBLISHER_PORT_NAME`](crate::PUBLISHER_PORT_NAME), the service is taken over if the participant is told
    /// [to](Participant::taking_over). A link between machines may mirror its peer's frames into the service.
    ///
    /// All memory for the frames is allocated here, so filling up shared memory afterwards cannot kill
    /// the publisher at a page it has not touched yet. The segment of a connection is created when a
    /// subscriber joins and still needs room then.
    ///
    /// # Errors
    /// The name, the layout or the existing service does not fit, somebody writes it already, or
    /// shared memory has no room for the frames.
    pub fn open(
        participant: &Participant<S>,
        service: &str,
        layout: &FrameLayout,
    ) -> Result<Self, OpenError> {
        let quality = Quality::of_frames(layout.signals.len());
        Self::open_with(participant, service, layout, quality, participant.takes_over())
    }

    /// As [`open`](Self::open); a service that is created here has places for so many readers, where others have
    /// [`READERS`](crate::READERS).
    ///
    /// # Errors
    /// As `open`.
    pub fn open_for_readers(
        participant: &Participant<S>,
        service: &str,
        layout: &FrameLayout,
        readers: usize,
    ) -> Result<Self, OpenError> {
        let quality = Quality::of_frames(layout.signals.len()).for_readers(readers);
        Self::open_with(participant, service, layout, quality, participant.takes_over())
    }

    /// As [`open`](Self::open), by a participant that [takes](Participant::taking_over) this service over.
    ///
    /// # Errors
    /// As `open`.
    pub fn take_over(
        participant: &Participant<S>,
        service: &str,
        layout: &FrameLayout,
    ) -> Result<Self, OpenError> {
        let quality = Quality::of_frames(layout.signals.len());
        Self::open_with(participant, service, layout, quality, true)
    }

    /// As [`open`](Self::open); a service that is created here lets `frames` wait for each reader, if they
    /// take no more than 1 MiB.
    ///
    /// # Errors
    /// As `open`.
    pub fn open_with_room(
        participant: &Participant<S>,
        service: &str,
        layout: &FrameLayout,
        frames: usize,
    ) -> Result<Self, OpenError> {
        let quality = Quality::of_frames_behind(layout.signals.len(), frames);
        Self::open_with(participant, service, layout, quality, participant.takes_over())
    }

    fn open_with(
        participant: &Participant<S>,
        service: &str,
        layout: &FrameLayout,
        quality: Quality,
        takes_over: bool,
    ) -> Result<Self, OpenError> {
        let source = |source| OpenError::Layout { service: service.to_owned(), source };
        layout.check().map_err(source)?;
        let (channels, number) = (layout.signals.len(), layout.number());
        Self::open_channels(participant, service, channels, number, quality, takes_over)
    }

    /// Opens a service for what a process sends the one that stands in for it: its frames have no layout that is
    /// announced, and this number in its place. Few of them wait.
    ///
    /// # Errors
    /// As `open`.
    pub fn open_between_twins(
        participant: &Participant<S>,
        service: &str,
        channels: usize,
        number: u64,
    ) -> Result<Self, OpenError> {
        /// As many as the copies of a message of several frames need, and no more: states are large.
        const FRAMES: usize = 8;
        /// Both twins read, and such as died may not be cleaned up after yet.
        const READERS: usize = 4;
        let quality = Quality::of_frames_behind(channels, FRAMES).for_readers(READERS);
        Self::open_channels(participant, service, channels, number, quality, false)
    }

    fn open_channels(
        participant: &Participant<S>,
        service: &str,
        channels: usize,
        layout: u64,
        quality: Quality,
        takes_over: bool,
    ) -> Result<Self, OpenError> {
        let opened = service::open_or_create(participant, service, quality)?;
        let full = |shortage: Shortage| shortage.of_service(service);
        let pool = frame_pool(&opened, channels);
        space::require(pool.bytes).map_err(full)?;
        let peers = Peers::default();
        let frames = pool.messages;
        let port = sole_port(participant, service, &opened, channels, frames, &peers, takes_over)?;
        space::reserve_messages(participant.node().config(), port.id().value()).map_err(full)?;
        let mut publisher = Self {
            prepared: None,
            port,
            service: opened,
            channels,
            next_sequence: 0,
            term: next_term(),
            layout,
            reached: None,
            peers,
            guard: Guard::of_ordinary_thread(),
            counters: PublisherCounters::default(),
        };
        participant.repairs().adopt(service, Peer::Subscriber, &publisher.peers);
        publisher.prepare();
        tracing::info!("publishes service {service:?} (channels: {channels})");
        Ok(publisher)
    }

    /// Prepares the port for the real-time thread that will use it: nothing can be done with it until that thread
    /// [enters](ForRealTime::enter).
    pub(crate) fn for_real_time(mut self) -> ForRealTime<Self> {
        self.guard = Guard::Thread;
        ForRealTime::new(self)
    }

    /// Sends frames without a layout number: readers find values by channel, and types are not checked.
    #[must_use]
    pub fn plain(mut self) -> Self {
        self.layout = 0;
        self
    }

    /// Gets the next frame ready, all zero, and connects to subscribers that joined.
    ///
    /// Call it in the slack: iceoryx2 allocates, and maps memory if a peer has joined or left. Returns
    /// whether a frame is ready; a frame that was ready before is kept as it is.
    pub fn prepare(&mut self) -> bool {
        self.maintain();
        let subscribers = self.subscribers();
        // Right after somebody came or went the numbers may differ, which means nothing.
        let settled = !self.peers.note(subscribers);
        if settled && self.reached.take().is_some_and(|reached| reached < subscribers) {
            self.counters.silent += 1;
        }
        if self.prepared.is_none() {
            match self.port.loan_slice(self.channels) {
                Ok(frame) => self.prepared = Some(frame),
                Err(_) => self.counters.loan_errors += 1,
            }
        }
        self.prepared.is_some()
    }

    /// Connects to subscribers that joined, as [`prepare`](Self::prepare) does; for the end of the
    /// slack. A subscriber that joins later is connected by `send`.
    pub fn maintain(&mut self) {
        let _guarded = self.guard.of_call();
        // Failures are counted by the handler that the port was given.
        let _ = self.port.update_connections();
    }

    /// The values of the prepared frame, one per channel; `None` when there is no frame.
    pub fn values_mut(&mut self) -> Option<&mut [f64]> {
        self.prepared.as_mut().map(|frame| frame.payload_mut())
    }

    /// Sends the prepared frame and returns whether that worked.
    ///
    /// `now_ns` is asked once, right before sending, and becomes `publish_ns`. Never waits, logs
    /// or panics. A frame that was not sent leaves a gap in the sequence, so readers see the loss.
    pub fn send(&mut self, stamp: Stamp, now_ns: impl FnOnce() -> u64) -> bool {
        let sequence = self.next_sequence;
        self.next_sequence += 1;
        let Some(mut frame) = self.prepared.take() else {
            self.counters.unsent += 1;
            return false;
        };
        let header = frame.user_header_mut();
        *header = FrameHeader {
            sequence,
            cycle: stamp.cycle,
            release_ns: stamp.release_ns,
            publish_ns: 0,
            source_ns: stamp.source_ns,
            missed: stamp.missed,
            flags: stamp.flags.bits(),
            term: self.term,
            layout: self.layout,
        };
        let _guarded = self.guard.of_call();
        header.publish_ns = now_ns();
        match frame.send() {
            Ok(reached) => {
                self.counters.sent += 1;
                self.reached = Some(reached);
                true
            }
            Err(_) => {
                self.counters.send_errors += 1;
                false
            }
        }
    }

    /// The number of the next frame.
    pub fn next_sequence(&self) -> u64 {
        self.next_sequence
    }

    /// Goes on as the writer with this term, from this number on: the other process of a node took over, or is
    /// followed. For the cycle.
    pub fn go_on(&mut self, term: u64, sequence: u64) {
        (self.term, self.next_sequence) = (term, sequence);
    }

    /// Leaves the numbers of the next frames to so many that the other process of a node may have sent. For the cycle.
    pub fn pass_over(&mut self, frames: u64) {
        self.next_sequence += frames;
    }

    /// Gives the frames that a process sends its twin this number from the next one on.
    pub fn renumber(&mut self, number: u64) {
        self.layout = number;
    }

    /// Counts since the publisher was opened.
    pub fn counters(&self) -> PublisherCounters {
        PublisherCounters {
            connects: self.peers.changes(),
            connect_errors: self.peers.failures(),
            ..self.counters
        }
    }

    /// How many subscribers the service has now, connected or not.
    ///
    /// Not for the cycle: counting writes to shared memory and may repeat while peers come or go.
    pub fn subscribers(&self) -> usize {
        self.service.dynamic_config().number_of_subscribers()
    }
}

/// The frames of a publisher.
pub(crate) fn frame_pool<S: Service>(opened: &FrameService<S>, channels: usize) -> Pool {
    Pool::new(opened, MAX_LOANED, channels * size_of::<f64>())
}

/// The term of a publisher that takes its service now: Unix nanoseconds, and above every earlier one
/// of this process.
fn next_term() -> u64 {
    static LAST: AtomicU64 = AtomicU64::new(0);
    let now = unix_ns();
    let later = |last: u64| Some(now.max(last.saturating_add(1)));
    let last = LAST.fetch_update(Ordering::Relaxed, Ordering::Relaxed, later).unwrap_or_default();
    now.max(last.saturating_add(1))
}

/// Now, in ns since 1970.
pub(crate) fn unix_ns() -> u64 {
    let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since_1970.as_nanos()).unwrap_or(u64::MAX)
}
