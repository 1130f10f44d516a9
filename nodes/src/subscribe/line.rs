//! The frames of a service, as a subscriber process takes them.

use std::collections::{BTreeMap, VecDeque};
use std::thread;
use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{
    Depth, Flags, FrameHeader, FrameSubscriber, InRealTime, LayoutWatcher, Participant, Stamps,
    ipc, longest_silence_ns,
};
use isochrone_processes::Stop;
use isochrone_runtime::{Alarm, FrameWait};
use isochrone_timing::{FrameRecord, LinkReport, LinkTiming, WarningCode};

use super::silence::{Listener, Silence};
use super::taken::{self, Taken};
use super::transcript::Transcript;
use crate::failure::Failure;

/// While waiting for the service.
const SEARCH_INTERVAL: Duration = Duration::from_millis(5);
/// How often layouts, peers and connections are looked after.
const CARE_INTERVAL_NS: u64 = 10_000_000;
/// A frame that is older than any wait here by so much has a stamp of another clock.
const CREDIBLE_DELAY_NS: u64 = 1_000_000_000;

type Service = ipc::Service;

/// The frames of a service, and all that is to be said of them.
pub(super) struct Line<'a> {
    participant: &'a Participant<Service>,
    service: &'a str,
    subscriber: InRealTime<FrameSubscriber<Service>>,
    pub(super) watcher: LayoutWatcher<Service>,
    timing: LinkTiming,
    /// Frames of which it is not known yet whose clock they are stamped by.
    undated: VecDeque<Undated>,
    past_stamps: u64,
    flagged: Flagged,
    listener: Listener,
    /// That frames have ceased, or come again, until somebody takes it.
    pub(super) news: Option<String>,
    pub(super) alarms: Vec<Alarm>,
    opened_ns: u64,
    pub(super) now_ns: u64,
    /// When nothing waited to be received.
    idle_ns: u64,
    care_ns: u64,
}

/// A frame that was received, before its stamps are judged.
struct Undated {
    header: FrameHeader,
    received_ns: u64,
    /// How long it may have waited to be received.
    waited_ns: u64,
}

/// How many frames had each flag.
struct Flagged([u64; u64::BITS as usize]);

impl Flagged {
    fn note(&mut self, flags: Flags) {
        let mut bits = flags.bits();
        while bits != 0 {
            self.0[bits.trailing_zeros() as usize] += 1;
            bits &= bits - 1;
        }
    }

    fn by_word(&self) -> BTreeMap<String, u64> {
        let counted = self.0.iter().enumerate().filter(|(_, frames)| **frames > 0);
        counted.map(|(bit, frames)| (Flags::from_bits(1 << bit).to_string(), *frames)).collect()
    }
}

impl<'a> Line<'a> {
    /// Waits for the service; `None` if it is to stop before. If it has to wait, it says so first.
    pub(super) fn open(
        participant: &'a Participant<Service>,
        service: &'a str,
        stop: &Stop,
        say_waiting: impl FnOnce(),
    ) -> Result<Option<Self>, Failure> {
        let mut say_waiting = Some(say_waiting);
        let subscriber = loop {
            let found = FrameSubscriber::open_existing(participant, service, Depth::All);
            match found.map_err(Failure::found)? {
                Some(subscriber) => break subscriber.for_this_thread(),
                None => {
                    if let Some(say) = say_waiting.take() {
                        say();
                    }
                    if stop.is_due() {
                        return Ok(None);
                    }
                    thread::sleep(SEARCH_INTERVAL);
                }
            }
        };
        let watcher = LayoutWatcher::open(participant, service).map_err(Failure::found)?;
        let now_ns = Monotonic.now_ns();
        Ok(Some(Self {
            participant,
            service,
            subscriber,
            watcher,
            timing: LinkTiming::new(),
            undated: VecDeque::new(),
            past_stamps: 0,
            flagged: Flagged([0; u64::BITS as usize]),
            listener: Listener::new(now_ns),
            news: None,
            alarms: Vec::new(),
            opened_ns: now_ns,
            now_ns,
            idle_ns: now_ns,
            care_ns: now_ns,
        }))
    }

    /// Receives the next frame; `false` if none waits.
    pub(super) fn receive(&mut self, transcript: &mut Transcript) -> bool {
        let number = self.frames() + 1;
        let Some(frame) = self.subscriber.next(self.now_ns) else {
            self.now_ns = Monotonic.now_ns();
            self.idle_ns = self.now_ns;
            return false;
        };
        let received_ns = Monotonic.now_ns();
        let header = *frame.header();
        // It may be written only when its layout is known.
        let channels = frame.values().len();
        let is_wanted = transcript.wants_values(number);
        let values = if is_wanted { frame.values().to_vec() } else { Vec::new() };
        self.now_ns = received_ns;
        self.flagged.note(header.flags());
        if let Some(after_ns) = self.listener.hear(&header, received_ns) {
            let (service, after_s) = (self.service, after_ns as f64 / 1e9);
            self.news = Some(format!("\"{service}\" sends again, after {after_s:.1} s"));
        }
        let waited_ns = received_ns.saturating_sub(self.idle_ns);
        self.undated.push_back(Undated { header, received_ns, waited_ns });
        self.date();
        let stamps = taken::stamps(&self.watcher, &header, received_ns);
        transcript.take(Taken { header, channels, values, received_ns, stamps, number });
        true
    }

    /// Sleeps until the next frame is due, or something is to be looked after.
    pub(super) fn sleep(&mut self, wait: &FrameWait) {
        let now_ns = Monotonic.now_ns();
        wait.sleep_until_ns(self.subscriber.next_look_ns(now_ns).min(self.care_ns));
        self.now_ns = Monotonic.now_ns();
    }

    /// How many frames were received.
    pub(super) fn frames(&self) -> u64 {
        self.timing.frames() + self.undated.len() as u64
    }

    /// Measures the frames of which it is known whose clock they are stamped by. Through a link from another
    /// machine that may come after the first of them.
    fn date(&mut self) {
        while let Some(first) = self.undated.front() {
            let Undated { header, received_ns, .. } = first;
            let waited_ns = self.now_ns.saturating_sub(*received_ns);
            let waiting = self.undated.len();
            if !taken::is_settled(&self.watcher, header.layout, waited_ns, waiting) {
                break;
            }
            let Some(frame) = self.undated.pop_front() else { break };
            self.measure(&frame);
        }
    }

    /// Measures the frames of which it will not be known any more.
    pub(super) fn date_rest(&mut self) {
        while let Some(frame) = self.undated.pop_front() {
            self.measure(&frame);
        }
    }

    fn measure(&mut self, frame: &Undated) {
        match self.judge(frame) {
            Stamps::Foreign => self.timing.count(frame.received_ns),
            Stamps::Believed | Stamps::Future => self.timing.record(&FrameRecord {
                publish_ns: frame.header.publish_ns,
                source_ns: frame.header.source_ns,
                received_ns: frame.received_ns,
            }),
        }
    }

    /// Looks after layouts, peers and connections, if it is time.
    pub(super) fn care(&mut self) {
        if self.now_ns < self.care_ns {
            return;
        }
        self.care_ns = self.now_ns + CARE_INTERVAL_NS;
        self.participant.tend();
        self.subscriber.maintain();
        if self.watcher.look(self.participant)
            && let Some(announced) = self.watcher.newest()
        {
            self.subscriber.set_period(announced.layout.period_ns.unwrap_or_default());
        }
        self.date();
        let (participant, subscriber) = (self.participant, &self.subscriber);
        let ceased = self.listener.look(self.now_ns, self.period_ns(), || {
            // One that was killed is no publisher any more.
            participant.clean_up();
            (subscriber.publishers(), subscriber.links())
        });
        if let Some(ceased) = ceased {
            self.news = Some(format!("\"{}\" {ceased}", self.service));
        }
        if self.subscriber.counters().other_writers > 0
            && !self.has_raised(&WarningCode::OtherWriter)
            && let Some(publishers) = self.participant.publishers_at_once(self.service)
        {
            self.raise(Alarm::OtherWriter { service: self.service.to_owned(), publishers });
        }
    }

    /// The silence that lasts.
    pub(super) fn silence(&self) -> Option<Silence> {
        self.listener.silence(self.now_ns)
    }

    /// The period that the publisher announces.
    fn period_ns(&self) -> Option<u64> {
        self.watcher.newest().and_then(|announced| announced.layout.period_ns)
    }

    /// Says what the stamps of a frame are worth.
    fn judge(&mut self, frame: &Undated) -> Stamps {
        let Undated { header, received_ns, waited_ns } = frame;
        let announced = self.watcher.find(header.layout);
        let stamps = taken::stamps(&self.watcher, header, *received_ns);
        let age_ns = received_ns.saturating_sub(header.publish_ns);
        match stamps {
            Stamps::Future => {
                let ahead_ns = header.publish_ns.saturating_sub(*received_ns);
                let service = self.service.to_owned();
                self.raise(Alarm::FutureStamps { service, ahead_ns });
            }
            Stamps::Foreign => {
                let publisher = announced.map_or_else(String::new, |a| a.publisher.clone());
                let service = self.service.to_owned();
                self.raise(Alarm::ForeignHost { service, publisher });
            }
            Stamps::Believed if age_ns > waited_ns.saturating_add(CREDIBLE_DELAY_NS) => {
                self.past_stamps += 1;
                let service = self.service.to_owned();
                self.raise(Alarm::PastStamps { service, behind_ns: age_ns });
            }
            Stamps::Believed => {}
        }
        stamps
    }

    /// Raises an alarm, the first of its kind.
    fn raise(&mut self, alarm: Alarm) {
        if !self.has_raised(&alarm.code()) {
            tracing::warn!("{}", alarm.sentence());
            self.alarms.push(alarm);
        }
    }

    fn has_raised(&self, code: &WarningCode) -> bool {
        self.alarms.iter().any(|raised| raised.code() == *code)
    }

    pub(super) fn report(&self) -> LinkReport {
        let counters = self.subscriber.counters();
        LinkReport {
            lost: counters.lost,
            restarts: Some(counters.restarts),
            other_writers: Some(counters.other_writers),
            past_stamps: Some(self.past_stamps),
            flagged: self.flagged.by_word(),
            ..self.timing.report(self.service)
        }
    }

    /// Nothing received is no success, whatever the reason. A publisher that has sent nothing for so many seconds, or
    /// for as long as makes a silence, has something wrong with it.
    pub(super) fn outcome(&self, patience_s: f64) -> Result<(), Failure> {
        let service = self.service;
        if self.frames() > 0 {
            return Ok(());
        }
        // One that was killed is no publisher any more.
        self.participant.clean_up();
        if self.subscriber.publishers() == 0 {
            return Err(Failure::nobody(format!("service \"{service}\" has no publisher")));
        }
        if self.subscriber.publishers() == self.subscriber.links() {
            return Err(Failure::nobody(format!(
                "service \"{service}\" has no publisher on this machine, and nothing came through the link; see \
                 whether `isochrone link` says on both machines that it is connected, and whether the other \
                 one publishes the service"
            )));
        }
        let counters = self.subscriber.counters();
        let patience_ns = longest_silence_ns(self.period_ns().unwrap_or_default());
        let patience_ns = patience_ns.max((patience_s * 1e9) as u64);
        let waited_ns = self.now_ns.saturating_sub(self.opened_ns);
        if counters.connect_errors + counters.receive_errors == 0 && waited_ns < patience_ns {
            return Err(Failure::nobody(format!("service \"{service}\" sent nothing")));
        }
        Err(Failure::found(format!(
            "service \"{service}\" has a publisher, but nothing of it arrived in {:.1} s: the two could not connect, or it does not send; see that the file descriptors (ulimit -n) and the memory of both suffice, and that both run as one user",
            waited_ns as f64 / 1e9
        )))
    }
}
