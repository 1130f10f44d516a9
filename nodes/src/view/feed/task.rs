//! The trace of a task, and how one takes the place of another without a gap.

use std::cell::RefCell;
use std::rc::Rc;
use std::thread;
use std::time::{Duration, Instant};

use isochrone_control::{Client, ClientError, Trace, TraceRow};
use isochrone_ipc::{Participant, ipc};

use crate::operate::{Purpose, refusal};
use crate::view::shared::View;
use crate::view::threads::locked;

/// Most signals that a trace has.
pub(super) const MAX_TRACED: usize = 64;
/// Between two attempts after one that failed.
pub(super) const RETRY_INTERVAL: Duration = Duration::from_secs(1);
/// How long the first row of another trace is waited for before the trace of before is left.
const OVERLAP: Duration = Duration::from_millis(30);

/// The signals of a task to trace.
pub(super) struct TraceSelection {
    /// As many signals as a trace has, or fewer.
    pub(super) names: Vec<String>,
    /// Those for which there is no room.
    pub(super) left_out: Vec<String>,
}

/// A task whose cycles are taken in.
#[derive(Default)]
pub(super) struct Task {
    pub(super) trace: Option<Trace>,
    pub(super) names: Vec<String>,
    /// Cycle and missed cycles of its last row.
    last: Option<(u64, u64)>,
    retry: Option<Instant>,
    /// Why there is no trace.
    pub(super) refused: Option<String>,
    /// Signals for which there is no room.
    pub(super) left_out: Vec<String>,
}

impl Task {
    /// Ends the trace.
    pub(super) fn end(&mut self, name: &str, view: &View) {
        self.trace = None;
        self.names.clear();
        // Another run of the node counts its cycles anew.
        self.last = None;
        locked(&view.curves).interrupt(name);
        locked(&view.jitter).set_traced(name, false);
    }

    /// Traces these signals.
    pub(super) fn follow(
        &mut self,
        name: &str,
        TraceSelection { names: wanted, left_out }: TraceSelection,
        participant: &Participant<ipc::Service>,
        client: &Rc<RefCell<Client>>,
        view: &View,
    ) -> Result<(), ClientError> {
        self.left_out = left_out;
        let is_same = wanted.len() == self.names.len()
            && wanted.iter().all(|signal| self.names.contains(signal));
        let waits = self.retry.is_some_and(|retry| Instant::now() < retry);
        if waits || (is_same && self.trace.is_some()) {
            return Ok(());
        }
        let open = || Trace::open(participant, client, wanted.clone());
        let opened = match open() {
            // The place that it has is the one that it needs.
            Err(ClientError::Refused(_)) if self.trace.is_some() => {
                self.end(name, view);
                open()
            }
            opened => opened,
        };
        match opened {
            Ok(trace) => {
                self.turn_to(trace, name, wanted, view);
                (self.refused, self.retry) = (None, None);
            }
            Err(ClientError::Refused(failure)) => {
                self.refused = Some(refusal(&failure, Purpose::Look));
                self.names = wanted;
                self.retry = Some(Instant::now() + RETRY_INTERVAL);
            }
            Err(error) => return Err(error),
        }
        Ok(())
    }

    /// Changes to another trace at the cycle with which that begins.
    fn turn_to(&mut self, mut new: Trace, name: &str, wanted: Vec<String>, view: &View) {
        let begin = Instant::now();
        let mut first = None;
        while first.is_none() && begin.elapsed() < OVERLAP && self.trace.is_some() {
            self.take_rows(name, view);
            thread::sleep(Duration::from_millis(1));
            new.maintain();
            first = new.next_row().map(|row| Row::of(&row));
        }
        self.take_rows(name, view);
        let signals = new.signals().iter().map(|signal| signal.name.clone()).collect();
        locked(&view.curves).set_signals(name, signals);
        locked(&view.jitter).set_traced(name, true);
        self.names = wanted;
        let place = jitter_place(&new);
        self.trace = Some(new);
        if let Some(row) = first {
            let timing = place.and_then(|place| row.timing.get(place)).copied();
            self.take(name, (row.cycle, row.missed, row.release_ns), &row.values, timing, view);
        }
    }

    /// Takes in the rows that wait.
    pub(super) fn take_rows(&mut self, name: &str, view: &View) {
        let Some(mut trace) = self.trace.take() else { return };
        let place = jitter_place(&trace);
        while let Some(row) = trace.next_row() {
            view.silence.end();
            let jitter = place.and_then(|place| row.timing.get(place)).copied();
            self.take(name, (row.cycle, row.missed, row.release_ns), row.values, jitter, view);
        }
        self.trace = Some(trace);
    }

    fn take(
        &mut self,
        name: &str,
        (cycle, missed, release_ns): (u64, u64, u64),
        values: &[f64],
        jitter_ns: Option<f64>,
        view: &View,
    ) {
        if let Some((last, missed_before)) = self.last {
            if cycle <= last {
                return;
            }
            let new_missed = missed.saturating_sub(missed_before);
            if cycle - last - 1 > new_missed {
                locked(&view.curves).interrupt(name);
            }
            if new_missed > 0 {
                locked(&view.curves).miss(name);
            }
        }
        self.last = Some((cycle, missed));
        locked(&view.curves).add(name, release_ns, values);
        if let Some(ns) = jitter_ns.filter(|ns| *ns >= 0.0) {
            locked(&view.jitter).add(name, cycle, ns as u64);
        }
    }
}

/// Where the jitter stands in the timing of a row.
fn jitter_place(trace: &Trace) -> Option<usize> {
    trace.timing().iter().position(|channel| channel.ends_with(".release_jitter_ns"))
}

/// A row that is kept.
struct Row {
    cycle: u64,
    missed: u64,
    release_ns: u64,
    timing: Vec<f64>,
    values: Vec<f64>,
}

impl Row {
    fn of(row: &TraceRow<'_>) -> Self {
        let TraceRow { cycle, missed, release_ns, .. } = *row;
        Self { cycle, missed, release_ns, timing: row.timing.to_vec(), values: row.values.to_vec() }
    }
}
