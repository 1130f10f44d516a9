//! The reading end of a service.

use iceoryx2::port::subscriber::{Subscriber, SubscriberCreateError};
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::sample::Sample;
use iceoryx2::service::port_factory::PortFactory as _;

use crate::file_override::Guard;
use crate::frames::following::{Arrival, Following, Verdict, Writer, WriterCounts};
use crate::frames::next_frame::NextFrame;
use crate::frames::peers::Peers;
use crate::frames::repair::Peer;
use crate::frames::service::{self, FrameService, Quality, holders};
use crate::frames::subscriber_counters::SubscriberCounters;
use crate::frames::writers;
use crate::{
    Flags, ForRealTime, FrameHeader, FrameRef, OpenError, Participant, Service,
    give_up_file_override,
};

/// How many frames [`Depth::Newest`] lets wait: with two, a frame that arrives just early does
/// not push out the one before it, so a reader of the same period can count losses.
const NEWEST_FRAMES: usize = 2;

/// How many frames may wait for a reader before the oldest is dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Depth {
    /// Two: for control inputs, which read the newest.
    Newest,
    /// As many as the service allows (2 to 256 if isochrone created it): for recorders.
    All,
}

/// Reads the frames of one service, from one publisher at a time.
///
/// It switches at once to a publisher with a higher [`term`](FrameHeader::term), and to any other one
/// when the current publisher has ended or left or has been silent for 1 s or three of its
/// [periods](Self::set_period), whichever is longer. Between this machine and another, whose frames a link
/// brings, terms do not count: a publisher with a term on this machine is taken at once.
#[derive(Debug)]
pub struct FrameSubscriber<S: Service> {
    /// A frame that [`has_newer`](Self::has_newer) or [`peek_next`](Self::peek_next) took out of the
    /// buffer.
    held: Option<Sample<S, [f64], FrameHeader>>,
    /// The frame that the caller has. Giving it back writes where the publisher's CPU writes, so it waits for
    /// [`maintain`](Self::maintain), or until the next frame is taken.
    lent: Option<Sample<S, [f64], FrameHeader>>,
    port: Subscriber<S, [f64], FrameHeader>,
    service: FrameService<S>,
    /// Most frames that one call of `newest` looks at.
    drain_limit: usize,
    /// Whether two frames may be held at once.
    can_compare: bool,
    peers: Peers,
    guard: Guard,
    following: Following,
    next_frame: NextFrame,
    /// Those who write the service, as last looked up.
    writers: Vec<Writer>,
    /// How many subscribers there were then, if one of the writers may turn out to be a link.
    subscribers: Option<usize>,
    receive_errors: u64,
}

impl<S: Service> FrameSubscriber<S> {
    /// Opens `service` for reading.
    ///
    /// If the service does not exist, it is created, so publisher and reader may start in any order.
    /// `channels`, the approximate number of values in a frame, determines how many frames may wait.
    ///
    /// # Errors
    /// The name or the existing service does not fit, or the service has no place left.
    pub fn open(
        participant: &Participant<S>,
        service: &str,
        channels: usize,
        depth: Depth,
    ) -> Result<Self, OpenError> {
        let opened = service::open_or_create(participant, service, Quality::of_frames(channels))?;
        Self::connect(participant, service, opened, depth)
    }

    /// Opens `service` for reading, whatever its frames contain; `None` if it does not exist.
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
        Self::connect(participant, service, opened, depth).map(Some)
    }

    /// Prepares the port for the real-time thread that will use it: nothing can be done with it until that thread
    /// [enters](ForRealTime::enter).
    pub(crate) fn for_real_time(mut self) -> ForRealTime<Self> {
        self.guard = Guard::Thread;
        ForRealTime::new(self)
    }

    pub(crate) fn connect(
        participant: &Participant<S>,
        service: &str,
        opened: FrameService<S>,
        depth: Depth,
    ) -> Result<Self, OpenError> {
        let provided = opened.static_config().subscriber_max_buffer_size();
        let buffer = match depth {
            Depth::Newest => NEWEST_FRAMES.min(provided),
            Depth::All => provided,
        };
        let peers = Peers::default();
        let places = service::subscriber_places(&opened);
        let full = || OpenError::Full {
            service: service.to_owned(),
            what: "subscriber",
            limit: places,
            holders: holders::of_subscribers(&opened),
        };
        let port = service::open_port(participant, &opened, || {
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
        })?;
        let publishers = opened.static_config().max_publishers();
        let mut subscriber = Self {
            held: None,
            lent: None,
            // Each publisher's buffer, and the leftovers of one that was replaced.
            drain_limit: buffer * (publishers + 1),
            can_compare: opened.static_config().subscriber_max_borrowed_samples() > 1,
            port,
            service: opened,
            peers,
            guard: Guard::of_ordinary_thread(),
            following: Following::new(),
            next_frame: NextFrame::new(match depth {
                // Its reader wants none of the frames that newer ones displace.
                Depth::Newest => u64::MAX,
                Depth::All => buffer as u64,
            }),
            writers: Vec::with_capacity(publishers),
            subscribers: None,
            receive_errors: 0,
        };
        participant.repairs().adopt(service, Peer::Publisher, &subscriber.peers);
        subscriber.maintain();
        tracing::info!("reads service {service:?} (frames that may wait: {buffer})");
        Ok(subscriber)
    }

    /// Takes all frames that wait and returns the newest of them; `None` when none waited.
    ///
    /// `now_ns` is the reader's clock, as read for this cycle. Bounded: looks at a full buffer per
    /// possible publisher at most. Never waits or logs, and allocates only where a publisher has joined. A frame
    /// of a writer that was not seen before waits for the next [`maintain`](Self::maintain), unless its term is
    /// higher.
    pub fn newest(&mut self, now_ns: u64) -> Option<FrameRef<'_, S>> {
        let _guarded = self.guard.of_call();
        self.hold_newest(now_ns);
        self.lend_held()
    }

    /// Whether a frame waits that `is_wanted`, for readers that watch for one.
    ///
    /// `now_ns` is the reader's clock. Takes frames, and holds on to the last of them, until that one is
    /// wanted or no more wait; frames of writers that are not followed are no news. What is held, and
    /// whatever is newer by then, is left for [`newest`](Self::newest). Never waits, logs or allocates, and
    /// makes no system call, unless a publisher has joined or left: then iceoryx2 connects here instead of
    /// in `newest`.
    pub fn has_newer(&mut self, now_ns: u64, is_wanted: impl Fn(&FrameHeader) -> bool) -> bool {
        let _guarded = self.guard.of_call();
        for _ in 0..self.drain_limit {
            if self.held.as_ref().is_some_and(|sample| is_wanted(sample.user_header())) {
                return true;
            }
            if !self.take_newer(now_ns) {
                return false;
            }
        }
        false
    }

    fn lend_held(&mut self) -> Option<FrameRef<'_, S>> {
        self.lent = self.held.take();
        self.lent.as_ref().map(FrameRef::new)
    }

    /// Takes all frames that wait and holds on to the newest of them.
    fn hold_newest(&mut self, now_ns: u64) {
        for _ in 0..self.drain_limit {
            if !self.take_newer(now_ns) {
                break;
            }
        }
    }

    /// Takes a frame, and holds on to it if its writer is followed; `false` if none waits.
    fn take_newer(&mut self, now_ns: u64) -> bool {
        if !self.can_compare && self.held.is_some() {
            if !self.port.has_samples().unwrap_or(false) {
                return false;
            }
            self.held = None;
        }
        let Some(sample) = self.receive() else { return false };
        // The frames of one writer come in their order.
        if self.judge(&arrival(&sample, now_ns)) == Verdict::Take {
            self.held = Some(sample);
        }
        true
    }

    /// Takes the next frame in line, for readers that want them all; `None` when none waits.
    ///
    /// `now_ns` is the reader's clock; a reading that was made a little while ago will do. Looks up
    /// who writes the service, and allocates for that, when a frame comes from a writer that was not
    /// seen before.
    pub fn next(&mut self, now_ns: u64) -> Option<FrameRef<'_, S>> {
        let _guarded = self.guard.of_call();
        self.hold_next(now_ns);
        self.lend_held()
    }

    /// The header of the frame that [`next`](Self::next) would return, and holds on to that frame.
    ///
    /// As `next` otherwise.
    pub fn peek_next(&mut self, now_ns: u64) -> Option<&FrameHeader> {
        let _guarded = self.guard.of_call();
        self.hold_next(now_ns);
        self.held.as_ref().map(|sample| sample.user_header())
    }

    /// Takes the next frame in line, unless one is held.
    fn hold_next(&mut self, now_ns: u64) {
        if self.held.is_some() {
            return;
        }
        for _ in 0..self.drain_limit {
            let Some(sample) = self.receive() else { break };
            let arrival = arrival(&sample, now_ns);
            let mut verdict = self.judge(&arrival);
            if verdict == Verdict::Stranger {
                self.look_up_writers();
                if self.following.has_lost_its_writer() {
                    verdict = self.following.judge(&arrival);
                }
            }
            if verdict == Verdict::Take {
                self.next_frame.taken(sample.user_header().publish_ns, now_ns);
                self.held = Some(sample);
                break;
            }
        }
    }

    /// When to look for frames again, in ns of the reader's clock: for readers that sleep until then.
    ///
    /// Call it when nothing waits; `now_ns` is the reader's clock, and the result is always later. Nobody
    /// wakes a reader, because that would cost the thread that sends a system call. If the writer announced a
    /// [period](Self::set_period), the reader is told to look when the next frame is due, a period after the
    /// last one that [`next`](Self::next) took. If that frame is late, it is told to look again after 20 us,
    /// for up to 1 ms or a period. All other frames are looked for after 100 us, and those of a writer that
    /// has been silent for 1 s or three periods after 5 ms.
    ///
    /// No nap is longer than the [longest](Self::longest_nap_ns). To watch several services, sleep until
    /// the earliest of their looks.
    ///
    /// Neither allocates nor makes a system call.
    pub fn next_look_ns(&mut self, now_ns: u64) -> u64 {
        self.next_frame.look_ns(now_ns)
    }

    /// The longest nap of a reader that takes all frames in time, in ns: the time in which the writer fills
    /// half of the buffer, from 0.5 ms to 5 ms. A writer that announces no period may be as fast as the
    /// fastest task.
    pub fn longest_nap_ns(&self) -> u64 {
        self.next_frame.longest_nap_ns()
    }

    /// Sets the period that the writer announced, in ns, or 0: how long it may be silent before another
    /// writer is followed depends on it, and when its next frame is looked for.
    pub fn set_period(&mut self, period_ns: u64) {
        self.following.set_period(period_ns);
        self.next_frame.set_period(period_ns);
    }

    /// Connects to publishers that joined; for the slack, since iceoryx2 maps memory for that.
    pub fn maintain(&mut self) {
        let _guarded = self.guard.of_call();
        self.lent = None;
        // Failures are counted by the handler that the port was given.
        let _ = self.port.update_connections();
        let changed = self.peers.note(self.publishers())
            || self.subscribers.is_some_and(|subscribers| subscribers != self.subscribers());
        if changed || self.following.has_stranger() {
            self.look_up_writers();
        }
    }

    /// iceoryx2 allocates for this.
    fn look_up_writers(&mut self) {
        let subscribers = self.subscribers();
        let may_be_link = writers::list(&self.service, &mut self.writers);
        self.subscribers = may_be_link.then_some(subscribers);
        self.following.look(&self.writers);
    }

    /// What becomes of a frame. That of a successor which nobody knows yet has the writers looked up: iceoryx2,
    /// which has just connected to it, has allocated then too.
    fn judge(&mut self, arrival: &Arrival) -> Verdict {
        if self.following.must_look(arrival) {
            self.look_up_writers();
        }
        self.following.judge(arrival)
    }

    /// Takes the next frame, whoever sent it, and says who that is.
    pub(crate) fn next_of_any(&mut self) -> Option<(u128, FrameHeader)> {
        let _guarded = self.guard.of_call();
        let sample = self.receive()?;
        Some((sample.header().publisher_id().value(), *sample.user_header()))
    }

    pub(crate) fn service(&self) -> &FrameService<S> {
        &self.service
    }

    /// How many publishers the service has now, connected or not. Not for the cycle: counting writes to shared memory.
    pub fn publishers(&self) -> usize {
        self.service.dynamic_config().number_of_publishers()
    }

    /// How many of the publishers are links, which send what a writer of another machine sends there; as of the
    /// last [`maintain`](Self::maintain) that saw one come or go.
    pub fn links(&self) -> usize {
        self.writers.iter().filter(|writer| writer.is_far).count()
    }

    fn subscribers(&self) -> usize {
        self.service.dynamic_config().number_of_subscribers()
    }

    /// What happened since the subscriber was opened.
    pub fn counters(&self) -> SubscriberCounters {
        let counts = self.following.counts();
        let WriterCounts { received, lost, restarts, other_writers, superseded } = counts;
        SubscriberCounters {
            received,
            lost,
            restarts,
            other_writers,
            superseded,
            connects: self.peers.changes(),
            connect_errors: self.peers.failures(),
            receive_errors: self.receive_errors,
        }
    }

    fn receive(&mut self) -> Option<Sample<S, [f64], FrameHeader>> {
        // A service may let a reader have only one frame.
        self.lent = None;
        match self.port.receive() {
            Ok(received) => received,
            Err(_) => {
                self.receive_errors += 1;
                None
            }
        }
    }
}

fn arrival<S: Service>(sample: &Sample<S, [f64], FrameHeader>, now_ns: u64) -> Arrival {
    let header = sample.user_header();
    Arrival {
        writer: sample.header().publisher_id().value(),
        term: header.term,
        sequence: header.sequence,
        is_last: header.flags().contains(Flags::STOPPED),
        now_ns,
    }
}
