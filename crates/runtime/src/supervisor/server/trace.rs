//! `trace`: traces for clients: opened, renewed, and ended when they are not renewed.

use std::time::{Duration, Instant};

use isochrone_control::desk::{Selection, Signal, Signals};
use isochrone_ipc::{FrameLayout, SignalSpec};

use crate::task::timing_channels;
use crate::task::traces::{MAX_TRACED, MAX_TRACES, Traced};
use isochrone_control::{
    Begun, CallResult, Caller, Code, Finding, Handle, Refusal, Reply, Ticket, TraceParams,
    TraceResult, TracedSignal,
};

use super::ControlServer;
use super::open_traces::{State, Trace};
use super::trace_ports::{OpenedTrace, Opening};

/// How long a trace goes on without being renewed.
const LEASE: Duration = Duration::from_secs(5);

impl Handle<TraceParams> for ControlServer {
    fn handle(
        &mut self,
        params: TraceParams,
        caller: Caller,
    ) -> Result<Begun<TraceResult>, Refusal> {
        let end = params.end.unwrap_or_default();
        match (params.signals, params.id) {
            (Some(names), None) if !end => {
                self.check_names("signals", &names)?;
                self.open_trace(&names, caller.process)
            }
            (None, Some(id)) => self.go_on_or_end(&id, end),
            _ => {
                let help = "give either the \"signals\" of a new trace, or the \"id\" of one that is to go on \
                            or, with \"end\", to end";
                let finding =
                    Finding::new("signals", "it is not clear which trace is meant").with_help(help);
                Err(Refusal::of(Code::InvalidParams, vec![finding]))
            }
        }
    }
}

impl ControlServer {
    fn go_on_or_end(&mut self, id: &str, end: bool) -> Result<Begun<TraceResult>, Refusal> {
        let is_its =
            |trace: &&mut Trace| trace.result.id == id && matches!(trace.state, State::Running);
        let Some(trace) = self.tracing.traces.iter_mut().find(is_its) else {
            return Err(self.tracing.unknown(id));
        };
        trace.renewed = Instant::now();
        if end {
            trace.state = State::Ending("its client ended it");
            let mut operating = self.shared.lock();
            if let Some(lane) = operating.lanes.get_mut(trace.task) {
                lane.orders.end_trace(trace.number);
            }
        }
        Ok(Begun::Ended(trace.result.clone()))
    }

    /// Requests the service of a trace to be opened.
    fn open_trace(
        &mut self,
        names: &[String],
        process: Option<u32>,
    ) -> Result<Begun<TraceResult>, Refusal> {
        let (mut operating, selection) = self.shared.search(|signals| {
            Selection::of(signals, names.iter().map(String::as_str), 0, MAX_TRACED + 1)
        })?;
        let task = one_task(&selection, operating.operator.signals())?;
        if operating.operator.changing().is_some() {
            return Err(changing());
        }
        let unit = |signal: &Signal<'_>| operating.operator.unit(signal).to_owned();
        let signals = selection.signals().map(|signal| spec(unit(&signal), signal));
        let signals = Vec::from_iter(signals);
        let Some(lane) = operating.lanes.get_mut(task) else { return Err(changing()) };
        if lane.traces.len() >= MAX_TRACES {
            return Err(too_many(&lane.name, &lane.traces));
        }
        self.tracing.last += 1;
        let number = self.tracing.last;
        let id = format!("{:08x}-{number}", self.tracing.run);
        let service = format!("isochrone/{}/trace/{id}", self.node);
        let period_ns = lane.schedule.period_ns;
        let timing = Vec::from_iter(timing_channels::names(&lane.name, &lane.schedule));
        let channels = timing.iter().map(|name| SignalSpec::new(name, "LREAL"));
        let opening = Opening {
            number,
            service: service.clone(),
            node: self.node.clone(),
            layout: FrameLayout {
                signals: channels.chain(signals.iter().cloned()).collect(),
                period_ns: Some(period_ns),
            },
            period_ns,
            slots: selection.signals().map(|signal| signal.slot).collect(),
        };
        let result = TraceResult {
            id,
            service,
            task: lane.name.clone(),
            period_ns,
            timing,
            signals: signals.iter().map(traced).collect(),
        };
        // From now on it counts as one of the traces, and follows a change of the configuration.
        lane.traces.push(Traced { number, signals, process });
        drop(operating);
        // A thread that panicked never answers, which the client has to be told.
        let _ = self.tracing.jobs.send(opening);
        let ticket = self.ticket();
        let (renewed, state) = (Instant::now(), State::Opening(ticket, selection));
        self.tracing.traces.push(Trace { number, task, result, renewed, state });
        Ok(Begun::Later(ticket))
    }

    /// Starts traces whose services are open, ends those that were not renewed, and forgets those that have ended.
    pub(super) fn tend_traces(&mut self) {
        while let Ok(opened) = self.tracing.opened.try_recv() {
            let begun = self.begin_trace(opened);
            self.ended.extend(begun);
        }
        if self.tracing.traces.is_empty() {
            return;
        }
        let mut operating = self.shared.lock();
        for trace in &mut self.tracing.traces {
            if matches!(trace.state, State::Running) && trace.renewed.elapsed() > LEASE {
                trace.state = State::Ending("it was not renewed for 5 s");
                let lane = operating.lanes.get_mut(trace.task);
                lane.into_iter().for_each(|lane| lane.orders.end_trace(trace.number));
            }
        }
        let is_gone = |trace: &mut Trace| {
            let lane = operating.lanes.get(trace.task);
            !lane.is_some_and(|lane| lane.traces.iter().any(|one| one.number == trace.number))
        };
        let gone = Vec::from_iter(self.tracing.traces.extract_if(.., is_gone));
        drop(operating);
        for Trace { state, result, .. } in gone {
            let why = match state {
                State::Ending(why) => why,
                State::Opening(..) | State::Running => {
                    "a change of the configuration took away one of its signals"
                }
            };
            self.tracing.note_end(result.id, why);
        }
    }

    /// Sends a trace whose service is open to its task.
    fn begin_trace(&mut self, opened: OpenedTrace) -> Option<(Ticket, CallResult)> {
        let OpenedTrace { number, tracer } = opened;
        let index = self.tracing.traces.iter().position(|trace| trace.number == number)?;
        let trace = self.tracing.traces.get_mut(index)?;
        let State::Opening(ticket, selection) = std::mem::replace(&mut trace.state, State::Running)
        else {
            return None;
        };
        let mut operating = self.shared.lock();
        let is_same = selection.is_of(operating.operator.signals())
            && operating.operator.changing().is_none();
        let lane = operating.lanes.get_mut(trace.task)?;
        let outcome = match tracer {
            Ok(tracer) if is_same => {
                lane.orders.begin_trace(tracer);
                trace.renewed = Instant::now();
                return Some((ticket, Ok(Reply::Trace(trace.result.clone()))));
            }
            Ok(_) => Err(changing()),
            Err(error) => {
                Err(Refusal::new(Code::Internal, format!("the trace has no service: {error}")))
            }
        };
        lane.traces.retain(|one| one.number != number);
        drop(operating);
        self.tracing.traces.remove(index);
        Some((ticket, outcome))
    }
}

fn spec(unit: String, signal: Signal<'_>) -> SignalSpec {
    let Signal { name, value_type, .. } = signal;
    SignalSpec { name, value_type: value_type.to_string(), unit }
}

fn traced(signal: &SignalSpec) -> TracedSignal {
    let SignalSpec { name, value_type, unit } = signal.clone();
    TracedSignal { name, value_type, unit: Some(unit).filter(|unit| !unit.is_empty()) }
}

/// The task that all the signals are of.
fn one_task(selection: &Selection, signals: &Signals) -> Result<usize, Refusal> {
    let refused = |message: String, help: String| {
        let finding = Finding::new("signals", message).with_help(help);
        Err(Refusal::of(Code::InvalidParams, vec![finding]))
    };
    let total = selection.total();
    if total > MAX_TRACED {
        let help =
            format!("a trace has at most {MAX_TRACED}: name fewer, or ask for several traces");
        return refused(format!("these are {total} signals"), help);
    }
    let mut named = selection.signals();
    let Some(first) = named.next() else { return Ok(0) };
    let Some(other) = named.find(|signal| signal.task != first.task) else { return Ok(first.task) };
    let of = |signal: &Signal<'_>| {
        format!("{} is of task \"{}\"", signal.name, signals.task_name(signal.task))
    };
    refused(format!("{} and {}", of(&first), of(&other)), "ask for a trace of each task".to_owned())
}

fn too_many(task: &str, traces: &[Traced]) -> Refusal {
    let mut processes: Vec<String> = Vec::new();
    for process in traces.iter().filter_map(|trace| trace.process) {
        let process = format!("process {process}");
        if !processes.contains(&process) {
            processes.push(process);
        }
    }
    let by =
        if processes.is_empty() { String::new() } else { format!(", by {}", processes.join(", ")) };
    let message = format!(
        "task \"{task}\" is traced {MAX_TRACES} times already{by}; end one of them, or ask again in 5 s if \
         its client is gone"
    );
    Refusal::new(Code::Busy, message)
}

fn changing() -> Refusal {
    Refusal::new(
        Code::Busy,
        "the configuration is being changed; ask again when every task has the new one",
    )
}
