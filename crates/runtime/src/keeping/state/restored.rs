//! What a node takes from its state.

use std::collections::HashMap;
use std::fmt;
use std::path::PathBuf;

use isochrone_control::desk::{
    AlarmRecord, Feeds, Operator, PreparedRequest, RestoredValues, RetainedValue, Signals,
    Unexpected,
};
use isochrone_engine::orders::Store;
use isochrone_engine::{
    AlarmPlan, Diagnostics, Plan, Source, TaskEngine, TaskPlan, TaskState, WarmStart,
};
use isochrone_timing::units::{counted, duration};
use serde::{Serialize, Serializer};

use super::file::{StateFile, StoredState};
use super::node_state::{NodeState, RetainedTask, layout_of};
use super::retention::Found;
use crate::error::PrepareError;
use crate::node::alarms::Alarm;

/// What a node took from its state. `Display` is one line; what it serializes is what `state --json` says.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Restored {
    /// The file.
    #[serde(skip)]
    pub file: PathBuf,
    /// How old it was, in ns; `None`: it is of the future.
    #[serde(skip)]
    pub age_ns: Option<u64>,
    /// Blocks that go on where they stood.
    pub blocks: usize,
    /// Process alarms that do.
    pub alarms: usize,
    /// Inputs that begin with their last value.
    pub inputs: usize,
    /// Parameters and variables that are set as they were.
    pub values: usize,
    /// Blocks and inputs of the state that the configuration does not have, or has with another type.
    pub unmatched: Vec<String>,
    /// Alarms that begin anew, as their condition was edited.
    pub edited_alarms: Vec<String>,
    /// Alarms of which occurrences are lost that nobody has acknowledged.
    pub lost_alarms: Vec<String>,
    /// What was set in another configuration than this.
    #[serde(serialize_with = "sentences")]
    pub unexpected: Vec<Unexpected>,
    /// Which tasks start cold, and why, if some do.
    pub cold: Option<String>,
    /// SHA-256 of the configuration that it is of, if that is another one.
    #[serde(skip)]
    pub other: Option<String>,
}

fn sentences<S: Serializer>(of: &[Unexpected], to: S) -> Result<S::Ok, S::Error> {
    to.collect_seq(of.iter().map(ToString::to_string))
}

/// What is restored, and what the tasks need for it.
#[derive(Default)]
pub(crate) struct Restoration {
    /// The tasks that go on.
    pub(crate) warm: WarmTasks,
    /// Sets what was set.
    pub(crate) request: Option<PreparedRequest>,
    /// `None`: there was no state.
    pub(crate) restored: Option<Restored>,
    /// What was set, and is again.
    pub(crate) set: Vec<RetainedValue>,
    /// The alarm if blocks and inputs begin anew.
    pub(crate) cold_start: Option<Alarm>,
}

/// Has tasks find what was set in others with their first cycle, not only after the first cycle of those.
fn publish_set(set: &[RetainedValue], plan: &Plan, engines: &mut [TaskEngine]) {
    let signals = Signals::of(plan);
    let mut stores = vec![Vec::new(); engines.len()];
    for RetainedValue { name, value, .. } in set {
        let Ok(signal) = signals.find(name) else { continue };
        if let Some(stores) = stores.get_mut(signal.task) {
            stores.push(Store::new(signal.slot, f64::from_bits(*value)));
        }
    }
    let of_tasks = engines.iter_mut().zip(stores).filter(|(_, stores)| !stores.is_empty());
    of_tasks.for_each(|(engine, stores)| engine.publish_with(&stores));
}

/// Which tasks start cold, and why; `None`: none does.
fn in_words(cold: &[(String, String)]) -> Option<String> {
    let mut reasons: Vec<(&str, Vec<String>)> = Vec::new();
    for (task, why) in cold {
        match reasons.iter_mut().find(|(known, _)| known == why) {
            Some((_, tasks)) => tasks.push(format!("\"{task}\"")),
            None => reasons.push((why, vec![format!("\"{task}\"")])),
        }
    }
    let shown = reasons.iter().map(|(why, tasks)| {
        let plural = if tasks.len() == 1 { "" } else { "s" };
        format!("task{plural} {}: {why}", tasks.join(", "))
    });
    (!cold.is_empty()).then(|| shown.collect::<Vec<_>>().join("; "))
}

/// Has engines and operator of a plan go on where its state says.
pub(crate) fn restore(
    found: Option<&Found>,
    plan: &Plan,
    engines: &mut [TaskEngine],
    operator: &mut Operator,
) -> Restoration {
    let mut restoration = Restoration::default();
    restoration.warm.tasks.resize(plan.tasks.len(), None);
    let Some(found) = found else { return restoration };
    let Found { path, state, .. } = found;
    let is_other = *state.configuration != *plan.source.text;
    let mut restored = Restored {
        file: path.clone(),
        age_ns: found.age_ns(state.unix_ns),
        other: is_other.then(|| Source::new("", state.configuration.clone()).sha256()),
        blocks: 0,
        alarms: 0,
        inputs: 0,
        values: 0,
        unmatched: Vec::new(),
        edited_alarms: Vec::new(),
        lost_alarms: Vec::new(),
        unexpected: Vec::new(),
        cold: None,
    };
    match state.warm_start(plan, engines, |unix_ns| found.check_age(unix_ns)) {
        Ok(warm) => {
            restored.unmatched.extend(warm.gone.iter().map(|task| format!("task {task}")));
            restored.cold = in_words(&warm.cold);
            for WarmTask { warm, .. } in warm.tasks.iter().flatten() {
                restored.blocks += warm.blocks;
                restored.alarms += warm.alarms;
                restored.edited_alarms.extend(warm.edited.iter().cloned());
                restored.inputs += warm.inputs.len();
                restored.unmatched.extend(warm.unmatched.iter().cloned());
            }
            restoration.warm = warm;
        }
        Err(diagnostics) => {
            let first = diagnostics.all.first().map_or_else(String::new, |it| format!(": {it}"));
            restored.cold =
                Some(format!("this program does not accept the configuration of the state{first}"));
        }
    }
    restored.lost_alarms = lost_alarms(&state.alarms, &restoration.warm.alarms);
    restoration.cold_start = restored.cold.as_ref().map(|why| cold_start(state, why));
    let RestoredValues { request, values, unexpected, .. } =
        operator.restore(&state.tuned, &restoration.warm.first_cycles());
    publish_set(&values, plan, engines);
    (restored.values, restored.unexpected) = (values.len(), unexpected);
    (restoration.request, restoration.set) = (request, values);
    restoration.restored = Some(restored);
    restoration
}

/// The alarms with occurrences that nobody has acknowledged, and of which only the count is kept, or nothing.
fn lost_alarms(retained: &[AlarmRecord], kept: &[AlarmRecord]) -> Vec<String> {
    let is_lost = |record: &&AlarmRecord| record.unacknowledged() > 0 && !kept.contains(record);
    let shown = |record: &AlarmRecord| {
        let lost = counted(record.unacknowledged(), "unacknowledged occurrence");
        format!("{} ({lost})", record.name)
    };
    retained.iter().filter(is_lost).map(shown).collect()
}

impl NodeState {
    /// Has the engines of a plan go on from it, each with the state of the task of its name, if that was retained and
    /// `check` takes its time, in ns since 1970.
    ///
    /// # Errors
    /// The names in a state follow from its configuration, and this program does not accept that.
    pub fn warm_start(
        &self,
        plan: &Plan,
        engines: &mut [TaskEngine],
        check: impl Fn(u64) -> Result<(), String>,
    ) -> Result<WarmTasks, Diagnostics> {
        let source = Source::new(self.file.clone(), self.configuration.clone());
        let before = plan.rules.plan(source)?;
        let mut cold = Vec::new();
        let mut warm = |(engine, task): (&mut TaskEngine, &TaskPlan)| {
            let mut tasks = before.tasks.iter().enumerate();
            let (index, before) = tasks.find(|(_, before)| before.name == task.name)?;
            let retained = self.tasks.get(index).and_then(Option::as_ref);
            match fitting(retained, before).and_then(|it| check(it.unix_ns).map(|()| it)) {
                Ok(retained) => {
                    let warm = engine.warm_start(task, before, &retained.state);
                    Some(WarmTask { warm, from: index, unix_ns: retained.unix_ns })
                }
                Err(why) => {
                    cold.push((task.name.clone(), why));
                    None
                }
            }
        };
        let tasks = engines.iter_mut().zip(&plan.tasks).map(&mut warm).collect();
        let is_gone = |name: &str| plan.tasks.iter().all(|task| task.name != name);
        let gone = before.tasks.iter().filter(|task| is_gone(&task.name));
        let gone = gone.map(|task| task.name.clone()).collect();
        Ok(WarmTasks { tasks, gone, cold, alarms: self.alarms_of(plan, &before) })
    }

    /// Its alarms that another plan has by these names. Of those that have another definition there, only the count.
    fn alarms_of(&self, plan: &Plan, before: &Plan) -> Vec<AlarmRecord> {
        let before: HashMap<_, _> =
            before.alarms().map(|alarm| (alarm.name.as_str(), alarm)).collect();
        let is_same = |now: &AlarmPlan| {
            before.get(now.name.as_str()).is_some_and(|old| now.has_definition_of(old))
        };
        let now: HashMap<_, _> =
            plan.alarms().map(|now| (now.name.as_str(), is_same(now))).collect();
        let kept = |record: &AlarmRecord| match now.get(record.name.as_str())? {
            true => Some(record.clone()),
            false => Some(record.of_another_definition()),
        };
        self.alarms.iter().filter_map(kept).collect()
    }

    /// The part of it that was taken: of these tasks, and these values.
    pub(crate) fn only(mut self, taken: &[Option<WarmTask>], set: Vec<RetainedValue>) -> Self {
        for (index, task) in self.tasks.iter_mut().enumerate() {
            if !taken.iter().flatten().any(|taken| taken.from == index) {
                *task = None;
            }
        }
        Self { tuned: set, ..self }
    }

    /// Has tasks find what was set in others with their first cycle, as a node does before its start.
    pub fn publish_set(&self, plan: &Plan, engines: &mut [TaskEngine]) {
        publish_set(&self.tuned, plan, engines);
    }
}

/// A task that goes on from a state.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct WarmTask {
    /// What it took over.
    pub warm: WarmStart,
    /// Its index in the state.
    pub from: usize,
    /// When it had that state, in ns since 1970.
    pub unix_ns: u64,
}

/// What was retained of a task, if that is the state of such a task in this program.
fn fitting<'s>(
    retained: Option<&'s RetainedTask>,
    before: &TaskPlan,
) -> Result<&'s RetainedTask, String> {
    let retained = retained.ok_or("its state was not retained, for want of time")?;
    if retained.state.cycle.is_none() {
        return Err("no cycle of it was retained".to_owned());
    }
    let words = before.banks.iter();
    let words = words.map(|bank| bank.instances.len() * bank.block_type.state_words);
    let TaskState { image, state, .. } = &retained.state;
    let is_alike = retained.layout == layout_of(before)
        && (image.len(), state.len()) == (before.image.len(), words.sum());
    is_alike
        .then_some(retained)
        .ok_or_else(|| "this program has other blocks of these types".to_owned())
}

/// The tasks of a plan that go on from a state.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct WarmTasks {
    /// What each took over; `None`: it starts cold.
    pub tasks: Vec<Option<WarmTask>>,
    /// Tasks of the state that the plan does not have.
    pub gone: Vec<String>,
    /// Tasks of both that start cold, and why.
    pub cold: Vec<(String, String)>,
    /// What is taken over of alarms whose names are in both.
    pub alarms: Vec<AlarmRecord>,
}

impl WarmTasks {
    /// The number of the first cycle of each task.
    pub fn first_cycles(&self) -> Vec<u64> {
        let first = |task: &Option<WarmTask>| task.as_ref().map_or(0, |task| task.warm.first_cycle);
        self.tasks.iter().map(first).collect()
    }
}

impl Restored {
    /// What a node of this plan would take from the state that was read from a file, if it started now.
    ///
    /// # Errors
    /// It is of another node.
    pub fn preview(
        plan: &Plan,
        file: &StateFile,
        stored: StoredState,
    ) -> Result<Option<Self>, PrepareError> {
        let found = Found::of(file, stored, &plan.node, plan.retain.unwrap_or_default())?;
        let mut engines = TaskEngine::build(plan)?;
        let mut operator = Operator::new(plan, Feeds::Services);
        Ok(restore(Some(&found), plan, &mut engines, &mut operator).restored)
    }
}

fn cold_start(state: &NodeState, why: &str) -> Alarm {
    let node = &state.node;
    Alarm::ColdStart {
        reason: format!("node \"{node}\" starts cold, not from its retained state: {why}"),
    }
}

impl fmt::Display for Restored {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, age_ns, blocks, alarms, inputs, values, other, .. } = self;
        let (blocks, inputs) = (counted(*blocks as u64, "block"), counted(*inputs as u64, "input"));
        let values = counted(*values as u64, "set value");
        let alarms = match *alarms as u64 {
            0 => String::new(),
            count => format!(", {}", counted(count, "process alarm")),
        };
        write!(f, "{blocks}{alarms}, {inputs} and {values} from {}", file.display())?;
        if let Some(age_ns) = age_ns {
            write!(f, ", which is {} old", duration(*age_ns as f64))?;
        }
        if let Some(sha256) = other {
            let short = sha256.get(..12).unwrap_or(sha256);
            write!(f, ", of another configuration (sha256 {short}…)")?;
        }
        listed(f, "not in this configuration", &self.unmatched)?;
        listed(f, "its condition was edited", &self.edited_alarms)?;
        listed(f, "lost", &self.lost_alarms)
    }
}

/// Some names, if there are any.
fn listed(f: &mut fmt::Formatter<'_>, what: &str, names: &[String]) -> fmt::Result {
    /// Names that are shown.
    const NAMED: usize = 8;
    if names.is_empty() {
        return Ok(());
    }
    let named: Vec<_> = names.iter().take(NAMED).map(String::as_str).collect();
    write!(f, "; {what}: {}", named.join(", "))?;
    match names.len().saturating_sub(NAMED) {
        0 => Ok(()),
        more => write!(f, " and {more} more"),
    }
}
