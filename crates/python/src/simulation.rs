//! A configuration without a clock, from arrays to arrays.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use isochrone::blocks::CATALOGUE;
use isochrone::control::desk::{Selection, Signals};
use isochrone::engine::{Diagnostics, Plan, Rules, Source};
use isochrone::ipc::check_service_name;
use isochrone::runtime::{Simulation, hold_panic_messages};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::failed;

/// Between two looks whether Python has received a signal.
const CYCLES: u64 = 4096;

/// A signal that is wanted: its name, and its task and slot.
struct Column {
    name: String,
    task: usize,
    slot: usize,
    values: Vec<f64>,
}

/// Steps a configuration; returns its period in ns, arrays by name, and notes.
#[pyfunction]
#[pyo3(signature = (path, text, inputs, cycles, task, signals))]
pub(crate) fn simulate<'py>(
    py: Python<'py>,
    path: PathBuf,
    text: Option<String>,
    inputs: Vec<(String, PyReadonlyArray1<'py, f64>)>,
    cycles: Option<u64>,
    task: Option<&str>,
    signals: Vec<String>,
) -> PyResult<(u64, Bound<'py, PyDict>, Vec<String>)> {
    let source = match text {
        Some(text) => Source::new(path.display().to_string(), text),
        None => Source::read(&path).map_err(failed)?,
    };
    let rules = Rules {
        catalogue: CATALOGUE,
        service_name: |name| check_service_name(name).map_err(|error| error.to_string()),
    };
    let plan = py.detach(|| Plan::new(source, &rules)).map_err(failed)?;
    let mut notes = Vec::new();
    if !plan.warnings.is_empty() {
        notes.push(Diagnostics::new(plan.source.clone(), plan.warnings.clone()).to_string());
    }
    let reference = reference(&plan, task)?;
    let table = Table::of(&plan, &inputs)?;
    let cycles = match cycles {
        Some(cycles) => cycles,
        None if table.rows > 0 => table.rows as u64,
        None => {
            return Err(PyValueError::new_err(
                "give cycles, or inputs: nothing says how long to simulate",
            ));
        }
    };
    let mut columns = columns(&plan, &signals)?;
    for column in &mut columns {
        let room =
            usize::try_from(cycles).ok().map(|cycles| column.values.try_reserve_exact(cycles));
        if !matches!(room, Some(Ok(()))) {
            let message = format!("{cycles} cycles of {} do not fit into memory", column.name);
            return Err(pyo3::exceptions::PyMemoryError::new_err(message));
        }
    }
    hold_panic_messages();
    let mut simulation =
        Simulation::new(&plan, reference, |name| table.column(name)).map_err(failed)?;
    let mut next = 0;
    while next < cycles {
        let end = cycles.min(next + CYCLES);
        py.detach(|| {
            for cycle in next..end {
                simulation.advance(table.row(cycle), |_, _, _| ())?;
                for column in &mut columns {
                    let engine = simulation.engines().get(column.task);
                    let value = engine.and_then(|engine| engine.image().get(column.slot));
                    column.values.push(value.copied().unwrap_or(f64::NAN));
                }
            }
            Ok(())
        })
        .map_err(|panicked: isochrone::runtime::TaskPanicked| failed(panicked))?;
        py.check_signals()?;
        next = end;
    }
    if let (rejects, Some(first)) = simulation.rejects() {
        notes.push(format!("samples were rejected ({rejects}), and their signals kept their values; the first: {first}"));
    }
    let period_ns = plan.tasks.get(reference).map_or(0, |task| task.settings.period_ns);
    let arrays = PyDict::new(py);
    for Column { name, values, .. } in columns {
        arrays.set_item(name, PyArray1::from_vec(py, values))?;
    }
    Ok((period_ns, arrays, notes))
}

fn reference(plan: &Plan, task: Option<&str>) -> PyResult<usize> {
    let Some(task) = task else { return Ok(0) };
    plan.task_index(task).ok_or_else(|| {
        let names: Vec<_> = plan.tasks.iter().map(|task| task.name.as_str()).collect();
        let names = names.join(", ");
        PyValueError::new_err(format!("there is no task {task:?}; there is: {names}"))
    })
}

/// The signals that are wanted, or those of all outputs.
fn columns(plan: &Plan, names: &[String]) -> PyResult<Vec<Column>> {
    let column =
        |name: &str, task, slot| Column { name: name.to_owned(), task, slot, values: Vec::new() };
    if names.is_empty() {
        let outputs = Simulation::outputs(plan);
        let signals = outputs.iter().flat_map(|(task, _, output)| {
            output.signals.iter().map(|signal| column(&signal.name, *task, signal.slot))
        });
        return Ok(signals.collect());
    }
    let all = Arc::new(Signals::of(plan));
    let selected = Selection::of(&all, names.iter().map(String::as_str), 0, usize::MAX);
    let selected = selected.map_err(|refusal| PyKeyError::new_err(refusal.to_string()))?;
    Ok(selected.signals().map(|signal| column(&signal.name, signal.task, signal.slot)).collect())
}

/// The inputs, row by row.
struct Table {
    places: HashMap<String, usize>,
    rows: usize,
    values: Vec<f64>,
}

impl Table {
    fn of(plan: &Plan, inputs: &[(String, PyReadonlyArray1<'_, f64>)]) -> PyResult<Self> {
        let known = Simulation::columns(plan);
        let known = |name: &str| known.iter().any(|(column, _)| column == name);
        if let Some((name, _)) = inputs.iter().find(|(name, _)| !known(name)) {
            let names: Vec<_> =
                Simulation::columns(plan).into_iter().map(|(name, _)| name).collect();
            let message = format!(
                "the configuration has no input or variable {name:?}; it has: {}",
                names.join(", ")
            );
            return Err(PyKeyError::new_err(message));
        }
        let slices: Vec<_> =
            inputs.iter().map(|(_, array)| array.as_slice()).collect::<Result<_, _>>()?;
        let rows = slices.first().map_or(0, |first| first.len());
        let lengths = inputs.iter().zip(&slices);
        if let Some(((name, _), slice)) = lengths.into_iter().find(|(_, slice)| slice.len() != rows)
        {
            let first = inputs.first().map_or("", |(name, _)| name.as_str());
            let message = format!("{name:?} has {} values, and {first:?} has {rows}", slice.len());
            return Err(PyValueError::new_err(message));
        }
        let cells = (0..rows).flat_map(|row| slices.iter().filter_map(move |slice| slice.get(row)));
        let values = cells.copied().collect();
        let places = inputs.iter().map(|(name, _)| name.clone()).zip(0..).collect();
        Ok(Self { places, rows, values })
    }

    fn column(&self, name: &str) -> Option<usize> {
        self.places.get(name).copied()
    }

    /// The row of a cycle; behind the last one, its values hold.
    fn row(&self, cycle: u64) -> Option<&[f64]> {
        let row = usize::try_from(cycle).ok().filter(|row| *row < self.rows)?;
        let columns = self.places.len();
        self.values.get(row * columns..(row + 1) * columns)
    }
}
