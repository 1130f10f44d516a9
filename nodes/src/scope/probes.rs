//! The traces of a node, from which the rows come.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::{Duration, Instant};

use isochrone_control::{Client, ClientError, Code, Trace};
use isochrone_ipc::{Participant, ipc};
use isochrone_scope::{Capture, Head, ObservedTask, TrackSignal, Trigger, TriggerSearch};
use isochrone_timing::units::counted;

use super::wanted::ScopeSelection;
use crate::numbers::six_digits;

/// Between two tries to connect to a port where that failed.
const CARE_INTERVAL: Duration = Duration::from_millis(100);
/// How long a renewal waits for its answer: no row is read and no key meanwhile.
const ANSWER: Duration = Duration::from_millis(500);
/// The same for a new trace, which the node has to open a service for.
const OPENING: Duration = Duration::from_secs(5);
/// Between two tries after one that failed.
const RETRY_INTERVAL: Duration = Duration::from_millis(500);
/// A node that does not answer for this long is reported.
const SILENCE: Duration = Duration::from_secs(2);

/// A trace for each task.
pub(super) struct Probes<'a> {
    participant: &'a Participant<ipc::Service>,
    client: Rc<RefCell<Client>>,
    probes: Vec<Probe>,
    cared: Instant,
    /// When the node is asked again after it did not do what it was asked for.
    retry: Instant,
    /// Since when it does not answer.
    silent: Option<Instant>,
    /// Why it has no room for a new trace.
    refused: Option<String>,
}

struct Probe {
    trace: Trace,
    /// The count in the row before.
    missed: Option<u64>,
    has_ended: bool,
}

impl<'a> Probes<'a> {
    /// Begins to trace.
    pub(super) fn open(
        participant: &'a Participant<ipc::Service>,
        client: &Rc<RefCell<Client>>,
        wanted: &ScopeSelection,
    ) -> Result<Self, ClientError> {
        let open = |task| {
            let trace = Trace::open(participant, client, wanted.traced(task))?;
            Ok(Probe { trace, missed: None, has_ended: false })
        };
        let probes = (0..wanted.tasks.len()).map(open).collect::<Result<_, ClientError>>()?;
        let (client, now, silent, refused) = (client.clone(), Instant::now(), None, None);
        Ok(Self { participant, client, probes, cared: now, retry: now, silent, refused })
    }

    /// What there is to see, in the order of the tasks.
    pub(super) fn observed(&self, wanted: &ScopeSelection) -> Vec<ObservedTask> {
        let each = self.probes.iter().zip(&wanted.tasks);
        each.map(|(Probe { trace, .. }, (task, shown))| {
            let signals = trace.signals().iter().take(shown.len()).map(|signal| TrackSignal {
                name: signal.name.clone(),
                unit: signal.unit.clone().unwrap_or_default(),
                value_type: signal.value_type.clone(),
            });
            let (task, period_ns) = (task.clone(), Some(trace.period_ns()));
            ObservedTask { task, period_ns, signals: signals.collect() }
        })
        .collect()
    }

    /// Keeps the traces going. Those that have ended [begin anew](Self::reopen), after their rows were taken.
    pub(super) fn care(&mut self) -> Result<(), ClientError> {
        let is_due = self.cared.elapsed() >= CARE_INTERVAL;
        if is_due {
            self.cared = Instant::now();
        }
        let mut cared = Ok(());
        self.client.borrow_mut().wait_for(ANSWER);
        for probe in &mut self.probes {
            if is_due {
                probe.trace.maintain();
            }
            probe.has_ended |= probe.trace.has_ended();
            if cared.is_ok() && !probe.has_ended && Instant::now() >= self.retry {
                match probe.trace.renew() {
                    Err(ClientError::Refused(_)) => probe.has_ended = true,
                    renewed => cared = renewed,
                }
            }
        }
        self.outcome(cared)
    }

    /// Begins those traces anew that have ended: the node stood still for longer than it keeps a trace, or this
    /// process did.
    pub(super) fn reopen(&mut self) -> Result<(), ClientError> {
        if Instant::now() < self.retry || !self.probes.iter().any(|probe| probe.has_ended) {
            return Ok(());
        }
        self.client.borrow_mut().wait_for(OPENING);
        let participant = self.participant;
        let reopened =
            self.probes.iter_mut().filter(|probe| probe.has_ended).try_for_each(|probe| {
                probe.trace.reopen(participant)?;
                probe.has_ended = false;
                Ok(())
            });
        self.outcome(reopened)
    }

    /// Continues if the node does not answer, or has no room at the moment.
    fn outcome(&mut self, asked: Result<(), ClientError>) -> Result<(), ClientError> {
        let now = Instant::now();
        match asked {
            // It may not have been asked at all.
            Ok(()) if now < self.retry => return Ok(()),
            Ok(()) if self.probes.iter().any(|probe| probe.has_ended) => self.silent = None,
            Ok(()) => (self.silent, self.refused) = (None, None),
            Err(ClientError::NoAnswer { .. }) => {
                self.silent.get_or_insert(now);
                self.retry = now + RETRY_INTERVAL;
            }
            // Too late is it for a node that is ending, which says no more the next time.
            Err(ClientError::Refused(why)) if matches!(why.code, Code::Busy | Code::TooLate) => {
                self.refused = Some(why.message);
                self.retry = now + RETRY_INTERVAL;
            }
            Err(error) => return Err(error),
        }
        Ok(())
    }

    /// Why no rows come at the moment.
    pub(super) fn trouble(&self) -> Option<String> {
        let node = self.client.borrow().node().to_owned();
        match (&self.silent, &self.refused) {
            (Some(since), _) if since.elapsed() >= SILENCE => {
                Some(format!("node \"{node}\" does not answer; waiting for it"))
            }
            (None, Some(why)) => Some(format!("node \"{node}\": {why}; trying again")),
            _ => None,
        }
    }

    /// Takes the rows that wait, until it is enough.
    pub(super) fn take(&mut self, mut is_enough: impl FnMut(usize, Head, &[f64]) -> bool) {
        for (track, probe) in self.probes.iter_mut().enumerate() {
            while let Some(row) = probe.trace.next_row() {
                let before = probe.missed.replace(row.missed).unwrap_or(row.missed);
                let head = Head {
                    cycle: row.cycle,
                    release_ns: row.release_ns,
                    lost: row.lost,
                    missed: row.missed.saturating_sub(before),
                };
                if is_enough(track, head, row.values) {
                    return;
                }
            }
        }
    }
}

/// The behaviour of a trigger's signal meanwhile.
pub(super) fn not_fired(trigger: &Trigger, capture: &Capture) -> String {
    let signal = &trigger.signal;
    let TriggerSearch { cycles: looked, lost, seen } = capture.looked();
    let lost = if lost > 0 { format!(", and {lost} more were lost") } else { String::new() };
    let cycles = format!("{}{lost}", counted(looked, "cycle"));
    match seen {
        _ if looked == 0 => format!("no cycle with {signal} came"),
        None => format!("{signal} was no finite number in any of {cycles}"),
        Some(seen) if seen.low == seen.high => {
            format!("{signal} was {} in {cycles}", six_digits(seen.low))
        }
        Some(seen) => {
            let (low, high) = (six_digits(seen.low), six_digits(seen.high));
            format!("{signal} was from {low} to {high} in {cycles}")
        }
    }
}
