//! The units of columns.

use std::path::Path;

use isochrone_engine::{Plan, escaped};

use crate::base::csv_table::CsvTable;

/// Refuses a column in another unit than its input or variable.
pub(super) fn check_units(plan: &Plan, table: &CsvTable, path: &Path) -> Result<(), String> {
    let inputs = plan.tasks.iter().flat_map(|task| &task.inputs);
    let inputs = inputs.map(|input| (&input.name, &input.unit));
    let variables = plan.tasks.iter().flat_map(|task| &task.variables);
    let variables = variables.map(|variable| (&variable.name, &variable.unit));
    for (name, unit) in inputs.chain(variables).filter(|(_, unit)| !unit.is_empty()) {
        let found = table.column(name).and_then(|place| table.units().get(place));
        if let Some(found) = found.filter(|found| !found.is_empty() && *found != unit) {
            return Err(format!(
                "{}: column \"{}\" is in \"{}\", and the configuration has it in \"{unit}\"; nothing is converted: correct \
                 the header, or the unit in the configuration",
                path.display(),
                escaped(name),
                escaped(found)
            ));
        }
    }
    Ok(())
}
