//! The frames of a service, as a subscriber process takes them.

use std::thread;
use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{InRealTime, Participant, SignalReader, ipc, longest_silence_ns};
use isochrone_processes::Stop;
use isochrone_runtime::Alarm;
use isochrone_timing::{LinkReport, WarningCode};

use super::measured::Measured;
use super::silence::Silence;
use super::transcript::{Frame, Transcript};
use super::unheard::{has_failures, obstacle};
use crate::failure::Failure;

/// While waiting for the service.
const SEARCH_INTERVAL: Duration = Duration::from_millis(5);
/// How often it is looked whether frames come, and from whom.
const CARE_INTERVAL_NS: u64 = 10_000_000;

type Service = ipc::Service;

/// The frames of a service, and the messages about them.
pub(super) struct Line<'a> {
    participant: &'a Participant<Service>,
    service: &'a str,
    reader: InRealTime<SignalReader<'a, Service>>,
    measured: Measured<'a>,
    opened_ns: u64,
    now_ns: u64,
    care_ns: u64,
}

impl<'a> Line<'a> {
    /// Waits for the service, after a message if it has to; `None` if it should stop before.
    pub(super) fn open(
        participant: &'a Participant<Service>,
        service: &'a str,
        stop: &Stop,
        say_waiting: impl FnOnce(),
    ) -> Result<Option<Self>, Failure> {
        let mut say_waiting = Some(say_waiting);
        let reader = loop {
            let found = SignalReader::open_existing(participant, service, &[]);
            match found.map_err(Failure::found)? {
                Some(reader) => break reader.for_this_thread(),
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
        let now_ns = Monotonic.now_ns();
        let measured = Measured::new(service, now_ns);
        let (opened_ns, care_ns) = (now_ns, now_ns);
        Ok(Some(Self { participant, service, reader, measured, opened_ns, now_ns, care_ns }))
    }

    /// Takes the next frame into the transcript; `false` if none waits.
    pub(super) fn receive(&mut self, transcript: &mut Transcript) -> Result<bool, Failure> {
        let Some(frame) = self.reader.next_frame() else {
            self.now_ns = Monotonic.now_ns();
            return Ok(false);
        };
        self.now_ns = frame.receipt().received_ns;
        take(&mut self.measured, &frame, transcript)
    }

    /// As [`receive`](Self::receive), of the frames that were received and wait for their layouts.
    pub(super) fn receive_waiting(&mut self, transcript: &mut Transcript) -> Result<bool, Failure> {
        let frame = self.reader.next_waiting();
        frame.map_or(Ok(false), |frame| take(&mut self.measured, &frame, transcript))
    }

    /// Whether frames were received that wait for their layouts.
    pub(super) fn is_waiting(&self) -> bool {
        self.reader.is_waiting()
    }

    /// Sleeps until the next frame is due, or something is to be looked after.
    pub(super) fn sleep(&mut self) {
        Monotonic.sleep_until_ns(self.reader.next_look_ns().min(self.care_ns));
        self.now_ns = Monotonic.now_ns();
    }

    /// How many frames were taken.
    pub(super) fn frames(&self) -> u64 {
        self.measured.frames()
    }

    /// Looks whether frames come, and from whom, if it is time; returns what is to be said of that.
    pub(super) fn care(&mut self) -> Option<String> {
        if self.now_ns < self.care_ns {
            return None;
        }
        self.care_ns = self.now_ns + CARE_INTERVAL_NS;
        let subscriber = self.reader.subscriber();
        if subscriber.counters().other_writers > 0
            && !self.measured.has_raised(&WarningCode::OtherWriter)
            && let Some(publishers) = self.participant.publishers_at_once(self.service)
        {
            self.measured
                .raise(Alarm::OtherWriter { service: self.service.to_owned(), publishers });
        }
        // What waits for its layout has come.
        if self.reader.is_waiting() {
            return None;
        }
        let period_ns = self.period_ns();
        self.measured.look_for_silence(self.now_ns, period_ns, || {
            // A killed publisher no longer counts.
            self.participant.clean_up();
            (subscriber.publishers(), subscriber.links())
        })
    }

    /// The silence that lasts.
    pub(super) fn silence(&self) -> Option<Silence> {
        self.measured.silence(self.now_ns)
    }

    /// The period that the publisher announces.
    fn period_ns(&self) -> Option<u64> {
        self.reader.announced().and_then(|announced| announced.layout.period_ns)
    }

    pub(super) fn alarms(&self) -> &[Alarm] {
        self.measured.alarms()
    }

    pub(super) fn report(&self) -> LinkReport {
        self.measured.report(&self.reader.subscriber().counters())
    }

    /// Nothing received is no success, whatever the reason. A publisher that has sent nothing for so many seconds, or
    /// for as long as makes a silence, has something wrong with it.
    pub(super) fn outcome(&self, patience_s: f64) -> Result<(), Failure> {
        let service = self.service;
        if self.measured.frames() > 0 {
            return Ok(());
        }
        // A killed publisher no longer counts.
        self.participant.clean_up();
        if self.reader.subscriber().publishers() == 0 {
            return Err(Failure::nobody(format!("service \"{service}\" has no publisher")));
        }
        if self.reader.subscriber().publishers() == self.reader.subscriber().links() {
            return Err(Failure::nobody(format!(
                "service \"{service}\" has no publisher on this machine, and nothing came through the link; see \
                 whether `isochrone link` says on both machines that it is connected, and whether the other \
                 one publishes the service"
            )));
        }
        let subscriber = self.reader.subscriber();
        let obstacle = obstacle(self.participant, service, subscriber);
        let patience_ns = longest_silence_ns(self.period_ns().unwrap_or_default());
        let patience_ns = patience_ns.max((patience_s * 1e9) as u64);
        let waited_ns = self.now_ns.saturating_sub(self.opened_ns);
        if obstacle.is_none() && !has_failures(subscriber) && waited_ns < patience_ns {
            return Err(Failure::nobody(format!("service \"{service}\" sent nothing")));
        }
        let why = obstacle.unwrap_or_else(|| {
            "the two could not connect, or it does not send; see that the file descriptors (ulimit -n) and the memory \
             of both suffice, and that both run as one user"
                .to_owned()
        });
        Err(Failure::found(format!(
            "service \"{service}\" has a publisher, but nothing of it arrived in {:.1} s: {why}",
            waited_ns as f64 / 1e9
        )))
    }
}

/// Takes a frame into the numbers and the transcript.
fn take(
    measured: &mut Measured<'_>,
    frame: &Frame<'_>,
    transcript: &mut Transcript,
) -> Result<bool, Failure> {
    let news = measured.take(frame);
    transcript.tell(news, measured.silence(frame.receipt().received_ns));
    transcript.write(frame, measured.frames()).map(|()| true)
}
