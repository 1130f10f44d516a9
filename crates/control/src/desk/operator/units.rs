//! The units of signals, of the configuration and as publishers announce them.

use std::collections::HashMap;

use isochrone_model::Role;

use super::{Operator, Signal};

/// The units that publishers announce.
#[derive(Debug, Default)]
pub(super) struct AnnouncedUnits {
    /// By the inputs that read them.
    by_input: HashMap<String, String>,
    changes: u64,
}

impl Operator {
    /// Notes the units that publishers announce, by the inputs that read them; an empty one: none.
    pub fn announce_units(&mut self, units: impl IntoIterator<Item = (String, String)>) {
        for (input, unit) in units {
            self.announced.by_input.insert(input, unit);
            self.announced.changes += 1;
        }
    }

    /// How often an announced unit has changed.
    pub fn announced_units(&self) -> u64 {
        self.announced.changes
    }

    /// The unit of a signal: for an input without one in the configuration, the announced one; empty: none is known.
    pub fn unit<'a>(&'a self, signal: &Signal<'a>) -> &'a str {
        let is_open = signal.role == Role::Input && signal.unit.is_empty();
        let announced = is_open.then(|| self.announced.by_input.get(&signal.name)).flatten();
        announced.map_or(signal.unit, String::as_str)
    }
}
