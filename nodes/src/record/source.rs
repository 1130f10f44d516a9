//! A service that is recorded.

use std::collections::HashMap;

use isochrone_ipc::ipc::Service;
use isochrone_ipc::{
    LayoutKey, OpenError, Participant, Receipt, SignalFrame, SignalReader, Stamps,
    SubscriberCounters,
};
use isochrone_recording::{Carried, Frame, Mark};
use isochrone_runtime::Limiter;
use isochrone_timing::units::counted;

use super::left_out::LeftOut;
use super::output::{Broken, FileChannel, Output};
use crate::subscribe::{carried, channels, has_failures, obstacle};
use crate::terminal;

/// Most layouts of one service that are kept in mind. A writer with more has them described again.
const MOST_LAYOUTS: usize = 64;

/// The frames of a service, and what was written of them.
pub(super) struct Source<'p> {
    reader: SignalReader<'p, Service>,
    written: RecordedService,
}

/// The state of a service's recording.
struct RecordedService {
    service: String,
    places: HashMap<LayoutKey, FileChannel>,
    shown: Option<LayoutKey>,
    limiter: Limiter,
    layouts: u64,
}

impl<'p> Source<'p> {
    /// Opens a service; `None` if it does not exist.
    pub(super) fn open(
        participant: &'p Participant<Service>,
        service: &str,
    ) -> Result<Option<Self>, OpenError> {
        let opened = SignalReader::open_existing(participant, service, &[])?;
        let written = RecordedService {
            service: service.to_owned(),
            places: HashMap::new(),
            shown: None,
            limiter: Limiter::default(),
            layouts: 0,
        };
        Ok(opened.map(|reader| Self { reader, written }))
    }

    /// Writes up to this many frames; whether there may be more.
    pub(super) fn write(&mut self, most: usize, output: &mut Output) -> Result<bool, Broken> {
        self.written.say_what_was_held();
        for _ in 0..most {
            let Some(frame) = self.reader.next_frame() else { return Ok(false) };
            self.written.write(&frame, output)?;
        }
        Ok(true)
    }

    /// Writes the frames that were received and have waited for their layouts.
    pub(super) fn write_waiting(&mut self, output: &mut Output) -> Result<(), Broken> {
        while let Some(frame) = self.reader.next_waiting() {
            self.written.write(&frame, output)?;
        }
        Ok(())
    }

    /// Whether frames wait for their layout.
    pub(super) fn is_waiting(&self) -> bool {
        self.reader.is_waiting()
    }

    /// When to look for frames again.
    pub(super) fn next_look_ns(&mut self) -> u64 {
        self.reader.next_look_ns()
    }

    pub(super) fn service(&self) -> &str {
        self.reader.service()
    }

    pub(super) fn counters(&self) -> SubscriberCounters {
        self.reader.subscriber().counters()
    }

    /// Frames that were received.
    pub(super) fn frames(&self) -> u64 {
        self.counters().received
    }

    /// That a publisher is there of which no frame came, and why. One that nobody named, and that nothing is in the way
    /// of, may send later.
    pub(super) fn unheard(
        &self,
        participant: &Participant<Service>,
        is_named: bool,
    ) -> Option<LeftOut> {
        let subscriber = self.reader.subscriber();
        if subscriber.publishers() == subscriber.links() {
            return None;
        }
        let obstacle = obstacle(participant, self.service(), subscriber);
        let is_absent = obstacle.is_none() && !has_failures(subscriber);
        if is_absent && !is_named {
            return None;
        }
        let why =
            obstacle.unwrap_or_else(|| "it has a publisher, but no frame of it came".to_owned());
        Some(LeftOut { service: self.service().to_owned(), why, is_absent })
    }

    /// How many layouts its frames had.
    pub(super) fn layouts(&self) -> u64 {
        self.written.layouts
    }
}

impl RecordedService {
    fn say_what_was_held(&mut self) {
        if let Some(news) = self.limiter.held() {
            terminal::note(&news.to_string());
        }
    }

    fn write(
        &mut self,
        frame: &SignalFrame<'_, Service>,
        output: &mut Output,
    ) -> Result<(), Broken> {
        let receipt = frame.receipt();
        let Receipt { header, received_ns, lost, restarts, stamps, .. } = receipt;
        output.split()?;
        let text = "the publisher was restarted or replaced";
        self.mark(&receipt, Mark::RESTART, restarts, text, output)?;
        if lost > 0 {
            let text =
                format!("lost {} before sequence {}", counted(lost, "frame"), header.sequence);
            self.mark(&receipt, Mark::LOST, lost, &text, output)?;
        }
        let place = self.place(frame, output)?;
        let sent_ns = match stamps {
            Stamps::Believed => header.publish_ns,
            Stamps::Future | Stamps::Foreign => received_ns,
        };
        let (values, due_ns) = (frame.channels(), receipt.due_ns());
        output.write(place, &Frame { header, values, received_ns, due_ns, sent_ns, lost })
    }

    fn mark(
        &self,
        before: &Receipt,
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
    fn place(
        &mut self,
        frame: &SignalFrame<'_, Service>,
        output: &mut Output,
    ) -> Result<FileChannel, Broken> {
        let layout = frame.layout();
        let known = self.places.get(&layout).copied();
        if self.shown == Some(layout)
            && let Some(place) = known.filter(|place| output.has(*place))
        {
            return Ok(place);
        }
        let before = self.shown.replace(layout);
        if before != Some(layout) {
            let what = carried(frame, &channels(frame));
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
        let announced = frame.announced();
        let mut signals =
            announced.map_or_else(Vec::new, |announced| announced.layout.signals.clone());
        signals.resize_with(layout.channels, Default::default);
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
