//! The parts that belong to a new configuration.

use std::collections::HashMap;

use isochrone_engine::{Plan, Source};

use crate::node::alarms::Alarm;
use crate::task::outputs::{self, Output};
use crate::task::retained::Copies;

/// The parts that the supervisor uses once all tasks have a new configuration.
pub(crate) struct NewParts {
    pub(crate) source: Source,
    pub(crate) banks: Vec<Vec<String>>,
    pub(crate) cuts: Vec<Alarm>,
    /// Of each task, where the node retains its state.
    pub(crate) copies: Vec<Copies>,
}

/// The units of a configuration that is on its way to the tasks. Layouts are announced before frames have them, so that
/// readers miss as few frames as possible.
pub(crate) struct NewUnits {
    /// What all tasks publish, in the plan's order.
    pub(super) outputs: Vec<Output>,
    /// The units of inputs by their names; empty where the configuration gives none.
    pub(super) inputs: HashMap<String, String>,
}

impl NewUnits {
    pub(crate) fn of(plan: &Plan) -> Self {
        let inputs = plan.tasks.iter().flat_map(|task| &task.inputs);
        Self {
            outputs: plan.tasks.iter().flat_map(outputs::of_task).collect(),
            inputs: inputs.map(|input| (input.name.clone(), input.unit.clone())).collect(),
        }
    }
}
