//! The measurements of a subscriber.

use std::collections::BTreeMap;

use isochrone_ipc::{Flags, Stamps, SubscriberCounters};
use isochrone_runtime::Alarm;
use isochrone_timing::{FrameRecord, LinkReport, LinkTiming, WarningCode};

use super::silence::{Listener, Silence};
use super::transcript::Frame;

/// A frame that is older than any wait here by so much has a stamp of another clock.
const CREDIBLE_DELAY_NS: u64 = 1_000_000_000;

/// The measurements of a service.
pub(super) struct Measured<'a> {
    service: &'a str,
    timing: LinkTiming,
    past_stamps: u64,
    flagged: Flagged,
    listener: Listener,
    /// The first of each kind.
    alarms: Vec<Alarm>,
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

impl<'a> Measured<'a> {
    pub(super) fn new(service: &'a str, now_ns: u64) -> Self {
        Self {
            service,
            timing: LinkTiming::new(),
            past_stamps: 0,
            flagged: Flagged([0; u64::BITS as usize]),
            listener: Listener::new(now_ns),
            alarms: Vec::new(),
        }
    }

    /// Takes a frame in; returns a message if it ends a silence.
    pub(super) fn take(&mut self, frame: &Frame<'_>) -> Option<String> {
        let (header, receipt) = (frame.header(), frame.receipt());
        self.flagged.note(frame.flags());
        match receipt.stamps {
            Stamps::Foreign => self.timing.count(receipt.received_ns),
            Stamps::Believed | Stamps::Future => self.timing.record(&FrameRecord {
                publish_ns: header.publish_ns,
                source_ns: header.source_ns,
                received_ns: receipt.received_ns,
            }),
        }
        self.judge(frame);
        let after_ns = self.listener.hear(header, receipt.received_ns)?;
        Some(format!("\"{}\" sends again, after {:.1} s", self.service, after_ns as f64 / 1e9))
    }

    /// Raises an alarm if the stamps of a frame are of another clock.
    fn judge(&mut self, frame: &Frame<'_>) {
        let (publish_ns, receipt) = (frame.header().publish_ns, frame.receipt());
        let service = self.service.to_owned();
        let age_ns = receipt.received_ns.saturating_sub(publish_ns);
        match receipt.stamps {
            Stamps::Future => {
                let ahead_ns = publish_ns.saturating_sub(receipt.received_ns);
                self.raise(Alarm::FutureStamps { service, ahead_ns });
            }
            Stamps::Foreign => {
                let publisher = frame.announced().map_or_else(String::new, |a| a.publisher.clone());
                self.raise(Alarm::ForeignHost { service, publisher });
            }
            Stamps::Believed if age_ns > receipt.waited_ns.saturating_add(CREDIBLE_DELAY_NS) => {
                self.past_stamps += 1;
                self.raise(Alarm::PastStamps { service, behind_ns: age_ns });
            }
            Stamps::Believed => {}
        }
    }

    /// Raises an alarm, the first of its kind.
    pub(super) fn raise(&mut self, alarm: Alarm) {
        if !self.has_raised(&alarm.code()) {
            tracing::warn!("{}", alarm.sentence());
            self.alarms.push(alarm);
        }
    }

    pub(super) fn has_raised(&self, code: &WarningCode) -> bool {
        self.alarms.iter().any(|raised| raised.code() == *code)
    }

    pub(super) fn alarms(&self) -> &[Alarm] {
        &self.alarms
    }

    /// How many frames were taken.
    pub(super) fn frames(&self) -> u64 {
        self.timing.frames()
    }

    /// Looks whether frames have ceased; returns what is to be said when they just have. `publishers` counts those who
    /// publish the service, and those of them that are links.
    pub(super) fn look_for_silence(
        &mut self,
        now_ns: u64,
        period_ns: Option<u64>,
        publishers: impl FnOnce() -> (usize, usize),
    ) -> Option<String> {
        let ceased = self.listener.look(now_ns, period_ns, publishers)?;
        Some(format!("\"{}\" {ceased}", self.service))
    }

    /// The silence that lasts.
    pub(super) fn silence(&self, now_ns: u64) -> Option<Silence> {
        self.listener.silence(now_ns)
    }

    pub(super) fn report(&self, counters: &SubscriberCounters) -> LinkReport {
        LinkReport {
            lost: counters.lost,
            restarts: Some(counters.restarts),
            other_writers: Some(counters.other_writers),
            past_stamps: Some(self.past_stamps),
            flagged: self.flagged.by_word(),
            ..self.timing.report(self.service)
        }
    }
}
