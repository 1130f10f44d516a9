//! What the supervisors of two twins tell each other: the holder what operators did, the standby how far it has come.

use std::sync::Arc;
use std::time::{Duration, Instant};

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{
    Depth, FramePublisher, FrameSubscriber, OpenError, Participant, Service, Stamp,
};

use super::message::{self, Incoming};
use super::twin::{Standby, Twin};
use crate::node::operating::Shared;

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
/// When a message about the desk is sent again that the standby does not have.
const AGAIN_AFTER: Duration = Duration::from_millis(20);
/// Words of a report before the cycles: the term of the holder, the process, whether it has the state of each task, and
/// the entry of the journal after the last one that it has.
const WORDS_BEFORE: usize = 4;

/// The name of a service between the twins of a node: of the state of a task, or of their messages.
pub(crate) fn service_name(node: &str, name: &str) -> String {
    format!("isochrone/{node}/state/{name}")
}

/// What a standby must have that is heard again: until then, this process did things that nobody waited for.
#[derive(Debug, Default)]
struct Required {
    /// For each task a cycle that had not begun.
    cycles: Vec<u64>,
    /// The last entry of the journal.
    sequence: u64,
}

impl Required {
    fn is_met_by(&self, standby: &Standby) -> bool {
        let mut cycles = self.cycles.iter().zip(&standby.next_cycles);
        standby.desk > self.sequence && cycles.all(|(cycle, next)| next > cycle)
    }
}

/// The supervisor's part of the connection to the twin.
pub(crate) struct Relay<S: Service> {
    twin: Arc<Twin>,
    reports: FramePublisher<S>,
    heard: FrameSubscriber<S>,
    desk: FramePublisher<S>,
    desk_heard: FrameSubscriber<S>,
    incoming: Incoming,
    /// What the desk had as it was sent last, and when.
    sent: Option<(Vec<u8>, Instant)>,
    /// The entry of the journal after the last one that this desk has of the holder's; 0: it has nothing of it.
    has: u64,
    reported: Instant,
    /// When the standby was heard last.
    heard_at: Option<Instant>,
    /// What it must have to take over.
    required: Required,
    looked: Instant,
    /// The process that is followed.
    holder: Option<u32>,
}

impl<S: Service> Relay<S> {
    /// Opens the services of a node.
    pub(crate) fn open(
        participant: &Participant<S>,
        node: &str,
        twin: Arc<Twin>,
    ) -> Result<Self, OpenError> {
        let ends = |name: &str, words: usize, depth: Depth| {
            let (service, number) = (service_name(node, name), twin.configuration());
            let sends = FramePublisher::open_between_twins(participant, &service, words, number)?;
            Ok::<_, OpenError>((sends, FrameSubscriber::open(participant, &service, words, depth)?))
        };
        let words = WORDS_BEFORE + twin.next_cycles().count();
        let (reports, heard) = ends(ACK, words, Depth::Newest)?;
        let (desk, desk_heard) = ends(DESK, message::WORDS, Depth::All)?;
        let (holder, now) = (twin.seat().other_process(), Instant::now());
        let (incoming, sent, has, heard_at) = (Incoming::default(), None, 0, None);
        let (reported, looked) = (now, now);
        Ok(Self {
            twin,
            reports,
            heard,
            desk,
            desk_heard,
            incoming,
            sent,
            has,
            reported,
            heard_at,
            required: Required::default(),
            looked,
            holder,
        })
    }

    /// The term with which this process holds the node; `None`: the other one does.
    pub(crate) fn term(&self) -> Option<u64> {
        self.twin.term()
    }

    /// Whether this process holds the node.
    pub(crate) fn holds(&self) -> bool {
        self.twin.holds()
    }

    /// Reports to the holder and takes over what its desk has, or listens to the standby and tells it. `is_thorough`:
    /// also looks for what no operator did.
    pub(crate) fn tend(&mut self, shared: &Shared, is_thorough: bool) {
        let now = Instant::now();
        self.heard.maintain();
        self.desk_heard.maintain();
        match self.twin.term() {
            Some(term) => {
                self.holder = None;
                self.listen(term, now, shared);
                self.tell(term, now, shared, is_thorough);
            }
            None => {
                (self.sent, self.heard_at) = (None, None);
                self.take_desk(shared);
                self.report(now);
            }
        }
    }

    fn listen(&mut self, term: u64, now: Instant, shared: &Shared) {
        let mut standby = None;
        while let Some(frame) = self.heard.newest(Monotonic.now_ns()) {
            let words = frame.values();
            let word = |index: usize| words.get(index).map_or(0, |word| word.to_bits());
            if frame.header().layout != self.twin.configuration() || word(0) != term {
                continue;
            }
            let next_cycles = words.iter().skip(WORDS_BEFORE).map(|word| word.to_bits());
            let (process, desk) = (u32::try_from(word(1)).unwrap_or(0), word(3));
            let is_complete = word(2) == 1;
            standby =
                Some(Standby { process, is_complete, desk, next_cycles: next_cycles.collect() });
        }
        let page = self.twin.seat().page();
        if let Some(mut standby) = standby {
            if self.heard_at.replace(now).is_none() {
                tracing::info!("process {} stands by", standby.process);
                let mut operating = shared.lock();
                operating.standby_gone = None;
                let cycles = operating.next_cycles(Monotonic.now_ns());
                self.required = Required { cycles, sequence: operating.operator.last_sequence() };
            }
            if standby.is_complete && self.required.is_met_by(&standby) {
                page.open_to_standby(term);
            }
            standby.is_complete &= page.is_open(term);
            self.twin.set_standby(Some(standby));
        } else if self.heard_at.is_some_and(|heard| now.duration_since(heard) > GONE_AFTER) {
            // It would go on from an old state, without what is acknowledged from now on.
            page.close_to_standby(term);
            self.heard_at = None;
            self.twin.set_standby(None);
            let mut operating = shared.lock();
            operating.standby_gone = Some(operating.last_cycle());
            drop(operating);
            tracing::warn!("the standby is gone: it has not reported for 100 ms");
        }
    }

    /// Sends what the desk has, if the standby does not have it.
    fn tell(&mut self, term: u64, now: Instant, shared: &Shared, is_thorough: bool) {
        let Some(standby) = self.twin.standby() else { return };
        let operating = shared.lock();
        let is_behind = standby.desk <= operating.operator.last_sequence();
        let is_due = self.sent.as_ref().is_none_or(|(_, at)| now.duration_since(*at) > AGAIN_AFTER);
        let has_alarms = is_thorough && !operating.process_alarms.records().is_empty();
        if !(has_alarms || is_behind && is_due) {
            return;
        }
        let copy = operating.desk_copy();
        drop(operating);
        let is_new = self.sent.as_ref().is_none_or(|(sent, _)| *sent != copy);
        if !(is_new || is_behind && is_due) {
            return;
        }
        self.desk.go_on(term, self.desk.next_sequence());
        self.desk.renumber(self.twin.configuration());
        message::send(&mut self.desk, &copy);
        self.sent = Some((copy, now));
    }

    /// Takes over what the holder's desk has.
    fn take_desk(&mut self, shared: &Shared) {
        let term = self.twin.seat().page().term();
        while let Some(frame) = self.desk_heard.next(Monotonic.now_ns()) {
            // What this process sent while it was the holder comes to itself, too.
            let header = frame.header();
            if header.layout != self.twin.configuration() || header.term != term {
                continue;
            }
            if let Some(bytes) = self.incoming.take(frame.values()) {
                let next: Vec<u64> = self.twin.next_cycles().collect();
                if let Some(sequence) = shared.lock().adopt_desk(&bytes, &next) {
                    self.has = sequence.saturating_add(1);
                }
            }
        }
    }

    fn report(&mut self, now: Instant) {
        self.twin.set_standby(None);
        if now.duration_since(self.reported) < REPORT_EVERY {
            return;
        }
        self.reported = now;
        let term = self.twin.seat().page().term();
        let is_complete = self.twin.is_complete(term) && self.has > 0;
        self.reports.go_on(term, self.reports.next_sequence());
        self.reports.renumber(self.twin.configuration());
        self.reports.prepare();
        if let Some(words) = self.reports.values_mut() {
            let before = [term, u64::from(std::process::id()), u64::from(is_complete), self.has];
            let report = before.into_iter().chain(self.twin.next_cycles());
            words.iter_mut().zip(report).for_each(|(word, value)| *word = f64::from_bits(value));
            self.reports.send(Stamp::default(), || Monotonic.now_ns());
        }
        if now.duration_since(self.looked) >= LOOK_EVERY {
            self.looked = now;
            self.look_for_holder();
        }
    }

    /// Gives the node up whose holder died before there was a state of each task.
    fn look_for_holder(&mut self) {
        let seat = self.twin.seat();
        let term = seat.page().term();
        let holder = *self.holder.get_or_insert_with(|| seat.other_process().unwrap_or(0));
        let is_another = seat.other_process() != Some(holder);
        if !self.twin.can_take_over(term) && (is_another || !seat.has_twin()) {
            self.twin.orphan(term);
        }
    }
}
