//! What a node takes from its state.

use std::fmt;
use std::path::PathBuf;

use isochrone_control::desk::{Operator, PreparedRequest, RestoredValues, Unexpected};
use isochrone_engine::{InputPart, Plan, Source, TaskEngine, WarmStart};
use isochrone_timing::units::{counted, duration};

use super::node_state::NodeState;
use super::retention::Retention;
use crate::node::alarms::Alarm;

/// What a node took from its state. `Display` is one line.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Restored {
    /// The file.
    pub file: PathBuf,
    /// How old it was, in ns; `None`: it is of the future.
    pub age_ns: Option<u64>,
    /// Blocks that go on where they stood.
    pub blocks: usize,
    /// Inputs that begin with their last value.
    pub inputs: usize,
    /// Parameters and variables that are set as they were.
    pub values: usize,
    /// Tasks, blocks and inputs of the state that the configuration does not have, or has with another type.
    pub unmatched: Vec<String>,
    /// What was set in another configuration than this.
    pub unexpected: Vec<Unexpected>,
    /// Why blocks and inputs begin anew, if they do.
    pub cold: Option<String>,
}

/// What is restored, and what the tasks need for it.
#[derive(Default)]
pub(crate) struct Restoration {
    /// Of each task that goes on.
    pub(crate) tasks: Vec<Option<RestoredTask>>,
    /// Sets what was set.
    pub(crate) request: Option<PreparedRequest>,
    /// `None`: there was no state.
    pub(crate) restored: Option<Restored>,
    pub(crate) alarms: Vec<Alarm>,
}

/// A task that goes on where it ended.
#[derive(Default, Clone)]
pub(crate) struct RestoredTask {
    pub(crate) first_cycle: u64,
    /// Inputs by their index in the plan, and their last values.
    pub(crate) inputs: Vec<(usize, f64)>,
}

impl Restoration {
    /// The number of the first cycle of each task.
    pub(crate) fn first_cycles(&self) -> Vec<u64> {
        let first = |task: &Option<RestoredTask>| task.as_ref().map_or(0, |task| task.first_cycle);
        self.tasks.iter().map(first).collect()
    }
}

/// Has engines and operator of a plan go on where its state says.
pub(crate) fn restore(
    retention: Option<&Retention>,
    plan: &Plan,
    engines: &mut [TaskEngine],
    operator: &mut Operator,
) -> Restoration {
    let mut restoration = Restoration::default();
    restoration.tasks.resize(plan.tasks.len(), None);
    let Some(retention) = retention else { return restoration };
    restoration.alarms.clone_from(&retention.alarms);
    let Some(state) = &retention.found else { return restoration };
    let mut restored = Restored {
        file: retention.file.path().to_owned(),
        age_ns: retention.age_ns,
        blocks: 0,
        inputs: 0,
        values: 0,
        unmatched: Vec::new(),
        unexpected: Vec::new(),
        cold: retention.cold.clone(),
    };
    // The names in a state follow from its configuration, which this program must be able to read.
    let before = plan.rules.plan(Source::new(state.file.clone(), state.configuration.clone()));
    match (&restored.cold, before) {
        (Some(_), _) => {}
        (None, Err(_)) => {
            let why = "it is of a configuration that this program does not accept";
            restored.cold = Some(why.to_owned());
        }
        (None, Ok(before)) => {
            for (index, (engine, task)) in engines.iter_mut().zip(&plan.tasks).enumerate() {
                let of_state = before.tasks.iter().zip(&state.tasks);
                let mut of_state = of_state.filter(|(before, _)| before.name == task.name);
                let Some((before, Some(state))) = of_state.next() else { continue };
                let WarmStart { blocks, inputs, unmatched, first_cycle, .. } =
                    engine.warm_start(task, before, state);
                restored.blocks += blocks;
                restored.inputs += inputs.len();
                restored.unmatched.extend(unmatched);
                let slot = |input: &usize| task.input_slot(*input, InputPart::Value);
                let value = |input| engine.image().get(slot(&input)).map(|value| (input, *value));
                let inputs = inputs.into_iter().filter_map(value).collect();
                if let Some(place) = restoration.tasks.get_mut(index) {
                    *place = Some(RestoredTask { first_cycle, inputs });
                }
            }
            let is_gone = |name: &str| plan.tasks.iter().all(|task| task.name != name);
            let gone = before.tasks.iter().filter(|task| is_gone(&task.name));
            restored.unmatched.extend(gone.map(|task| format!("task {}", task.name)));
        }
    }
    restoration.alarms.extend(restored.cold.as_ref().map(|why| cold_start(state, why)));
    let RestoredValues { request, values, unexpected, .. } =
        operator.restore(&state.tuned, &restoration.first_cycles());
    (restored.values, restored.unexpected) = (values, unexpected);
    restoration.request = request;
    restoration.restored = Some(restored);
    restoration
}

fn cold_start(state: &NodeState, why: &str) -> Alarm {
    let node = &state.node;
    Alarm::ColdStart {
        reason: format!(
            "the blocks and inputs of \"{node}\" begin anew, not from the retained state: {why}"
        ),
    }
}

impl fmt::Display for Restored {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        /// Names that are shown.
        const NAMED: usize = 8;
        let Self { file, age_ns, blocks, inputs, values, unmatched, .. } = self;
        let (blocks, inputs) = (counted(*blocks as u64, "block"), counted(*inputs as u64, "input"));
        let values = counted(*values as u64, "set value");
        write!(f, "restored {blocks}, {inputs} and {values} from {}", file.display())?;
        if let Some(age_ns) = age_ns {
            write!(f, ", which is {} old", duration(*age_ns as f64))?;
        }
        if !unmatched.is_empty() {
            let named: Vec<_> = unmatched.iter().take(NAMED).map(String::as_str).collect();
            write!(f, "; not in this configuration: {}", named.join(", "))?;
            if let Some(more) = unmatched.len().checked_sub(NAMED).filter(|more| *more > 0) {
                write!(f, " and {more} more")?;
            }
        }
        Ok(())
    }
}
