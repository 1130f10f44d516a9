//! The units that publishers announce.

use std::collections::HashMap;

/// The units that publishers announce for inputs.
#[derive(Debug, Default)]
pub(super) struct AnnouncedUnits {
    by_input: HashMap<String, String>,
    changes: u64,
}

impl AnnouncedUnits {
    /// Notes the unit of an input; empty: none.
    pub(super) fn note(&mut self, input: String, unit: String) {
        self.by_input.insert(input, unit);
        self.changes += 1;
    }

    /// How often a unit was noted.
    pub(super) fn changes(&self) -> u64 {
        self.changes
    }

    /// The unit of an input.
    pub(super) fn of(&self, input: &str) -> Option<&str> {
        self.by_input.get(input).map(String::as_str)
    }
}
