//! The units of signals, of the configuration and as publishers announce them.

use isochrone_model::Role;

use super::{Operator, Signal};

impl Operator {
    /// Notes the units that publishers announce, by the inputs that read them; an empty one: none.
    pub fn announce_units(&mut self, units: impl IntoIterator<Item = (String, String)>) {
        units.into_iter().for_each(|(input, unit)| self.announced.note(input, unit));
    }

    /// How often an announced unit has changed.
    pub fn announced_units(&self) -> u64 {
        self.announced.changes()
    }

    /// The unit of a signal: for an input without one in the configuration, the announced one; empty: none is known.
    pub fn unit<'a>(&'a self, signal: &Signal<'a>) -> &'a str {
        let is_open = signal.role == Role::Input && signal.unit.is_empty();
        is_open.then(|| self.announced.of(&signal.name)).flatten().unwrap_or(signal.unit)
    }
}
