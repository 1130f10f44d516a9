//! The parts that belong to a new configuration.

use isochrone_engine::Source;

use crate::alarms::Alarm;

/// The parts that the supervisor uses once all tasks have a new configuration.
pub(crate) struct NewParts {
    pub(crate) source: Source,
    pub(crate) banks: Vec<Vec<String>>,
    pub(crate) cuts: Vec<Alarm>,
}
