//! An input that is given its values in rows.

use isochrone_blocks::PinType;
use isochrone_engine::{Flags, InputPart, InputPlan, InputReading};

/// Why a sample is rejected.
pub(super) fn cannot_hold(column: &str, value_type: PinType, value: f64) -> String {
    format!("{column} is {value_type}, which cannot hold {value:?}")
}

/// An input with a column.
pub(super) struct GivenInput {
    /// Index among the task's inputs.
    pub(super) index: usize,
    value: Option<usize>,
    ok: Option<usize>,
    age: Option<usize>,
    /// The last value.
    pub(super) reading: InputReading,
}

impl GivenInput {
    pub(super) fn find(
        index: usize,
        input: &InputPlan,
        column: impl Fn(&str) -> Option<usize>,
    ) -> Option<Self> {
        let name = |part: InputPart| format!("{}{}", input.name, part.suffix());
        let [value, ok, age] = InputPart::ALL.map(|part| column(&name(part)));
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
                return Err(format!("{name}.age is an age in seconds, which cannot be {age_s:?}"));
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
