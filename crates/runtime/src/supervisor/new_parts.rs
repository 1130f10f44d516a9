//! The parts that belong to a new configuration.

use isochrone_engine::Source;

use crate::node::alarms::Alarm;
use crate::task::retained::Copies;

/// The parts that the supervisor uses once all tasks have a new configuration.
pub(crate) struct NewParts {
    pub(crate) source: Source,
    pub(crate) banks: Vec<Vec<String>>,
    pub(crate) cuts: Vec<Alarm>,
    /// Of each task, where the node retains its state.
    pub(crate) copies: Vec<Copies>,
}
