//! The meaning of the values of rows in the running configuration.

use std::sync::Arc;

use isochrone_engine::{Plan, Source};
use isochrone_runtime::task_layouts;

use super::Rerun;
use crate::replay::missing::listed;
use crate::replay::task::Places;

impl Rerun<'_> {
    /// The plan of a configuration that was applied.
    pub(super) fn plan_of(
        &mut self,
        transaction: u64,
        text: &str,
        task: usize,
    ) -> Option<Arc<Plan>> {
        if let Some(plan) = self.applied.get(&transaction) {
            return Some(plan.clone());
        }
        let before = &self.tasks.get(task)?.plan;
        let source = Source::new(before.source.name.clone(), text);
        // That it can be read was seen to when the journal was.
        let plan = Arc::new(before.rules.plan(source).ok()?);
        self.applied.insert(transaction, plan.clone());
        Some(plan)
    }

    /// Where the values of a task's next row belong, in the plan that it gets with it or has.
    pub(super) fn places(
        &mut self,
        index: usize,
        changed: Option<&Arc<Plan>>,
    ) -> Option<Arc<Places>> {
        let task = self.tasks.get_mut(index)?;
        let row = task.rows.front()?;
        if let Some(plan) = changed {
            let own = task_layouts(plan).into_iter().nth(index)?;
            let (comparison, missing) = (&mut self.comparison, &mut self.missing);
            return Some(Arc::new(Places::new(&row.layout, &own, plan, comparison, missing)));
        }
        if let Some(places) = task.places.get(&row.channel) {
            return Some(places.clone());
        }
        let (comparison, missing) = (&mut self.comparison, &mut self.missing);
        let places = Places::new(&row.layout, &task.layout, &task.plan, comparison, missing);
        for (input, place) in task.layout.inputs.iter().zip(&places.inputs) {
            if place.is_none() {
                self.unlike.insert(format!(
                    "the recording has no input \"{}\" of task \"{}\"; it keeps its default",
                    input.name, task.name
                ));
            }
        }
        for (from, place) in &places.wires {
            if place.is_none() {
                let from = task.plan.tasks.get(*from).map_or("", |from| &from.name);
                self.unlike.insert(format!(
                    "the recording has no wire from task \"{from}\" to \"{}\"; each cycle reads what had been \
                     computed when it began",
                    task.name
                ));
            }
        }
        if !places.added.is_empty() {
            let added = listed(&places.added);
            self.unlike.insert(format!("the recording has no {added} of task \"{}\"", task.name));
        }
        if row.layout.period_ns != task.layout.period_ns {
            self.unlike.insert(format!(
                "task \"{}\" had another period; its cycles are repeated as they ran",
                task.name
            ));
        }
        let places = Arc::new(places);
        task.places.insert(row.channel, places.clone());
        Some(places)
    }
}
