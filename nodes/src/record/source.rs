//! A service that is recorded.

use std::collections::{HashMap, VecDeque};

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{
    Depth, FrameSubscriber, LayoutWatcher, OpenError, Participant, Stamps, SubscriberCounters,
};
use isochrone_recording::{Carried, Frame, Mark};
use isochrone_runtime::Limiter;
use isochrone_timing::units::counted;

use super::Service;
use super::output::{Broken, Output, Place};
use crate::subscribe::{Taken, channels_of, is_settled, listed, stamps, unnamed};
use crate::terminal;

/// Most layouts of one service that are kept in mind. A writer with more has them described again.
const MOST_LAYOUTS: usize = 64;

/// The frames of a service, and what was written of them.
pub(super) struct Source {
    pub(super) service: String,
    subscriber: FrameSubscriber<Service>,
    watcher: LayoutWatcher<Service>,
    /// Frames whose layout is not known yet.
    waiting: VecDeque<Waiting>,
    /// As they were with the frame before.
    before: SubscriberCounters,
    places: HashMap<Layout, Place>,
    shown: Option<Layout>,
    limiter: Limiter,
    now_ns: u64,
    pub(super) frames: u64,
    pub(super) layouts: u64,
}

/// A frame, and what happened before it.
struct Waiting {
    taken: Taken,
    lost: u64,
    restarts: u64,
}

/// What tells channels apart.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Layout {
    number: u64,
    is_announced: bool,
    channels: usize,
}

impl Source {
    /// Opens a service; `None` if it does not exist.
    pub(super) fn open(
        participant: &Participant<Service>,
        service: &str,
    ) -> Result<Option<Self>, OpenError> {
        let opened = FrameSubscriber::open_existing(participant, service, Depth::All)?;
        let Some(subscriber) = opened else { return Ok(None) };
        let watcher = LayoutWatcher::open(participant, service)?;
        Ok(Some(Self {
            service: service.to_owned(),
            subscriber,
            watcher,
            waiting: VecDeque::new(),
            before: SubscriberCounters::default(),
            places: HashMap::new(),
            shown: None,
            limiter: Limiter::default(),
            now_ns: Monotonic.now_ns(),
            frames: 0,
            layouts: 0,
        }))
    }

    /// Takes up to so many frames; returns whether there may be more.
    pub(super) fn take(&mut self, most: usize) -> bool {
        for _ in 0..most {
            let Some(frame) = self.subscriber.next(self.now_ns) else {
                self.now_ns = Monotonic.now_ns();
                return false;
            };
            let received_ns = Monotonic.now_ns();
            let header = *frame.header();
            let values = frame.values().to_vec();
            self.now_ns = received_ns;
            let counters = self.subscriber.counters();
            let lost = counters.lost - self.before.lost;
            let restarts = counters.restarts - self.before.restarts;
            self.before = counters;
            self.frames += 1;
            let (channels, number, stamps) = (values.len(), self.frames, Stamps::Believed);
            let taken = Taken { header, channels, values, received_ns, stamps, number };
            self.waiting.push_back(Waiting { taken, lost, restarts });
        }
        true
    }

    /// Writes the frames that need wait no longer.
    pub(super) fn write(&mut self, output: &mut Output) -> Result<(), Broken> {
        while let Some(Waiting { taken, .. }) = self.waiting.front() {
            let waited_ns = self.now_ns.saturating_sub(taken.received_ns);
            let waiting = self.waiting.len();
            if !is_settled(&self.watcher, taken.header.layout, waited_ns, waiting) {
                break;
            }
            let Some(frame) = self.waiting.pop_front() else { break };
            self.write_frame(frame, output)?;
        }
        if let Some(news) = self.limiter.held() {
            terminal::note(&news.to_string());
        }
        Ok(())
    }

    /// Whether frames wait for their layout.
    pub(super) fn is_waiting(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Looks after layouts, peers and connections.
    pub(super) fn care(&mut self, participant: &Participant<Service>) {
        self.now_ns = Monotonic.now_ns();
        self.subscriber.maintain();
        if self.watcher.look(participant)
            && let Some(announced) = self.watcher.newest()
        {
            self.subscriber.set_period(announced.layout.period_ns.unwrap_or_default());
        }
    }

    /// When to look for frames again.
    pub(super) fn next_look_ns(&mut self, now_ns: u64) -> u64 {
        self.subscriber.next_look_ns(now_ns)
    }

    pub(super) fn counters(&self) -> SubscriberCounters {
        self.subscriber.counters()
    }

    fn write_frame(&mut self, frame: Waiting, output: &mut Output) -> Result<(), Broken> {
        let Waiting { mut taken, lost, restarts } = frame;
        taken.stamps = stamps(&self.watcher, &taken.header, taken.received_ns);
        output.split()?;
        self.mark(
            &taken,
            Mark::RESTART,
            restarts,
            "the publisher was restarted or replaced",
            output,
        )?;
        if lost > 0 {
            let text =
                format!("{} before sequence {}", counted(lost, "frame"), taken.header.sequence);
            self.mark(&taken, Mark::LOST, lost, &format!("lost {text}"), output)?;
        }
        let place = self.place(&taken, output)?;
        let sent_ns = match taken.stamps {
            Stamps::Believed => taken.header.publish_ns,
            Stamps::Future | Stamps::Foreign => taken.received_ns,
        };
        let Taken { header, values, received_ns, .. } = &taken;
        let (header, received_ns, due_ns) = (*header, *received_ns, taken.due_ns());
        output.write(place, &Frame { header, values, received_ns, due_ns, sent_ns, lost })
    }

    fn mark(
        &self,
        before: &Taken,
        kind: &str,
        count: u64,
        text: &str,
        output: &mut Output,
    ) -> Result<(), Broken> {
        if count == 0 {
            return Ok(());
        }
        output.mark(&Mark {
            time_ns: before.received_ns,
            cycle: before.header.cycle,
            count,
            kind: kind.to_owned(),
            service: self.service.clone(),
            text: text.to_owned(),
        })
    }

    /// Where a frame of this layout goes.
    fn place(&mut self, taken: &Taken, output: &mut Output) -> Result<Place, Broken> {
        let announced = self.watcher.find(taken.header.layout);
        let (number, channels) = (taken.header.layout, taken.channels);
        let layout = Layout { number, is_announced: announced.is_some(), channels };
        let known = self.places.get(&layout).copied();
        if self.shown == Some(layout)
            && let Some(place) = known.filter(|place| output.has(*place))
        {
            return Ok(place);
        }
        let signals = announced.map_or(&[][..], |announced| &announced.layout.signals);
        let before = self.shown.replace(layout);
        if before != Some(layout) {
            let all = channels_of(signals, channels);
            let what = match announced {
                Some(announced) => format!("{} (from \"{}\")", listed(&all), announced.publisher),
                None => unnamed(channels, number, &self.watcher),
            };
            let news = match before {
                None => format!("recording \"{}\": {what}", self.service),
                Some(_) => format!("\"{}\" has changed, and now carries {what}", self.service),
            };
            if let Some(news) = self.limiter.pass(news) {
                terminal::note(&news.to_string());
            }
        }
        if let Some(place) = known.filter(|place| output.has(*place)) {
            return Ok(place);
        }
        let mut signals = signals.to_vec();
        signals.resize_with(channels, Default::default);
        let carried = Carried {
            service: self.service.clone(),
            publisher: announced.map_or_else(String::new, |announced| announced.publisher.clone()),
            period_ns: announced.and_then(|announced| announced.layout.period_ns),
            signals,
        };
        let place = output.place(&carried)?;
        if known.is_none() {
            self.layouts += 1;
        }
        if self.places.len() == MOST_LAYOUTS {
            self.places.clear();
        }
        self.places.insert(layout, place);
        Ok(place)
    }
}
