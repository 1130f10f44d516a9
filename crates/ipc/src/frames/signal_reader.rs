//! The values of a service's frames by their names, in an ordinary thread.

use std::collections::VecDeque;
use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic, PromptWakeUps};

use crate::frames::layout_source::LayoutSource;
use crate::frames::service::open_existing;
use crate::frames::signal_frame::Origin;
use crate::{
    Announcement, Depth, FrameHeader, FrameSubscriber, InRealTime, LayoutKey, LayoutWatcher,
    OpenError, ParticipantRef, Receipt, SenderClock, Service, SignalError, SignalFrame,
    SubscriberCounters, ToldLayouts,
};

/// How many channels a frame is taken for, where this reader creates the service.
const CHANNELS: usize = 1_000;
/// How long a frame waits for its layout to be announced. Publishers announce within half of it.
const PATIENCE: Duration = Duration::from_secs(1);
/// Most frames that wait for their layouts.
const MOST_WAITING: usize = 65_536;
/// Between two looks for announcements, peers and failed connections.
const TEND_INTERVAL_NS: u64 = 10_000_000;

/// Reads the frames of a service and gives their values by names, as the publisher announces them.
///
/// For ordinary threads. Every frame is given, in its order: also those of a publisher that starts again with other
/// signals, or is replaced. A frame whose layout is not known yet waits for the announcement, for up to 1 s; with it
/// wait those behind it. While the reader is asked for frames it also looks after announcements and failed connections,
/// so nothing else needs to be called.
///
/// Nobody wakes the reader. [`wait`](Self::wait) sleeps until the next frame is due if the publisher announces a
/// period, and otherwise looks every 100 us. While nobody has sent anything for 1 s or three periods, it looks every 5
/// ms.
///
/// ```
/// use std::time::Duration;
/// use isochrone_ipc::{IsolatedDomain, Participant, SignalReader, ipc};
///
/// # let domain = IsolatedDomain::new("signals")?;
/// let participant = Participant::<ipc::Service>::join("reader", &domain)?;
/// let mut level = SignalReader::open(&participant, "plant/level", &["level.y"])?;
/// while let Some(frame) = level.wait(Duration::from_millis(50)) {
///     if frame.lost() > 0 {
///         println!("{} frames were lost", frame.lost());
///     }
///     for (name, value) in frame.values()? {
///         println!("frame {}: {name} = {value} [{}]", frame.sequence(), frame.flags());
///     }
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct SignalReader<'p, S: Service> {
    service: String,
    /// The wanted signals; empty: all.
    names: Vec<String>,
    subscriber: FrameSubscriber<S>,
    layouts: LayoutSource<'p, S>,
    patience_ns: u64,
    /// A frame that the subscriber holds, and that can be given.
    ready: Option<Receipt>,
    /// Frames whose layouts were not known when they came, and those behind them.
    waiting: VecDeque<Unread>,
    /// The values of the last of them that was given.
    given: Vec<f64>,
    /// Where the wanted signals stand in the frames given last.
    places: Option<(LayoutKey, Result<Vec<usize>, SignalError>)>,
    /// As they were with the frame before.
    before: SubscriberCounters,
    now_ns: u64,
    /// When nothing waited to be received.
    idle_ns: u64,
    /// When to look after announcements, peers and connections.
    tend_ns: u64,
}

/// A frame that waits for its layout.
#[derive(Debug)]
struct Unread {
    receipt: Receipt,
    /// When it came, or the first of those that it replaced.
    since_ns: u64,
    values: Vec<f64>,
}

impl<'p, S: Service> SignalReader<'p, S> {
    /// Opens `service` for reading the signals with these names, or all signals if there is no name.
    ///
    /// If the service does not exist, it is created, so publisher and reader may start in any order.
    ///
    /// # Errors
    /// The service's name is not possible, the existing service does not fit, or it has no place left. That a
    /// signal is missing is told by each frame that lacks it.
    pub fn open(
        participant: impl Into<ParticipantRef<'p, S>>,
        service: &str,
        names: &[&str],
    ) -> Result<Self, OpenError> {
        let participant = participant.into();
        let channels = names.len().max(CHANNELS);
        // First the layouts: a publisher that sees the reader may send one frame and end, and then its layout has been
        // announced to all who listen.
        let watcher = LayoutWatcher::open(&participant, service)?;
        let subscriber = FrameSubscriber::open(&participant, service, channels, Depth::All)?;
        let layouts = LayoutSource::Heard { participant, watcher };
        Ok(Self::reading(subscriber, service, names, layouts))
    }

    /// As [`open`](Self::open), but `None` if the service does not exist.
    ///
    /// # Errors
    /// As `open`.
    pub fn open_existing(
        participant: impl Into<ParticipantRef<'p, S>>,
        service: &str,
        names: &[&str],
    ) -> Result<Option<Self>, OpenError> {
        let participant = participant.into();
        let Some(opened) = open_existing(&participant, service)? else { return Ok(None) };
        // As in `open`.
        let watcher = LayoutWatcher::open(&participant, service)?;
        let subscriber = FrameSubscriber::connect(&participant, service, opened, Depth::All)?;
        let layouts = LayoutSource::Heard { participant, watcher };
        Ok(Some(Self::reading(subscriber, service, names, layouts)))
    }

    fn reading(
        subscriber: FrameSubscriber<S>,
        service: &str,
        names: &[&str],
        layouts: LayoutSource<'p, S>,
    ) -> Self {
        let now_ns = Monotonic.now_ns();
        Self {
            service: service.to_owned(),
            names: names.iter().map(|name| (*name).to_owned()).collect(),
            subscriber,
            layouts,
            patience_ns: 0,
            ready: None,
            waiting: VecDeque::new(),
            given: Vec::new(),
            places: None,
            before: SubscriberCounters::default(),
            now_ns,
            idle_ns: now_ns,
            tend_ns: now_ns,
        }
        .with_patience(PATIENCE)
    }

    /// Reads with a port of a real-time thread. Another thread has a [`LayoutWatcher`](crate::LayoutWatcher) for the
    /// service, [tells](ToldLayouts::tell) what it hears, and tends the participant.
    ///
    /// Until the publisher announces other signals, no call allocates, waits for a lock or touches a file, except
    /// [`wait`](Self::wait), which sleeps.
    pub fn told(
        subscriber: FrameSubscriber<S>,
        service: &str,
        names: &[&str],
        layouts: ToldLayouts,
    ) -> Self {
        Self::reading(subscriber, service, names, LayoutSource::Told(layouts))
    }

    /// Sets how long a frame waits for its layout to be announced before it is given without names; 1 s if this is
    /// not called. With a patience of 0, no frame waits.
    #[must_use]
    pub fn with_patience(self, patience: Duration) -> Self {
        Self { patience_ns: nanoseconds(patience), ..self }
    }

    /// For a thread that looks for frames all the time.
    ///
    /// In a process of root each look for frames takes root's right to open any file from the thread, and gives
    /// it back: four system calls. Here the thread is without that right until the reader ends, and a look makes
    /// none.
    pub fn for_this_thread(self) -> InRealTime<Self> {
        let Self { subscriber, .. } = self;
        subscriber.for_real_time().map(|subscriber| Self { subscriber, ..self }).enter()
    }

    /// The next frame in line; `None` if none can be given now.
    pub fn next_frame(&mut self) -> Option<SignalFrame<'_, S>> {
        if self.is_ready() { self.give() } else { None }
    }

    /// The newest frame, without those before it; `None` if none has come since a frame was given.
    pub fn newest_frame(&mut self) -> Option<SignalFrame<'_, S>> {
        self.now_ns = Monotonic.now_ns();
        self.tend_in_time();
        // Wants none of them, so the newest stays.
        self.subscriber.has_newer(self.now_ns, |_| false);
        if let Some(header) = self.subscriber.peek_next(self.now_ns).copied() {
            if header.publish_ns > self.now_ns {
                // Sent since the reading.
                self.now_ns = Monotonic.now_ns();
            }
            let receipt = self.receipt(header);
            let replaced = self.waiting.front();
            let since_ns = replaced.map_or(receipt.received_ns, |first| first.since_ns);
            self.waiting.clear();
            self.take_in(receipt, since_ns);
        }
        let superseded = self.waiting.len().saturating_sub(1);
        self.waiting.drain(..superseded);
        self.idle_ns = self.now_ns;
        if self.ready.is_some() || self.has_settled() { self.give() } else { None }
    }

    /// Connects to publishers that joined, and takes what is announced; for the slack of a cycle. Calls for frames do so
    /// every 10 ms if this is not called.
    pub fn maintain(&mut self) {
        self.tend();
    }

    /// As [`next_frame`](Self::next_frame), of the frames that were received and wait for their layouts: for the end of a
    /// program, which takes no new ones.
    pub fn next_waiting(&mut self) -> Option<SignalFrame<'_, S>> {
        self.now_ns = Monotonic.now_ns();
        self.tend_in_time();
        if self.has_settled() { self.give() } else { None }
    }

    /// Whether frames were received that wait for their layouts.
    pub fn is_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Sleeps until a frame comes, and returns it; `None` if none came in this time.
    ///
    /// Signals do not end the sleep: to end on one, wait for some milliseconds at a time.
    pub fn wait(&mut self, timeout: Duration) -> Option<SignalFrame<'_, S>> {
        let _prompt = PromptWakeUps::in_this_thread();
        let until_ns = Monotonic.now_ns().saturating_add(nanoseconds(timeout));
        while !self.is_ready() && self.now_ns < until_ns {
            let look_ns = self.next_look_ns();
            Monotonic.sleep_until_ns(look_ns.min(until_ns));
        }
        self.next_frame()
    }

    /// When to ask for frames again, in ns of `CLOCK_MONOTONIC`, after [`next_frame`](Self::next_frame) returned none: for a
    /// thread that reads several services and sleeps until the earliest of these.
    pub fn next_look_ns(&mut self) -> u64 {
        let now_ns = Monotonic.now_ns();
        self.subscriber.next_look_ns(now_ns).min(self.tend_ns.max(now_ns))
    }

    /// The service's name.
    pub fn service(&self) -> &str {
        &self.service
    }

    /// What was announced last of the service's frames.
    pub fn announced(&self) -> Option<&Announcement> {
        self.layouts.newest()
    }

    /// The port, for its counters and those who publish.
    pub fn subscriber(&self) -> &FrameSubscriber<S> {
        &self.subscriber
    }

    /// Receives what there is, and says whether a frame can be given.
    fn is_ready(&mut self) -> bool {
        if self.ready.is_none() {
            self.now_ns = Monotonic.now_ns();
            self.receive();
        }
        if self.ready.is_none() {
            self.tend_in_time();
        }
        self.ready.is_some() || self.has_settled()
    }

    /// Receives frames until one can be given where it lies, or none is left.
    fn receive(&mut self) {
        while self.ready.is_none() && self.waiting.len() < MOST_WAITING {
            let Some(header) = self.subscriber.peek_next(self.now_ns).copied() else {
                self.idle_ns = self.now_ns;
                return;
            };
            // The frame may have been sent since the last reading.
            self.now_ns = Monotonic.now_ns();
            let receipt = self.receipt(header);
            self.take_in(receipt, receipt.received_ns);
        }
    }

    /// Leaves the frame with the subscriber where it can be given, and lets it wait otherwise.
    fn take_in(&mut self, receipt: Receipt, since_ns: u64) {
        if self.waiting.is_empty() && self.needs_no_wait(&receipt, since_ns) {
            self.ready = Some(receipt);
        } else if let Some(frame) = self.subscriber.next(self.now_ns) {
            self.waiting.push_back(Unread { receipt, since_ns, values: frame.values().to_vec() });
        }
    }

    fn receipt(&mut self, header: FrameHeader) -> Receipt {
        let counters = self.subscriber.counters();
        let before = std::mem::replace(&mut self.before, counters);
        Receipt {
            header,
            received_ns: self.now_ns,
            waited_ns: self.now_ns.saturating_sub(self.idle_ns),
            lost: counters.lost.saturating_sub(before.lost),
            restarts: counters.restarts.saturating_sub(before.restarts),
            ..Receipt::default()
        }
    }

    /// Whether the first of the frames that wait can be given.
    fn has_settled(&self) -> bool {
        let is_full = self.waiting.len() >= MOST_WAITING;
        self.waiting
            .front()
            .is_some_and(|first| is_full || self.needs_no_wait(&first.receipt, first.since_ns))
    }

    fn needs_no_wait(&self, receipt: &Receipt, since_ns: u64) -> bool {
        let layout = receipt.header.layout;
        let waited_ns = self.now_ns.saturating_sub(since_ns);
        layout == 0 || waited_ns >= self.patience_ns || self.layouts.find(layout).is_some()
    }

    fn tend_in_time(&mut self) {
        if self.now_ns >= self.tend_ns {
            self.tend();
        }
    }

    fn tend(&mut self) {
        self.tend_ns = self.now_ns + TEND_INTERVAL_NS;
        self.subscriber.maintain();
        if self.layouts.look()
            && let Some(announced) = self.layouts.newest()
        {
            self.subscriber.set_period(announced.layout.period_ns.unwrap_or_default());
        }
    }

    /// Gives the frame that is ready, or the first of those that wait.
    fn give(&mut self) -> Option<SignalFrame<'_, S>> {
        let (receipt, channels) = match self.ready.take() {
            Some(receipt) => (receipt, self.subscriber.next(self.now_ns)?.values()),
            None => {
                let Unread { receipt, values, .. } = self.waiting.pop_front()?;
                self.given = values;
                (receipt, &self.given[..])
            }
        };
        let Receipt { header, received_ns, .. } = receipt;
        let announced = self.layouts.find(header.layout);
        let clock = announced.map_or(SenderClock::Shared, Announcement::clock);
        let receipt = Receipt { stamps: header.credible(clock, received_ns).stamps, ..receipt };
        let key = LayoutKey::new(&header, announced, channels.len());
        let origin = Origin { service: &self.service, announced, channels: channels.len() };
        if self.places.as_ref().is_none_or(|(known, _)| *known != key) {
            self.places = Some((key, origin.places(&self.names)));
        }
        let (_, places) = self.places.as_ref()?;
        Some(SignalFrame { receipt, channels, origin, places, layouts: &self.layouts })
    }
}

fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}
