//! The traces of a node, from which the rows come.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::{Duration, Instant};

use isochrone_ipc::{Participant, ipc};
use isochrone_runtime::control::{Client, ClientError, Trace, signals_by_task};
use isochrone_scope::{Capture, Edge, Head, Looked, Observed, Signal, Trigger};
use isochrone_timing::units::counted;

use super::chosen::{MOST, check_count, edge};
use crate::failure::Failure;
use crate::numbers::six_digits;
use crate::operate::{Asked, failure};

/// Between two tries to connect to a port where that failed.
const CARE_INTERVAL: Duration = Duration::from_millis(100);

/// What is wanted of a node.
pub(super) struct Wanted {
    /// The tasks with the signals that are shown.
    pub(super) tasks: Vec<(String, Vec<String>)>,
    trigger: Option<Of>,
}

/// The signal of a trigger.
struct Of {
    task: usize,
    name: String,
    edge: Edge,
}

impl Wanted {
    /// Finds the signals of names and globs, and that of the trigger, which alone is shown without any
    /// names.
    pub(super) fn find(
        client: &mut Client,
        names: &[String],
        trigger: Option<&Trigger>,
    ) -> Result<Self, Failure> {
        let look = |error| failure(error, Asked::ToLook);
        let mut shown: Vec<&str> = names.iter().map(String::as_str).collect();
        match trigger {
            Some(trigger) if shown.is_empty() => shown.push(&trigger.signal),
            None if shown.is_empty() => {
                let node = client.node();
                return Err(Failure::usage(format!(
                    "name the signals to show, such as 'ramp.*'; `isochrone show {node}` prints those there are"
                )));
            }
            _ => {}
        }
        let found = signals_by_task(client, &shown).map_err(look)?;
        check_count(found.iter().map(|(_, signals)| signals.len()).sum())?;
        let names = |signals: Vec<_>| {
            let names = signals.into_iter();
            names.map(|it: isochrone_runtime::control::SignalDescription| it.name).collect()
        };
        let mut tasks: Vec<(String, Vec<String>)> =
            found.into_iter().map(|(task, signals)| (task, names(signals))).collect();
        let Some(trigger) = trigger else { return Ok(Self { tasks, trigger: None }) };
        let found = signals_by_task(client, &[&trigger.signal]).map_err(look)?;
        let mut signals = found.into_iter().flat_map(|(_, signals)| signals);
        let (Some(signal), None) = (signals.next(), signals.next()) else {
            return Err(Failure::usage(format!(
                "trigger '{trigger}': \"{}\" stands for several signals; name one",
                trigger.signal
            )));
        };
        let edge = edge(trigger, &signal.value_type, signal.unit.as_deref().unwrap_or_default())?;
        // A trace that is full has no room for it: then it has one of its own.
        let has_room = |(task, names): &(String, Vec<String>)| {
            *task == signal.task && (names.len() < MOST || names.contains(&signal.name))
        };
        let task = tasks.iter().position(has_room).unwrap_or_else(|| {
            tasks.push((signal.task.clone(), Vec::new()));
            tasks.len() - 1
        });
        Ok(Self { tasks, trigger: Some(Of { task, name: signal.name, edge }) })
    }

    /// The tasks of which signals are shown.
    pub(super) fn shown_tasks(&self) -> Vec<&str> {
        let shown = self.tasks.iter().filter(|(_, names)| !names.is_empty());
        shown.map(|(task, _)| task.as_str()).collect()
    }

    /// Which trace has the trigger's signal, at which place of a row, and what to wait for.
    pub(super) fn trigger(&self) -> Option<((usize, usize), Edge)> {
        let of = self.trigger.as_ref()?;
        let (_, names) = self.tasks.get(of.task)?;
        // Behind what is shown, unless it is shown itself.
        let place = names.iter().position(|name| *name == of.name).unwrap_or(names.len());
        Some(((of.task, place), of.edge))
    }

    /// The names that the trace of a task has, in their order.
    fn traced(&self, task: usize) -> Vec<String> {
        let mut names = self.tasks.get(task).map(|(_, names)| names.clone()).unwrap_or_default();
        if let Some(of) = self.trigger.as_ref().filter(|of| of.task == task)
            && !names.contains(&of.name)
        {
            names.push(of.name.clone());
        }
        names
    }
}

/// A trace for each task.
pub(super) struct Probes {
    probes: Vec<Probe>,
    cared: Instant,
}

struct Probe {
    trace: Trace,
    /// What the row before said.
    missed: Option<u64>,
}

impl Probes {
    /// Begins to trace.
    pub(super) fn open(
        participant: &Participant<ipc::Service>,
        client: &Rc<RefCell<Client>>,
        wanted: &Wanted,
    ) -> Result<Self, ClientError> {
        let open = |task| {
            let trace = Trace::open(participant, client, wanted.traced(task))?;
            Ok(Probe { trace, missed: None })
        };
        let probes = (0..wanted.tasks.len()).map(open).collect::<Result<_, ClientError>>()?;
        Ok(Self { probes, cared: Instant::now() })
    }

    /// What there is to see, in the order of the tasks.
    pub(super) fn observed(&self, wanted: &Wanted) -> Vec<Observed> {
        let each = self.probes.iter().zip(&wanted.tasks);
        each.map(|(Probe { trace, .. }, (task, shown))| {
            let signals = trace.signals().iter().take(shown.len()).map(|signal| Signal {
                name: signal.name.clone(),
                unit: signal.unit.clone().unwrap_or_default(),
                value_type: signal.value_type.clone(),
            });
            let (task, period_ns) = (task.clone(), Some(trace.period_ns()));
            Observed { task, period_ns, signals: signals.collect() }
        })
        .collect()
    }

    /// Keeps the traces going.
    pub(super) fn care(&mut self) -> Result<(), ClientError> {
        let is_due = self.cared.elapsed() >= CARE_INTERVAL;
        if is_due {
            self.cared = Instant::now();
        }
        self.probes.iter_mut().try_for_each(|probe| {
            if is_due {
                probe.trace.maintain();
            }
            probe.trace.renew()
        })
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

    /// Whether the node ended one of them, or itself.
    pub(super) fn have_ended(&self) -> bool {
        self.probes.iter().any(|probe| probe.trace.has_ended())
    }
}

/// What the signal of a trigger did instead.
pub(super) fn not_fired(trigger: &Trigger, capture: &Capture) -> String {
    let signal = &trigger.signal;
    let Looked { cycles: looked, lost, seen } = capture.looked();
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
