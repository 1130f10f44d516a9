//! The picture of a simulation.

use std::path::Path;
use std::sync::Arc;

use isochrone_control::desk::{Selection, Signals};
use isochrone_engine::{Plan, SignalPlan};
use isochrone_report::{ChartSignal, SignalChart, signals_html, signals_svg};
use isochrone_scope::{Decimation, TrackSignal};
use isochrone_timing::units::{counted, period};

use crate::base::failure::Failure;
use crate::base::files::ResultFile;

/// Most signals of a picture: as many as can still be told apart.
const MOST: usize = 24;

#[derive(Debug, Clone, Copy)]
enum Kind {
    Svg,
    Html,
}

/// A picture that is collected while the simulation runs.
pub(super) struct Plot {
    kind: Kind,
    file: ResultFile,
    name: String,
    reference: usize,
    signals: Vec<ChartSignal>,
    /// For each task what is taken of its cycles.
    tasks: Vec<TaskRows>,
}

/// What is taken of the cycles of a task.
struct TaskRows {
    slots: Vec<usize>,
    row: Vec<f64>,
    data: Decimation,
}

impl Plot {
    /// Checks what is to be drawn and whether the file can be written. Without names it is what the outputs have.
    pub(super) fn open<'a>(
        path: &Path,
        names: &[String],
        plan: &Plan,
        reference: usize,
        outputs: impl IntoIterator<Item = (usize, &'a SignalPlan)>,
    ) -> Result<Self, Failure> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        let kind = match ending.as_deref() {
            Some("svg") => Kind::Svg,
            Some("html") => Kind::Html,
            _ => {
                let path = path.display();
                return Err(Failure::usage(format!(
                    "{path}: end the name with .svg or .html, which says what to draw"
                )));
            }
        };
        let mut found: Vec<(usize, usize, TrackSignal)> = Vec::new();
        if names.is_empty() {
            for (task, signal) in outputs {
                let SignalPlan { name, unit, value_type, slot, .. } = signal;
                let place = (task, *slot);
                if !found.iter().any(|(task, slot, _)| (*task, *slot) == place) {
                    found.push((task, *slot, track_signal(name, unit, value_type.as_str())));
                }
            }
        } else {
            let signals = Arc::new(Signals::of(plan));
            let selection = Selection::of(&signals, names.iter().map(String::as_str), 0, MOST + 1);
            let selection = selection.map_err(|refusal| Failure::usage(refusal.message))?;
            check_count(selection.total())?;
            found = selection
                .signals()
                .map(|it| {
                    (it.task, it.slot, track_signal(&it.name, it.unit, it.value_type.as_str()))
                })
                .collect();
        }
        check_count(found.len())?;
        let mut slots: Vec<Vec<usize>> = vec![Vec::new(); plan.tasks.len()];
        let mut signals = Vec::new();
        for (task, slot, signal) in found {
            signals.push(ChartSignal { signal, task, place: slots[task].len() });
            slots[task].push(slot);
        }
        let rows = slots.into_iter().zip(&plan.tasks).map(|(slots, task)| TaskRows {
            row: vec![0.0; slots.len()],
            data: Decimation::new(slots.len(), task.settings.phase_ns, task.settings.period_ns),
            slots,
        });
        let (file, name) = (ResultFile::open(path)?, plan.node.clone());
        Ok(Self { kind, file, name, reference, signals, tasks: rows.collect() })
    }

    /// Takes the values of a cycle of a task.
    pub(super) fn take(&mut self, task: usize, image: &[f64]) {
        let TaskRows { slots, row, data } = &mut self.tasks[task];
        for (value, slot) in row.iter_mut().zip(slots) {
            *value = image[*slot];
        }
        data.push(row);
    }

    /// Draws the picture.
    pub(super) fn write(self) -> Result<(), Failure> {
        let Self { kind, file, name, reference, signals, tasks } = self;
        let tasks: Vec<Decimation> = tasks.into_iter().map(|task| task.data).collect();
        let rows = &tasks[reference];
        let cycles = counted(rows.rows(), "cycle");
        let mut about = format!("simulated: {cycles} of {}", period(rows.period_ns()));
        if signals.iter().any(|it| tasks[it.task].rows_per_bucket() > 1) {
            about += ", drawn from the least to the greatest value of each instant";
        }
        let (zero_ns, end_ns) = (rows.due_ns(0), rows.due_ns(rows.rows()));
        let chart = SignalChart { title: name, about, signals, tasks, zero_ns, end_ns };
        file.write(&match kind {
            Kind::Svg => signals_svg(&chart),
            Kind::Html => signals_html(&chart),
        })
    }
}

fn check_count(count: usize) -> Result<(), Failure> {
    let how = "name some with --signals, such as --signals 'ramp.*,level.y'";
    match count {
        0 => Err(Failure::usage(format!("no output has a signal to draw: {how}"))),
        1..=MOST => Ok(()),
        _ => Err(Failure::usage(format!(
            "these are {count} signals, and a picture has room for {MOST}: {how}"
        ))),
    }
}

fn track_signal(name: &str, unit: &str, value_type: &str) -> TrackSignal {
    let unit = if value_type == "TIME" { "ms" } else { unit };
    TrackSignal { name: name.into(), unit: unit.into(), value_type: value_type.into() }
}
