//! A short look at the frames of a domain.

use std::thread;
use std::time::{Duration, Instant};

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{
    Announcement, Depth, Flags, FrameSubscriber, LayoutWatcher, ListedService, OpenError,
    Participant, SenderClock, SignalSpec, ipc,
};
use isochrone_processes::Stop;
use serde::ser::SerializeStruct;
use serde::{Serialize, Serializer};

use crate::failure::Failure;
use crate::numbers::six_digits;
use crate::terminal;

/// Publishers announce their layout to a new reader within 20 ms, and repeat it every 500 ms.
const ANSWER: Duration = Duration::from_secs(1);
/// How long frames are waited for, and counted where no period is announced.
const COUNTING: Duration = Duration::from_millis(500);
const LOOK_INTERVAL: Duration = Duration::from_millis(2);

type Service = ipc::Service;

/// A service, as observed for a moment.
pub(super) struct ObservedService {
    pub(super) service: ListedService,
    pub(super) announced: Option<Announcement>,
    pub(super) rate: Rate,
    /// Of the newest frame; `None` if none arrived meanwhile.
    pub(super) flags: Option<Flags>,
}

/// How often frames come.
#[derive(Clone, Copy)]
pub(super) enum Rate {
    Announced { period_ns: u64 },
    Measured { hz: f64 },
    Unknown,
}

impl Rate {
    /// For people.
    pub(super) fn text(self) -> String {
        match self {
            Self::Announced { period_ns } => format!("{} Hz", six_digits(1e9 / period_ns as f64)),
            Self::Measured { hz } => format!("about {} Hz, measured", hz.round()),
            Self::Unknown => "no frames while looking".into(),
        }
    }
}

impl Serialize for Rate {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let (rate_hz, rate_is_measured) = match *self {
            Self::Announced { period_ns } => (Some(1e9 / period_ns as f64), Some(false)),
            Self::Measured { hz } => (Some(hz), Some(true)),
            Self::Unknown => (None, None),
        };
        let mut fields = to.serialize_struct("Rate", 2)?;
        fields.serialize_field("rate_hz", &rate_hz)?;
        fields.serialize_field("rate_is_measured", &rate_is_measured)?;
        fields.end()
    }
}

impl ObservedService {
    /// Whether another machine sends it; `None` if that is not announced.
    pub(super) fn is_far(&self) -> Option<bool> {
        self.announced.as_ref().map(|announced| announced.clock() == SenderClock::Foreign)
    }

    /// The signals, if they are announced.
    pub(super) fn signals(&self) -> Option<&[SignalSpec]> {
        self.announced.as_ref().map(|announced| announced.layout.signals.as_slice())
    }
}

/// Looks at all services of frames, no longer than `stop` allows.
pub(super) fn look(
    participant: &Participant<Service>,
    stop: &Stop,
) -> Result<Vec<ObservedService>, Failure> {
    let services = participant.frame_services().map_err(Failure::found)?;
    let mut found = announced(participant, services, stop);
    take_frames(participant, &mut found, stop);
    Ok(found)
}

/// Learns what is announced of services that somebody writes.
fn announced(
    participant: &Participant<Service>,
    services: Vec<ListedService>,
    stop: &Stop,
) -> Vec<ObservedService> {
    let began = Instant::now();
    let watch = |service: &ListedService| {
        let is_written = !service.publishers.is_empty();
        is_written.then(|| noted(service, LayoutWatcher::open(participant, &service.name)))?
    };
    let mut watchers: Vec<_> = services.iter().map(watch).collect();
    let is_open = |watcher: &Option<LayoutWatcher<Service>>| {
        watcher.as_ref().is_some_and(|watcher| watcher.newest().is_none())
    };
    while watchers.iter().any(is_open) && began.elapsed() < ANSWER && !stop.is_due() {
        thread::sleep(LOOK_INTERVAL);
        for watcher in watchers.iter_mut().flatten() {
            watcher.look(participant);
        }
    }
    let found = services.into_iter().zip(&watchers).map(|(service, watcher)| {
        let announced = watcher.as_ref().and_then(LayoutWatcher::newest).cloned();
        let period_ns = announced.as_ref().and_then(|announced| announced.layout.period_ns);
        let rate = match period_ns.filter(|period_ns| *period_ns > 0) {
            Some(period_ns) => Rate::Announced { period_ns },
            None => Rate::Unknown,
        };
        ObservedService { service, announced, rate, flags: None }
    });
    found.collect()
}

/// The readers that could be opened; notes why others could not.
fn noted<T>(service: &ListedService, opened: Result<T, OpenError>) -> Option<T> {
    let note = |error: &OpenError| {
        terminal::note(&format!("note: what \"{}\" carries is not known: {error}", service.name));
    };
    opened.inspect_err(note).ok()
}

/// The first and the last frame that were received.
#[derive(Clone, Copy)]
struct Span {
    first: (u64, u64),
    last: (u64, u64),
}

/// Looks at frames: for their flags, and for the rates that nobody announces.
fn take_frames(participant: &Participant<Service>, found: &mut [ObservedService], stop: &Stop) {
    let open = |found: &ObservedService| {
        let subscriber =
            FrameSubscriber::open_existing(participant, &found.service.name, Depth::All);
        noted(&found.service, subscriber)?.map(|subscriber| (subscriber, None::<Span>))
    };
    let mut links: Vec<_> = found
        .iter_mut()
        .filter(|found| !found.service.publishers.is_empty())
        .filter_map(|found| open(found).map(|link| (found, link)))
        .collect();
    let began = Instant::now();
    let wants_more =
        |found: &ObservedService| found.flags.is_none() || matches!(found.rate, Rate::Unknown);
    while links.iter().any(|(found, _)| wants_more(found))
        && began.elapsed() < COUNTING
        && !stop.is_due()
    {
        for (found, (subscriber, span)) in &mut links {
            subscriber.maintain();
            while let Some(frame) = subscriber.next(Monotonic.now_ns()) {
                found.flags = Some(frame.header().flags());
                let seen = (frame.header().sequence, frame.header().publish_ns);
                span.get_or_insert(Span { first: seen, last: seen }).last = seen;
            }
        }
        thread::sleep(LOOK_INTERVAL);
    }
    for (found, (_, span)) in links {
        if let (Rate::Unknown, Some(hz)) = (found.rate, span.and_then(Span::hz)) {
            found.rate = Rate::Measured { hz };
        }
    }
}

impl Span {
    /// Frames per second; `None` where there was one at most.
    fn hz(self) -> Option<f64> {
        let frames = self.last.0.checked_sub(self.first.0).filter(|frames| *frames > 0)?;
        let span_ns = self.last.1.checked_sub(self.first.1).filter(|span_ns| *span_ns > 0)?;
        Some(frames as f64 * 1e9 / span_ns as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_that_of_the_writer_whatever_was_lost() {
        let span = Span { first: (10, 1_000_000_000), last: (60, 1_500_000_000) };
        assert_eq!(span.hz(), Some(100.0));
        assert_eq!(Span { last: span.first, ..span }.hz(), None);
        assert_eq!(Span { first: span.last, last: span.first }.hz(), None);
    }
}
