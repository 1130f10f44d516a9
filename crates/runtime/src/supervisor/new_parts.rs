//! What goes with another configuration.

use isochrone_engine::Source;

use crate::alarms::Alarm;

/// What the supervisor needs to go by another configuration when all tasks have it.
pub(crate) struct NewParts {
    pub(crate) source: Source,
    pub(crate) banks: Vec<Vec<String>>,
    pub(crate) cuts: Vec<Alarm>,
}
