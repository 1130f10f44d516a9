//! The selection of a running node's signals, by task, and of a trigger.

use isochrone_control::{Client, signals_by_task};
use isochrone_scope::{Edge, Trigger};

use super::chosen::{MOST, check_count, edge};
use crate::failure::Failure;
use crate::operate::{Purpose, failure};

/// The selected signals of a node, and the trigger.
pub(super) struct ScopeSelection {
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

impl ScopeSelection {
    /// Finds the signals of names and globs, and that of the trigger, which alone is shown without any
    /// names.
    pub(super) fn find(
        client: &mut Client,
        names: &[String],
        trigger: Option<&Trigger>,
    ) -> Result<Self, Failure> {
        let look = |error| failure(error, Purpose::Look);
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
            names.map(|it: isochrone_control::SignalDescription| it.name).collect()
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
    pub(super) fn traced(&self, task: usize) -> Vec<String> {
        let mut names = self.tasks.get(task).map(|(_, names)| names.clone()).unwrap_or_default();
        if let Some(of) = self.trigger.as_ref().filter(|of| of.task == task)
            && !names.contains(&of.name)
        {
            names.push(of.name.clone());
        }
        names
    }
}
