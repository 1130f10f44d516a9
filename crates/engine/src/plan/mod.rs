//! A configuration, resolved: every name is an index, every wire a pair of slots, every block in
//! its place in the order.

mod advice;
mod alarms;
mod constants;
mod follow;
mod formulas;
mod labels;
mod layout;
mod names;
mod operate;
mod order;
mod parts;
mod pins;
mod probe;
mod rules;
mod slots;
mod suggest;
mod wires;

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

pub use follow::starves;
use isochrone_blocks::BlockType;
pub use labels::BlockLabels;
pub(crate) use names::MAX_INSTANCES;
pub use parts::{
    AlarmPlan, BankPlan, InputPart, InputPlan, Instances, LimitPlan, LinkPlan, OutputPlan,
    SignalPlan, TaskPlan, Upstream, VariablePlan, WirePlan,
};
pub use probe::first_error;
pub use rules::Rules;

use crate::{Diagnostic, Diagnostics, ReadError, Source, config, parse};
use isochrone_model::Access;

/// The rules that a plan was checked against, for another one that takes its place.
#[derive(Clone, Debug)]
pub struct OwnedRules {
    catalogue: Arc<[BlockType]>,
    service_name: fn(&str) -> Result<(), String>,
}

impl OwnedRules {
    fn of(rules: &Rules<'_>) -> Self {
        Self { catalogue: rules.catalogue.into(), service_name: rules.service_name }
    }

    /// As [`Plan::new`] with these rules.
    ///
    /// # Errors
    /// The configuration has errors, all of which are found together.
    pub fn plan(&self, source: Source) -> Result<Plan, Diagnostics> {
        let (catalogue, service_name) = (&*self.catalogue, self.service_name);
        Plan::new(source, &Rules { catalogue, service_name })
    }
}

/// Why there is no plan.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The configuration has errors.
    #[error(transparent)]
    Configuration(#[from] Diagnostics),
}

/// A node that can be run.
#[derive(Debug)]
#[non_exhaustive]
pub struct Plan {
    /// Name of the node.
    pub node: String,
    /// Its tasks in file order.
    pub tasks: Vec<TaskPlan>,
    /// Wires between tasks, one link for each pair of tasks.
    pub links: Vec<LinkPlan>,
    /// OB number and period in nanoseconds of every task that has a number.
    pub obs: Vec<(i16, u64)>,
    /// What others may do to the values of the running node.
    pub control: Access,
    /// What it retains over a restart; `None`: nothing.
    pub retain: Option<config::Retain>,
    /// Signals that nobody may set or force: names, or patterns of names.
    pub protected: Vec<String>,
    /// Bounds of parameters and variables.
    pub limits: Vec<LimitPlan>,
    /// What the file says of blocks for people, by their names; see [`labels`](Self::labels).
    pub block_labels: HashMap<String, BlockLabels>,
    /// Diagnostics about what is allowed but probably not intended.
    pub warnings: Vec<Diagnostic>,
    /// Diagnostics about what is probably intended, but worth knowing.
    pub notes: Vec<Diagnostic>,
    /// Where it was read from.
    pub source: Source,
    /// What it was checked against.
    pub rules: OwnedRules,
}

/// A limit whose range could be read.
fn limit(limit: &config::Limit) -> Option<LimitPlan> {
    let (min, max) = *limit.range.as_ref()?.get_ref();
    Some(LimitPlan { names: limit.names.get_ref().clone(), min, max })
}

/// The range of a variable, as `[limits]` would have it.
fn range(variable: &config::Variable) -> Option<LimitPlan> {
    let (min, max) = *variable.range.as_ref()?.get_ref();
    Some(LimitPlan { names: variable.name.as_ref()?.get_ref().clone(), min, max })
}

impl Plan {
    /// Checks and resolves a configuration. All errors are found together.
    ///
    /// Blocks of the library are stepped with their constants, to warn of those that make a block report
    /// an error from its first call. Blocks from elsewhere in [`Rules::catalogue`] are not stepped.
    pub fn new(source: Source, rules: &Rules<'_>) -> Result<Self, Diagnostics> {
        let (config, mut diagnostics) = parse::parse(&source, rules.catalogue);
        if diagnostics.iter().any(|diagnostic| diagnostic.problem == crate::Problem::Syntax) {
            return Err(Diagnostics::new(source, diagnostics));
        }
        let names = names::Names::resolve(&config, rules, &mut diagnostics);
        follow::check(&config, &names, &mut diagnostics);
        let wiring = wires::Wiring::resolve(&config, &names, &mut diagnostics);
        let depths = order::depths(&names, &wiring, &mut diagnostics);
        probe::constants(&names, &wiring, &mut diagnostics);
        operate::check(&config, &names, &wiring, &mut diagnostics);
        let labels = labels::Labels::resolve(&config, &names, &wiring, &mut diagnostics);
        if diagnostics.iter().any(|diagnostic| !diagnostic.is_warning()) {
            names.suggest(&mut diagnostics);
            return Err(Diagnostics::new(source, diagnostics));
        }
        // Only now: what an error keeps from being read is not the reader's choice.
        wiring.report_unread(&config, &mut diagnostics);
        let (tasks, links) = layout::lay_out(&config, &names, (&wiring, &labels), &depths);
        diagnostics.extend(follow::own_outputs(&tasks));
        diagnostics.extend(follow::starved_sources(&tasks));
        advice::feedback_without_effect(&config, &tasks, &links, &mut diagnostics);
        Ok(Self {
            node: config.node.as_ref().map(|node| node.get_ref().clone()).unwrap_or_default(),
            tasks,
            links,
            obs: names.obs(),
            control: config.control,
            retain: config.retain,
            protected: config.protected.iter().map(|name| name.get_ref().clone()).collect(),
            limits: config
                .limits
                .iter()
                .filter_map(limit)
                .chain(config.variables.iter().filter_map(range))
                .collect(),
            block_labels: labels.by_block(&names),
            warnings: diagnostics,
            notes: advice::without_service(&config)
                .into_iter()
                .chain(advice::without_max_age(&config))
                .chain(wiring.latched(&names))
                .chain(probe::cautions(&names, &wiring))
                .collect(),
            source,
            rules: OwnedRules::of(rules),
        })
    }

    /// Reads a configuration file, then as [`new`](Self::new).
    ///
    /// # Errors
    /// The file cannot be read, or its configuration has errors, all of which are found together.
    pub fn read(path: impl AsRef<Path>, rules: &Rules<'_>) -> Result<Self, PlanError> {
        Ok(Self::new(Source::read(path.as_ref())?, rules)?)
    }

    /// Warns of tasks that watch for another task's frames on its CPU and at its priority or a higher one:
    /// while they watch, it does not run. The plan's warnings have those that it had when it was made: after
    /// CPUs were chosen for tasks that leave theirs open, there may be more.
    pub fn starved_sources(&self) -> Vec<Diagnostic> {
        follow::starved_sources(&self.tasks)
    }

    /// Number of block instances. Alarms are none, though each is an instance of a bank.
    pub fn instances(&self) -> usize {
        let banks = self.tasks.iter().flat_map(|task| &task.banks);
        banks.map(|bank| bank.instances.len()).sum::<usize>() - self.alarms().count()
    }

    /// Its process alarms, task by task.
    pub fn alarms(&self) -> impl Iterator<Item = &AlarmPlan> {
        self.tasks.iter().flat_map(|task| &task.alarms)
    }

    /// Looks a task up by name.
    pub fn task_index(&self, name: &str) -> Option<usize> {
        self.tasks.iter().position(|task| task.name == name)
    }
}

isochrone_model::debug_as_display!(PlanError);
