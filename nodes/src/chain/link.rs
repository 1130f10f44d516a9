//! One service of a chain, as it is read.

use std::collections::VecDeque;
use std::fmt;

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{
    Announcement, Depth, Flags, FrameSubscriber, LayoutWatcher, Participant, SenderClock, Stamps,
    SubscriberCounters, ipc,
};
use isochrone_timing::ChainFrame;
use isochrone_timing::units::duration;

use crate::failure::Failure;

/// A service that sent nothing for so long at the end of a measurement has stopped, unless its period is
/// longer than a third of it.
const SILENCE_NS: u64 = 2_000_000_000;
const SILENT_PERIODS: u64 = 3;

/// A service that is measured.
pub(super) struct Link {
    service: String,
    subscriber: FrameSubscriber<ipc::Service>,
    watcher: LayoutWatcher<ipc::Service>,
    taken: VecDeque<ChainFrame>,
    frames: u64,
    /// Frames with stamps of another clock, which are left out.
    future_stamps: u64,
    /// When the newest frame came.
    heard_ns: Option<u64>,
    has_ended: bool,
    /// What had happened before the measurement began.
    before: SubscriberCounters,
}

/// Why a service sends no more.
pub(super) enum End {
    /// Its publisher said so, or has left.
    Left { service: String },
    /// Nothing came for this time, in ns.
    Silent { service: String, for_ns: u64 },
    /// Nothing came at all.
    Never { service: String },
}

impl fmt::Display for End {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Left { service } => write!(
                f,
                "the publisher of \"{service}\" ended during the measurement; the numbers are those until \
                 then"
            ),
            Self::Silent { service, for_ns } => write!(
                f,
                "\"{service}\" has sent nothing for {}: its publisher hangs, is stopped or was killed; \
                 the numbers are those until then",
                duration(*for_ns as f64)
            ),
            Self::Never { service } => write!(
                f,
                "\"{service}\" has sent nothing during the measurement: its publisher hangs, is stopped or \
                 was killed, or its period is longer (--seconds)"
            ),
        }
    }
}

impl Link {
    /// Opens all services of a chain.
    pub(super) fn open_all(
        participant: &Participant<ipc::Service>,
        services: &[String],
    ) -> Result<Vec<Self>, Failure> {
        services.iter().map(|service| Self::open(participant, service)).collect()
    }

    fn open(participant: &Participant<ipc::Service>, service: &str) -> Result<Self, Failure> {
        let subscriber = FrameSubscriber::open_existing(participant, service, Depth::All);
        let Some(subscriber) = subscriber.map_err(Failure::found)? else {
            return Err(Failure::nobody(format!("service \"{service}\" has just ended")));
        };
        Ok(Self {
            service: service.to_owned(),
            subscriber,
            watcher: LayoutWatcher::open(participant, service).map_err(Failure::found)?,
            taken: VecDeque::new(),
            frames: 0,
            future_stamps: 0,
            heard_ns: None,
            has_ended: false,
            before: SubscriberCounters::default(),
        })
    }

    pub(super) fn service(&self) -> &str {
        &self.service
    }

    pub(super) fn announced(&self) -> Option<&Announcement> {
        self.watcher.newest()
    }

    pub(super) fn is_announced(&self) -> bool {
        self.announced().is_some()
    }

    /// Whether another machine sends it.
    pub(super) fn is_foreign(&self) -> bool {
        self.announced().is_some_and(|announced| announced.clock() == SenderClock::Foreign)
    }

    /// Looks for what is announced.
    pub(super) fn look(&mut self, participant: &Participant<ipc::Service>) {
        self.watcher.look(participant);
        self.subscriber.maintain();
        if let Some(period_ns) = self.announced().and_then(|announced| announced.layout.period_ns) {
            self.subscriber.set_period(period_ns);
        }
    }

    /// Drops what waits: the measurement begins.
    pub(super) fn discard(&mut self) {
        self.receive();
        self.taken.clear();
        (self.frames, self.future_stamps, self.heard_ns) = (0, 0, None);
        self.before = self.subscriber.counters();
    }

    /// How long frames may lie there, in ns.
    pub(super) fn longest_nap_ns(&self) -> u64 {
        self.subscriber.longest_nap_ns()
    }

    /// Takes the frames that wait.
    pub(super) fn receive(&mut self) {
        self.subscriber.maintain();
        while let Some(frame) = self.subscriber.next(Monotonic.now_ns()) {
            let header = *frame.header();
            let now_ns = Monotonic.now_ns();
            self.heard_ns = Some(now_ns);
            self.has_ended = header.flags().contains(Flags::STOPPED);
            self.frames += 1;
            let credible = header.credible(SenderClock::Shared, now_ns);
            if credible.stamps != Stamps::Believed {
                self.future_stamps += 1;
                continue;
            }
            self.taken.push_back(ChainFrame {
                release_ns: header.release_ns,
                publish_ns: header.publish_ns,
                source_ns: header.source_ns,
            });
        }
    }

    /// The frames that were taken since the last time and sent until an instant.
    pub(super) fn taken(&mut self, until_ns: u64) -> impl Iterator<Item = ChainFrame> {
        let later = self.taken.iter().position(|frame| frame.publish_ns > until_ns);
        self.taken.drain(..later.unwrap_or(self.taken.len()))
    }

    /// Whether its publisher has ended.
    pub(super) fn ended(&self) -> Option<End> {
        let has_left = self.has_ended || self.subscriber.publishers() == 0;
        has_left.then(|| End::Left { service: self.service.clone() })
    }

    /// Whether it has sent nothing for long, in a measurement that began at an instant.
    pub(super) fn silence(&self, begin_ns: u64, now_ns: u64) -> Option<End> {
        let service = self.service.clone();
        let period_ns = self.announced().and_then(|announced| announced.layout.period_ns);
        let periods_ns = period_ns.unwrap_or_default().saturating_mul(SILENT_PERIODS);
        let for_ns = now_ns.saturating_sub(self.heard_ns.unwrap_or(begin_ns));
        if for_ns < SILENCE_NS.max(periods_ns) {
            return None;
        }
        Some(match self.heard_ns {
            Some(_) => End::Silent { service, for_ns },
            None => End::Never { service },
        })
    }

    pub(super) fn frames(&self) -> u64 {
        self.frames
    }

    pub(super) fn future_stamps(&self) -> u64 {
        self.future_stamps
    }

    /// Frames that were sent and did not come here.
    pub(super) fn gaps(&self) -> u64 {
        self.subscriber.counters().lost - self.before.lost
    }

    /// How often another publisher took over, or the same one began anew.
    pub(super) fn restarts(&self) -> u64 {
        self.subscriber.counters().restarts - self.before.restarts
    }
}
