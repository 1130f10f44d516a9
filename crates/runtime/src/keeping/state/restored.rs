//! What a node takes from its state.

use std::fmt;
use std::path::PathBuf;

use isochrone_control::desk::{Feeds, Operator, PreparedRequest, RestoredValues, Unexpected};
use isochrone_engine::{InputPart, Plan, Source, TaskEngine, TaskPlan, WarmStart};
use isochrone_timing::units::{counted, duration};

use super::file::StateFile;
use super::node_state::NodeState;
use super::retention::Found;
use crate::error::PrepareError;
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
    /// Blocks and inputs of the state that the configuration does not have, or has with another type.
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
    /// The alarm if blocks and inputs begin anew.
    pub(crate) cold_start: Option<Alarm>,
    /// The bytes of the state, for a recording, if tasks go on from it.
    pub(crate) recorded: Option<Vec<u8>>,
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
    found: Option<&Found>,
    plan: &Plan,
    engines: &mut [TaskEngine],
    operator: &mut Operator,
) -> Restoration {
    let mut restoration = Restoration::default();
    restoration.tasks.resize(plan.tasks.len(), None);
    let Some(Found { path, state, age_ns, cold, .. }) = found else { return restoration };
    let mut restored = Restored {
        file: path.clone(),
        age_ns: *age_ns,
        blocks: 0,
        inputs: 0,
        values: 0,
        unmatched: Vec::new(),
        unexpected: Vec::new(),
        cold: cold.clone(),
    };
    if restored.cold.is_none() {
        match state.warm_start(plan, engines) {
            Some(WarmTasks { tasks, gone }) => {
                restored.unmatched.extend(gone.iter().map(|task| format!("task {task}")));
                restoration.tasks.clear();
                for ((engine, task), warm) in engines.iter().zip(&plan.tasks).zip(tasks) {
                    restored.note(warm.as_ref());
                    let of_task = warm.map(|warm| RestoredTask::of(engine, task, &warm));
                    restoration.tasks.push(of_task);
                }
                restoration.recorded = Some(state.to_bytes());
            }
            None => {
                let why = "it is of a configuration that this program does not accept";
                restored.cold = Some(why.to_owned());
            }
        }
    }
    restoration.cold_start = restored.cold.as_ref().map(|why| cold_start(state, why));
    let RestoredValues { request, values, unexpected, .. } =
        operator.restore(&state.tuned, &restoration.first_cycles());
    (restored.values, restored.unexpected) = (values, unexpected);
    restoration.request = request;
    restoration.restored = Some(restored);
    restoration
}

impl NodeState {
    /// Has the engines of a plan go on from it, each with the state of the task of its name, if that was retained.
    /// `None`: the names in a state follow from its configuration, and this program does not accept that.
    pub fn warm_start(&self, plan: &Plan, engines: &mut [TaskEngine]) -> Option<WarmTasks> {
        let source = Source::new(self.file.clone(), self.configuration.clone());
        let before = plan.rules.plan(source).ok()?;
        let warm = |(engine, task): (&mut TaskEngine, &TaskPlan)| {
            let mut of_state = before.tasks.iter().zip(&self.tasks);
            let (before, state) = of_state.find(|(before, _)| before.name == task.name)?;
            Some(engine.warm_start(task, before, state.as_ref()?))
        };
        let tasks = engines.iter_mut().zip(&plan.tasks).map(warm).collect();
        let is_gone = |name: &str| plan.tasks.iter().all(|task| task.name != name);
        let gone = before.tasks.iter().filter(|task| is_gone(&task.name));
        Some(WarmTasks { tasks, gone: gone.map(|task| task.name.clone()).collect() })
    }
}

/// The tasks of a plan that go on from a state.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct WarmTasks {
    /// What each took over; `None`: its state was not retained.
    pub tasks: Vec<Option<WarmStart>>,
    /// Tasks of the state that the plan does not have.
    pub gone: Vec<String>,
}

impl Restored {
    /// What a node of this plan would take from the state in a file, if it started now; `None`: there is none.
    ///
    /// # Errors
    /// It cannot be read, is of another node, or is damaged and there is no whole one before it.
    pub fn preview(plan: &Plan, file: &StateFile) -> Result<Option<Self>, PrepareError> {
        let found = Found::look(file, &plan.node, plan.retain.unwrap_or_default())?;
        let mut engines = TaskEngine::build(plan)?;
        let mut operator = Operator::new(plan, Feeds::Services);
        Ok(restore(found.as_ref(), plan, &mut engines, &mut operator).restored)
    }

    fn note(&mut self, warm: Option<&WarmStart>) {
        let Some(warm) = warm else { return };
        self.blocks += warm.blocks;
        self.inputs += warm.inputs.len();
        self.unmatched.extend(warm.unmatched.iter().cloned());
    }
}

impl RestoredTask {
    fn of(engine: &TaskEngine, task: &TaskPlan, warm: &WarmStart) -> Self {
        let slot = |input: usize| task.input_slot(input, InputPart::Value);
        let value = |input: &usize| Some((*input, *engine.image().get(slot(*input))?));
        let inputs = warm.inputs.iter().filter_map(value).collect();
        Self { first_cycle: warm.first_cycle, inputs }
    }
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
        write!(f, "{blocks}, {inputs} and {values} from {}", file.display())?;
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
