//! Every cycle of some signals of a node, as arrays.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use isochrone::control::{Client, ClientError, Trace};
use isochrone::ipc::Participant;
use numpy::{PyArray1, ToPyArray as _};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::Ports;
use crate::errors::unanswered;
use crate::interruption::interruptible;
use crate::joined::Member;

/// Between two looks for rows. The service keeps 512 of them, or what 1 MiB holds.
const PAUSE: Duration = Duration::from_millis(5);
const MAINTENANCE: Duration = Duration::from_millis(100);

/// What was traced.
struct Traced {
    task: String,
    period_ns: u64,
    names: Vec<String>,
    units: Vec<String>,
    cycles: Vec<u64>,
    release_ns: Vec<u64>,
    lost: u64,
    missed: u64,
    columns: Vec<Vec<f64>>,
}

/// Traces signals of one task for so many cycles, or seconds; returns arrays by name, and what the trace is of.
#[pyfunction]
#[pyo3(signature = (member, node, names, cycles, seconds, patience_s))]
pub(crate) fn trace<'py>(
    py: Python<'py>,
    member: Member,
    node: &str,
    names: Vec<String>,
    cycles: Option<u64>,
    seconds: Option<f64>,
    patience_s: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let patience = Duration::from_secs_f64(patience_s);
    let until = Until { cycles, time: seconds.map(Duration::from_secs_f64) };
    let participant = member.open(py, Ok)?;
    let stop = Arc::new(AtomicBool::new(false));
    let traced = interruptible(py, &stop, || {
        // A trace and its client stay in one thread.
        let client = Client::connect(&participant, node, patience)?;
        let client = Rc::new(RefCell::new(client.interrupted_by(Arc::clone(&stop))));
        follow(&participant, &client, names, &until, &stop)
    })?;
    let traced = traced.map_err(|error| unanswered(py, error))?;
    let result = PyDict::new(py);
    result.set_item("task", traced.task)?;
    result.set_item("period_ns", traced.period_ns)?;
    result.set_item("units", traced.units)?;
    result.set_item("cycle", traced.cycles.to_pyarray(py))?;
    result.set_item("release_ns", traced.release_ns.to_pyarray(py))?;
    result.set_item("lost", traced.lost)?;
    result.set_item("missed", traced.missed)?;
    let columns = traced.columns.into_iter().map(|column| PyArray1::from_vec(py, column));
    let values = PyDict::new(py);
    for (name, column) in traced.names.into_iter().zip(columns) {
        values.set_item(name, column)?;
    }
    result.set_item("values", values)?;
    Ok(result)
}

/// When a trace has enough.
struct Until {
    cycles: Option<u64>,
    time: Option<Duration>,
}

fn follow(
    participant: &Participant<Ports>,
    client: &Rc<RefCell<Client<Ports>>>,
    names: Vec<String>,
    until: &Until,
    stop: &AtomicBool,
) -> Result<Traced, ClientError> {
    let mut trace = Trace::open(participant, client, names)?;
    let signals = trace.signals();
    let mut traced = Traced {
        task: trace.task().to_owned(),
        period_ns: trace.period_ns(),
        names: signals.iter().map(|signal| signal.name.clone()).collect(),
        units: signals.iter().map(|signal| signal.unit.clone().unwrap_or_default()).collect(),
        cycles: Vec::new(),
        release_ns: Vec::new(),
        lost: 0,
        missed: 0,
        columns: vec![Vec::new(); signals.len()],
    };
    let (begin, mut maintained) = (Instant::now(), Instant::now());
    let mut missed_before = None;
    while !stop.load(Ordering::Relaxed) {
        trace.renew()?;
        if maintained.elapsed() >= MAINTENANCE {
            trace.maintain();
            participant.tend();
            maintained = Instant::now();
        }
        let is_over = until.time.is_some_and(|time| begin.elapsed() >= time);
        while let Some(row) = trace.next_row() {
            if until.cycles.is_some_and(|cycles| traced.cycles.len() as u64 >= cycles) {
                return Ok(traced);
            }
            traced.cycles.push(row.cycle);
            traced.release_ns.push(row.release_ns);
            traced.lost += row.lost;
            traced.missed = row.missed.saturating_sub(*missed_before.get_or_insert(row.missed));
            traced
                .columns
                .iter_mut()
                .zip(row.values)
                .for_each(|(column, value)| column.push(*value));
        }
        let is_full = until.cycles.is_some_and(|cycles| traced.cycles.len() as u64 >= cycles);
        if is_over || is_full {
            return Ok(traced);
        }
        if trace.has_ended() {
            let node = client.borrow().node().to_owned();
            return Err(ClientError::Ended { node });
        }
        thread::sleep(PAUSE);
    }
    Ok(traced)
}
