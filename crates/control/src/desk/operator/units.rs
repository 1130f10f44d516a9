//! The units of signals, of the configuration and as publishers announce them.

use isochrone_model::Role;

use super::{Operator, Signal};

impl Operator {
    /// Notes the units that publishers announce, by the inputs that read them; an empty one: none.
    pub fn announce_units(&mut self, units: impl IntoIterator<Item = (String, String)>) {
        self.announced.extend(units);
    }

    /// The unit of a signal: for an input without one in the configuration, the announced one; empty: none is known.
    pub fn unit<'a>(&'a self, signal: &Signal<'a>) -> &'a str {
        let is_open = signal.role == Role::Input && signal.unit.is_empty();
        let announced = is_open.then(|| self.announced.get(&signal.name)).flatten();
        announced.map_or(signal.unit, String::as_str)
    }
}
