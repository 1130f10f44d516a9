//! An input that is read from a table.

use std::path::Path;

use isochrone_blocks::PinType;
use isochrone_engine::{Flags, InputPart, InputPlan, InputReading, Plan, escaped};

use crate::base::csv_table::CsvTable;
use crate::base::numbers;

/// The columns that an input may have, and their types.
pub(super) fn columns(input: &InputPlan) -> [(String, PinType); 3] {
    InputPart::ALL
        .map(|part| (format!("{}{}", input.name, part.suffix()), part.pin_type(input.value_type)))
}

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

/// Why a sample is rejected.
pub(super) fn cannot_hold(column: &str, value_type: PinType, value: f64) -> String {
    format!("{column} is {value_type}, which cannot hold {}", numbers::format(value))
}

/// An input that has a column in the table.
pub(super) struct RecordedInput {
    /// Index among the task's inputs.
    pub(super) index: usize,
    value: Option<usize>,
    ok: Option<usize>,
    age: Option<usize>,
    /// The last value.
    pub(super) reading: InputReading,
}

impl RecordedInput {
    pub(super) fn find(index: usize, input: &InputPlan, table: &CsvTable) -> Option<Self> {
        let [value, ok, age] = columns(input).map(|(name, _)| table.column(&name));
        value.or(ok).or(age)?;
        let (age_s, flags) = (f64::INFINITY, Flags::NONE);
        let reading = InputReading { value: input.default, ok: false, age_s, source_ns: 0, flags };
        Some(Self { index, value, ok, age, reading })
    }

    /// Reads a row. What a column does not say is so: a value is good and of age 0, none is not ok.
    pub(super) fn read(&mut self, input: &InputPlan, row: &[f64]) -> Result<(), String> {
        let cell = |column: Option<usize>| row.get(column?).copied();
        let InputPlan { name, value_type, max_age_ns, .. } = input;
        if let Some(age_s) = cell(self.age) {
            if age_s.is_nan() || age_s < 0.0 {
                let age_s = numbers::format(age_s);
                return Err(format!("{name}.age is an age in seconds, which cannot be {age_s}"));
            }
            self.reading.age_s = age_s;
        } else if self.value.is_some() {
            self.reading.age_s = 0.0;
        }
        let is_fresh = max_age_ns.is_none_or(|ns| self.reading.age_s <= ns as f64 / 1e9);
        let is_told = match cell(self.ok) {
            Some(ok) if !PinType::Bool.holds(ok) => {
                return Err(cannot_hold(&format!("{name}.ok"), PinType::Bool, ok));
            }
            Some(ok) => Some(ok != 0.0),
            None => None,
        };
        let value = cell(self.value);
        self.reading.ok = is_told.unwrap_or(value.is_some() && is_fresh);
        match value {
            Some(value) if !value_type.holds(value) => {
                self.reading.ok = false;
                Err(cannot_hold(name, *value_type, value))
            }
            Some(value) => {
                self.reading.value = value;
                Ok(())
            }
            None => Ok(()),
        }
    }
}
