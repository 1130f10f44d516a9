//! The cross references: who writes and who reads each signal.

use std::collections::BTreeMap;

use isochrone_engine::{InputPart, Plan};
use isochrone_report::{Page, Row, TableColumn};

use super::connections::{Connections, joined};
use super::signals::origin;

/// Rows of a table that is still read by people.
const ROWS: usize = 5_000;

/// A signal: its unit, and who writes it.
struct Written {
    unit: String,
    by: String,
}

pub(super) fn section(page: &mut Page, plan: &Plan, connections: &Connections) {
    let signals = signals(plan, connections);
    if signals.is_empty() {
        return;
    }
    page.heading("Cross references");
    let columns = ["signal", "unit", "written by", "read by"].map(TableColumn::Words);
    let row = |(name, written): (&String, &Written)| {
        let readers = match joined(connections.readers(name)) {
            readers if readers.is_empty() => "\u{2013}".to_owned(),
            readers => readers,
        };
        Row::of([name.clone(), written.unit.clone(), written.by.clone(), readers])
    };
    let caption = "Inputs, variables, and the outputs of blocks that anything reads";
    page.table(caption, &columns, signals.iter().take(ROWS).map(row));
    if let more @ 1.. = signals.len().saturating_sub(ROWS) {
        let more = format!("{more} more signals are not listed here; the blocks have them.");
        page.element("<p>", more, "</p>\n");
    }
}

/// All inputs and variables, and whatever else is read, by name.
fn signals(plan: &Plan, connections: &Connections) -> BTreeMap<String, Written> {
    let mut signals = BTreeMap::new();
    let is_read = |name: &str| !connections.readers(name).is_empty();
    for (index, task) in plan.tasks.iter().enumerate() {
        let mut add = |slot: usize, by: String, is_always: bool| {
            let name = plan.slot_name(index, slot);
            if is_always || is_read(&name) {
                let unit = plan.slot_unit(index, slot).to_owned();
                signals.insert(name, Written { unit, by });
            }
        };
        for (place, input) in task.inputs.iter().enumerate() {
            for part in InputPart::ALL {
                let by = match part {
                    InputPart::Value => origin(input),
                    InputPart::Ok | InputPart::Age => format!("task {}", task.name),
                };
                add(task.input_slot(place, part), by, part == InputPart::Value);
            }
        }
        for place in 0..task.variables.len() {
            add(task.variable_slot(place), "operators".into(), true);
        }
        for alarm in &task.alarms {
            let by = format!("alarm {}, task {}", alarm.name, task.name);
            // `.active` and `.ok`.
            add(alarm.active_slot(), by.clone(), false);
            add(alarm.ok_slot(), by, false);
        }
        for bank in task.block_banks() {
            let (inputs, stride) = (bank.block_type.inputs.len(), bank.block_type.slots());
            for (place, instance) in bank.instances.iter().enumerate() {
                for output in inputs..stride {
                    let by = format!("{instance}, task {}", task.name);
                    add(bank.first_slot + place * stride + output, by, false);
                }
            }
        }
    }
    signals
}
