//! What the supervisors of two twins tell each other: the standby how far it has come, the holder that it knows.

use std::sync::Arc;
use std::time::{Duration, Instant};

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{
    Depth, FramePublisher, FrameSubscriber, OpenError, Participant, Service, Stamp,
};

use super::twin::Twin;

/// Name of the service of the standby's reports, below that of the states.
pub(super) const ACK: &str = "ack";
/// Name of the service of what operators did, below that of the states.
pub(super) const DESK: &str = "desk";
/// How often the standby reports at least.
const REPORT_EVERY: Duration = Duration::from_millis(10);
/// A standby that has not reported for so long is gone.
const GONE_AFTER: Duration = Duration::from_millis(100);
/// How often it is looked whether the holder lives that has sent no state yet.
const LOOK_EVERY: Duration = Duration::from_millis(50);
/// Words of a report before the cycles: the term of the holder, and the number of the newest message about the desk.
const WORDS_BEFORE: usize = 2;

/// The name of a service between the twins of a node: of the state of a task, or of their messages.
pub(crate) fn service_name(node: &str, name: &str) -> String {
    format!("isochrone/{node}/state/{name}")
}

/// The supervisor's part of the connection to the twin.
pub(crate) struct Relay<S: Service> {
    twin: Arc<Twin>,
    reports: FramePublisher<S>,
    heard: FrameSubscriber<S>,
    /// When this process reported last.
    reported: Option<Instant>,
    /// What the standby said last, and when.
    standby: Option<(Instant, Report)>,
    /// Since when the standby is gone that there was.
    gone: Option<Instant>,
    looked: Instant,
    /// The process that was followed at the start.
    holder: Option<u32>,
}

/// What a standby says.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Report {
    /// The number of the newest message about the desk that it has.
    pub(crate) desk: u64,
    /// For each task the cycle after the one whose state it has.
    pub(crate) next_cycles: Vec<u64>,
}

impl<S: Service> Relay<S> {
    /// Opens the services of a node with so many tasks.
    pub(crate) fn open(
        participant: &Participant<S>,
        node: &str,
        twin: Arc<Twin>,
    ) -> Result<Self, OpenError> {
        let words = WORDS_BEFORE + twin.next_cycles().count();
        let service = service_name(node, ACK);
        let reports =
            FramePublisher::open_between_twins(participant, &service, words, twin.configuration)?;
        let heard = FrameSubscriber::open(participant, &service, words, Depth::Newest)?;
        let holder = twin.seat().other_process();
        let (reported, standby, gone) = (None, None, None);
        Ok(Self { twin, reports, heard, reported, standby, gone, looked: Instant::now(), holder })
    }

    /// The term with which this process holds the node; `None`: the other one does.
    pub(crate) fn term(&self) -> Option<u64> {
        self.twin.term()
    }

    /// Whether this process holds the node.
    pub(crate) fn holds(&self) -> bool {
        self.twin.holds()
    }

    /// Reports to the holder, or listens to the standby.
    pub(crate) fn tend(&mut self) {
        let now = Instant::now();
        self.heard.maintain();
        match self.twin.term() {
            Some(term) => self.listen(term, now),
            None => self.report(now),
        }
    }

    fn listen(&mut self, term: u64, now: Instant) {
        while let Some(frame) = self.heard.newest(Monotonic.now_ns()) {
            let words = frame.values();
            let word = |index: usize| words.get(index).map_or(0, |word| word.to_bits());
            if frame.header().layout != self.twin.configuration || word(0) != term {
                continue;
            }
            let next_cycles = words.iter().skip(WORDS_BEFORE).map(|word| word.to_bits());
            let report = Report { desk: word(1), next_cycles: next_cycles.collect() };
            if self.standby.is_none() {
                tracing::info!("a standby follows");
            }
            (self.standby, self.gone) = (Some((now, report)), None);
        }
        let is_gone = |(heard, _): &(Instant, Report)| now.duration_since(*heard) > GONE_AFTER;
        if self.standby.as_ref().is_some_and(is_gone) {
            (self.standby, self.gone) = (None, Some(now));
            tracing::warn!("the standby is gone: it has not reported for 100 ms");
        }
        self.twin.set_wanted(self.standby.is_some());
    }

    fn report(&mut self, now: Instant) {
        (self.standby, self.gone) = (None, None);
        self.twin.set_wanted(false);
        if self.reported.is_some_and(|reported| now.duration_since(reported) < REPORT_EVERY) {
            return;
        }
        self.reported = Some(now);
        let term = self.twin.seat().page().term();
        self.reports.go_on(term, self.reports.next_sequence());
        self.reports.prepare();
        if let Some(words) = self.reports.values_mut() {
            let report = [term, 0].into_iter().chain(self.twin.next_cycles());
            words.iter_mut().zip(report).for_each(|(word, value)| *word = f64::from_bits(value));
            self.reports.send(Stamp::default(), || Monotonic.now_ns());
        }
        if now.duration_since(self.looked) >= LOOK_EVERY {
            self.looked = now;
            self.look_for_holder();
        }
    }

    /// Gives the node up whose holder died before there was a state of each task.
    fn look_for_holder(&self) {
        let seat = self.twin.seat();
        let is_another = seat.other_process() != self.holder;
        if !self.twin.is_complete(seat.page().term()) && (is_another || !seat.has_twin()) {
            self.twin.orphan();
        }
    }
}
