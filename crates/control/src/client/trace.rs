//! Every cycle of a node's signals, in any program.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::{Duration, Instant};

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{Depth, FrameSubscriber, Participant, Service, ipc};

use isochrone_timing::Progress;

use crate::{
    Client, ClientError, Code, Refusal, SignalDescription, TraceParams, TraceResult, TracedSignal,
};

/// A trace that is not renewed for 5 s ends.
const RENEWAL: Duration = Duration::from_secs(1);
/// How long the end of a trace waits for its answer: without it, the trace ends by itself.
const END_PATIENCE: Duration = Duration::from_millis(200);

/// A trace: every cycle of up to 64 signals of one task of a node, as rows.
///
/// The node copies the signals in the slack of each cycle. What it had no room for, and what came while the
/// reader did not look, is counted in [`TraceRow::lost`]: look every 10 ms or so, and
/// [renew](Self::renew) meanwhile. Dropping it ends it; one whose process dies ends by itself in 5 s.
///
/// ```no_run
/// use std::{cell::RefCell, rc::Rc, thread, time::Duration};
/// use isochrone_ipc::{Domain, Participant};
/// use isochrone_control::{Client, Trace};
///
/// let participant = Participant::join("scope", Domain::find()?)?;
/// let node = Client::connect(&participant, "level", Duration::from_secs(5))?;
/// let mut trace = Trace::open(&participant, &Rc::new(RefCell::new(node)), ["ramp.*"])?;
/// loop {
///     trace.renew()?;
///     while let Some(row) = trace.next_row() {
///         println!("{} {:?} (lost before: {})", row.cycle, row.values, row.lost);
///     }
///     thread::sleep(Duration::from_millis(5));
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Trace<S: Service = ipc::Service> {
    client: Rc<RefCell<Client<S>>>,
    frames: FrameSubscriber<S>,
    shape: TraceResult,
    renewed: Instant,
    /// The values of the row that was taken last.
    row: Vec<f64>,
    last: Option<Progress>,
}

/// One cycle of a trace.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct TraceRow<'a> {
    /// Its index on the task's grid, missed cycles included.
    pub cycle: u64,
    /// When it was due, ns of `CLOCK_MONOTONIC`.
    pub release_ns: u64,
    /// Cycles that did not run, since the start of the node.
    pub missed: u64,
    /// Cycles before it that ran and of which there is no row, since the row before it.
    pub lost: u64,
    /// The timing of the cycle, as [`Trace::timing`] names it.
    pub timing: &'a [f64],
    /// The signals after the cycle, in the order of [`Trace::signals`].
    pub values: &'a [f64],
}

impl<S: Service> Trace<S> {
    /// Traces signals, by names and globs; all of one task.
    ///
    /// # Errors
    /// A name is unknown, they are of more than one task or more than 64, the task is traced four times
    /// already, or the configuration is just being changed; otherwise as [`Client::call`].
    pub fn open<N: Into<String>>(
        participant: &Participant<S>,
        client: &Rc<RefCell<Client<S>>>,
        names: impl IntoIterator<Item = N>,
    ) -> Result<Self, ClientError> {
        let signals = Some(names.into_iter().map(Into::into).collect());
        let params = TraceParams { signals, ..TraceParams::default() };
        let begin = Instant::now();
        let (shape, frames) = loop {
            let shape = client.borrow_mut().call(&params)?;
            match FrameSubscriber::open_existing(participant, &shape.service, Depth::All) {
                Ok(Some(frames)) => break (shape, frames),
                // The node ended, or this process came so late that the trace did.
                Ok(None) if begin.elapsed() < client.borrow().patience() => end(client, &shape),
                Ok(None) => return Err(client.borrow().unanswered()),
                Err(error) => {
                    end(client, &shape);
                    return Err(error.into());
                }
            }
        };
        let client = Rc::clone(client);
        let mut trace =
            Self { client, frames, shape, renewed: Instant::now(), row: Vec::new(), last: None };
        trace.frames.set_period(trace.shape.period_ns);
        Ok(trace)
    }

    /// The service on which the rows come.
    pub fn service(&self) -> &str {
        &self.shape.service
    }

    /// The task.
    pub fn task(&self) -> &str {
        &self.shape.task
    }

    /// From release to release, ns.
    pub fn period_ns(&self) -> u64 {
        self.shape.period_ns
    }

    /// What [`TraceRow::timing`] has: `task.NAME.release_jitter_ns` and others, as telemetry names them.
    pub fn timing(&self) -> &[String] {
        &self.shape.timing
    }

    /// What [`TraceRow::values`] has.
    pub fn signals(&self) -> &[TracedSignal] {
        &self.shape.signals
    }

    /// Keeps the trace going; to be called at least every 4 s. Asks the node about once a second, and
    /// otherwise does nothing.
    ///
    /// # Errors
    /// The trace has ended, as [`ClientError::Refused`] says: a change of the configuration took one of its
    /// signals away, or it was not renewed: then it can [begin anew](Self::reopen). Or as [`Client::call`].
    pub fn renew(&mut self) -> Result<(), ClientError> {
        if self.renewed.elapsed() < RENEWAL {
            return Ok(());
        }
        let id = Some(self.shape.id.clone());
        self.client.borrow_mut().call(&TraceParams { id, ..TraceParams::default() })?;
        self.renewed = Instant::now();
        Ok(())
    }

    /// Begins anew after it has ended, as when this process or the node was stopped for some seconds: the same
    /// signals, of the same run of the node. The cycles since the last row are counted as lost or missed in the next
    /// one. Rows that wait are dropped: take them before.
    ///
    /// # Errors
    /// As [`open`](Self::open), or the signals are of another task, period or type now. Then it is as before.
    pub fn reopen(&mut self, participant: &Participant<S>) -> Result<(), ClientError> {
        let names = self.shape.signals.iter().map(|signal| signal.name.clone());
        let mut new = Self::open(participant, &self.client, names)?;
        let what = |shape: &TraceResult| {
            (shape.task.clone(), shape.period_ns, shape.timing.clone(), shape.signals.clone())
        };
        if what(&new.shape) != what(&self.shape) {
            let message = "the configuration was changed meanwhile: the signals of the trace are of another \
                           task, period or type now; ask for a new one";
            return Err(ClientError::Refused(Refusal::new(Code::Conflict, message)));
        }
        new.last = self.last;
        *self = new;
        Ok(())
    }

    /// The next row; `None` when none waits.
    pub fn next_row(&mut self) -> Option<TraceRow<'_>> {
        let channels = self.shape.timing.len() + self.shape.signals.len();
        let place = loop {
            let frame = self.frames.next(Monotonic.now_ns())?;
            if frame.values().len() == channels {
                self.row.clear();
                self.row.extend_from_slice(frame.values());
                break *frame.header();
            }
        };
        let now = Progress { cycle: place.cycle, missed: place.missed };
        let lost = self.last.replace(now).map_or(0, |last| now.lost_since(Some(last)));
        let (timing, values) = self.row.split_at_checked(self.shape.timing.len())?;
        let (cycle, release_ns, missed) = (place.cycle, place.release_ns, place.missed);
        Some(TraceRow { cycle, release_ns, missed, lost, timing, values })
    }

    /// Connects to the node's port where that failed at first; about every 100 ms, before the rows are
    /// looked for.
    pub fn maintain(&mut self) {
        self.frames.maintain();
    }

    /// Whether the node does not publish it any more: it was ended, or the node has. Rows may still wait.
    pub fn has_ended(&self) -> bool {
        self.frames.publishers() == 0
    }
}

impl<S: Service> Drop for Trace<S> {
    fn drop(&mut self) {
        if !self.has_ended() {
            end(&self.client, &self.shape);
        }
    }
}

/// Ends a trace. Nobody is told if that fails: then it ends by itself.
fn end<S: Service>(client: &Rc<RefCell<Client<S>>>, shape: &TraceResult) {
    // Whoever asks at this moment holds on to it.
    let Ok(mut client) = client.try_borrow_mut() else { return };
    let params = TraceParams { signals: None, id: Some(shape.id.clone()), end: Some(true) };
    let _ = client.call_within(END_PATIENCE, &params);
}

/// The signals of names and globs, each once, by task: a trace is of one. Tasks and signals come in the order in
/// which they are named.
///
/// # Errors
/// A name, or a glob, is of no signal; otherwise as [`Client::call`].
pub fn signals_by_task<S: Service>(
    client: &mut Client<S>,
    names: &[&str],
) -> Result<Vec<(String, Vec<SignalDescription>)>, ClientError> {
    let mut tasks: Vec<(String, Vec<SignalDescription>)> = Vec::new();
    let mut findings = Vec::new();
    for name in names {
        let signals = match client.signals(Some(name)) {
            Err(ClientError::Refused(failure)) if failure.code == Code::UnknownName => {
                findings.extend(failure.findings);
                continue;
            }
            signals => signals?,
        };
        for signal in signals {
            let index = tasks.iter().position(|(task, _)| *task == signal.task);
            let index = index.unwrap_or_else(|| {
                tasks.push((signal.task.clone(), Vec::new()));
                tasks.len() - 1
            });
            let Some((_, of_task)) = tasks.get_mut(index) else { continue };
            if !of_task.iter().any(|known| known.name == signal.name) {
                of_task.push(signal);
            }
        }
    }
    if findings.is_empty() {
        return Ok(tasks);
    }
    Err(ClientError::Refused(Refusal::of(Code::UnknownName, findings)))
}
