//! A configuration, resolved: every name is an index, every wire a pair of slots, every block in
//! its place in the order.

mod advice;
mod constants;
mod follow;
mod layout;
mod names;
mod operate;
mod order;
mod pins;
mod probe;
mod suggest;
mod wires;

use std::path::Path;
use std::sync::Arc;

use isochrone_blocks::{BlockType, CATALOGUE, PinType};
use isochrone_schedule::Schedule;
pub(crate) use names::MAX_INSTANCES;
pub(crate) use probe::first_error;

use crate::config::{Bad, Binding, Control, Cpu, OnStale, PhaseChoice};
use crate::{Finding, Findings, ReadError, Source, config, parse};

/// What a configuration is checked against beside itself.
pub struct Rules<'a> {
    /// The block types that it may name.
    pub catalogue: &'a [BlockType],
    /// Whether the transport can carry a service of this name; `Err` says why not.
    pub service_name: fn(&str) -> Result<(), String>,
}

impl Default for Rules<'_> {
    /// The library's blocks, and any service name that is not empty.
    fn default() -> Self {
        Self {
            catalogue: CATALOGUE,
            service_name: |name| match name {
                "" => Err("it is empty".into()),
                _ => Ok(()),
            },
        }
    }
}

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
    pub fn plan(&self, source: Source) -> Result<Plan, Findings> {
        let (catalogue, service_name) = (&*self.catalogue, self.service_name);
        Plan::new(source, &Rules { catalogue, service_name })
    }
}

/// Why there is no plan.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// The file cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The configuration has errors.
    #[error(transparent)]
    Configuration(#[from] Findings),
}

/// A node that can be run.
#[derive(Debug)]
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
    pub control: Control,
    /// Signals that nobody may set or force: names, or patterns of names.
    pub protected: Vec<String>,
    /// Bounds of parameters.
    pub limits: Vec<LimitPlan>,
    /// What is allowed but hardly meant.
    pub warnings: Vec<Finding>,
    /// What is meant more often than not, and worth knowing.
    pub notes: Vec<Finding>,
    /// Where it was read from.
    pub source: Source,
    /// What it was checked against.
    pub rules: OwnedRules,
}

/// Bounds of parameters that are set or forced.
#[derive(Clone, Debug, PartialEq)]
pub struct LimitPlan {
    /// Name of a parameter, or a pattern of such names.
    pub names: String,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
}

/// One task: when it runs, and its process image.
#[derive(Debug)]
pub struct TaskPlan {
    /// Unique name.
    pub name: String,
    /// When it is due, how it waits, what it does about releases that were missed.
    pub schedule: Schedule,
    /// Who chose the phase of the schedule.
    pub phase_choice: PhaseChoice,
    /// OB number, if it has one.
    pub ob: Option<i16>,
    /// SCHED_FIFO priority, 1 to 89; `None`: normal scheduling.
    pub priority: Option<u8>,
    /// Where its thread runs.
    pub cpu: Cpu,
    /// The service of some of its inputs whose frames its cycles begin with, at the latest
    /// [`follow_within_ns`](Schedule::follow_within_ns) after their releases.
    pub followed_service: Option<String>,
    /// Place of that service's name in the file.
    pub followed_span: Option<std::ops::Range<usize>>,
    /// Its inputs, which stand first in the image: their values, then their `ok`, then their `age`.
    pub inputs: Vec<InputPlan>,
    /// Its outputs in file order.
    pub outputs: Vec<OutputPlan>,
    /// Its blocks in the order in which they step.
    pub banks: Vec<BankPlan>,
    /// Copies of values of the cycle before, done before any block steps.
    pub previous: Vec<WirePlan>,
    /// The image before the first cycle: constants and defaults.
    pub image: Vec<f64>,
}

/// One value that another process publishes.
#[derive(Clone, Debug, PartialEq)]
pub struct InputPlan {
    /// Unique name.
    pub name: String,
    /// Type of its samples.
    pub value_type: PinType,
    /// Service that carries it; needed only to run.
    pub service: Option<String>,
    /// Where it is in the service's frame.
    pub binding: Binding,
    /// Value before the first sample.
    pub default: f64,
    /// Age in nanoseconds beyond which it is stale.
    pub max_age_ns: Option<u64>,
    /// What it reads when it is stale.
    pub on_stale: OnStale,
    /// What a frame that is in doubt is taken for.
    pub bad: Bad,
    /// It closes a loop of nodes, so that nothing of what its samples are worth is handed on.
    pub feedback: bool,
    /// Place of its name in the file, for errors that only running can find.
    pub span: std::ops::Range<usize>,
}

/// One frame that the node publishes every cycle of the task.
#[derive(Debug)]
pub struct OutputPlan {
    /// Its place among the outputs of the file, from 0.
    pub position: usize,
    /// Service that carries it.
    pub service: String,
    /// Its channels.
    pub signals: Vec<SignalPlan>,
    /// What it is computed from.
    pub upstream: Upstream,
}

/// What values are computed from, within their task.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Upstream {
    /// The task's inputs by their index, and behind them the values of its incoming links, in the
    /// order of the image.
    pub sources: Vec<usize>,
    /// Blocks.
    pub blocks: Vec<Instances>,
}

/// Some of a bank's instances, one after the other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Instances {
    /// Index of the bank in the task.
    pub bank: usize,
    /// Which of the bank's instances.
    pub range: std::ops::Range<usize>,
}

/// One channel of a frame.
#[derive(Debug)]
pub struct SignalPlan {
    /// As written: `block.pin`.
    pub name: String,
    /// Type of the value.
    pub value_type: PinType,
    /// Where it stands in the image.
    pub slot: usize,
}

/// Instances of one type at one depth, which step in one loop.
#[derive(Debug)]
pub struct BankPlan {
    /// Their type.
    pub block_type: BlockType,
    /// Longest path of wires that leads here.
    pub depth: usize,
    /// First slot of the first instance.
    pub first_slot: usize,
    /// Their names, in order.
    pub instances: Arc<[String]>,
    /// Copies into the bank's slots, done before it steps.
    pub wires: Vec<WirePlan>,
}

/// Most blocks of a bank that a message names.
const MOST_NAMED: usize = 8;

impl BankPlan {
    /// Its blocks for a message that cannot say which of them is meant: `"first" or "second" (Pid)`.
    pub fn any_block(&self) -> String {
        let mut names: Vec<_> =
            self.instances.iter().take(MOST_NAMED).map(|name| format!("\"{name}\"")).collect();
        let others = self.instances.len() - names.len();
        if others > 0 {
            names.push(format!("{others} more"));
        }
        format!("{} ({})", names.join(" or "), self.block_type.name)
    }
}

/// A copy of one slot of the image to another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WirePlan {
    /// Slot to copy from.
    pub from: u32,
    /// Slot to copy to.
    pub to: u32,
}

/// Values that one task hands to another after each of its cycles.
#[derive(Debug)]
pub struct LinkPlan {
    /// Index of the task that computes them.
    pub from: usize,
    /// Index of the task that reads them.
    pub to: usize,
    /// Their slots in the image of the first.
    pub slots: Vec<u32>,
    /// Their first slot in the image of the second; the others follow.
    pub first_slot: usize,
    /// For each of them what it is computed from in the first task.
    pub upstream: Vec<Upstream>,
}

/// What an input brings: its value, and what that is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum InputPart {
    /// What it reads, of its own type.
    Value,
    /// `NAME.ok`, a BOOL: whether that is a sample, fresh and good.
    Ok,
    /// `NAME.age`, an LREAL: how old the sample is, in seconds.
    Age,
}

impl InputPart {
    /// All parts, in the order in which they stand in an image.
    pub const ALL: [Self; 3] = [Self::Value, Self::Ok, Self::Age];

    /// What stands behind the input's name: nothing, `.ok` or `.age`.
    pub const fn suffix(self) -> &'static str {
        match self {
            Self::Value => "",
            Self::Ok => ".ok",
            Self::Age => ".age",
        }
    }

    /// Its type, where the input is of `value_type`.
    pub const fn pin_type(self, value_type: PinType) -> PinType {
        match self {
            Self::Value => value_type,
            Self::Ok => PinType::Bool,
            Self::Age => PinType::Lreal,
        }
    }
}

impl TaskPlan {
    /// Where a part of an input stands in the image.
    pub fn input_slot(&self, input: usize, part: InputPart) -> usize {
        part as usize * self.inputs.len() + input
    }

    /// How many slots the inputs take, which is the first slot of what comes from other tasks.
    pub fn input_slots(&self) -> usize {
        InputPart::ALL.len() * self.inputs.len()
    }

    /// The input and the part of it that a slot holds, if it holds one.
    pub fn input_at(&self, slot: usize) -> Option<(usize, InputPart)> {
        let input = slot.checked_rem(self.inputs.len())?;
        Some((input, *InputPart::ALL.get(slot / self.inputs.len())?))
    }

    /// Which of the task's sources a value from another task is, by its slot.
    pub(crate) fn import_source(&self, slot: usize) -> usize {
        slot - self.input_slots() + self.inputs.len()
    }
}

/// A limit whose range could be read.
fn limit(limit: &config::Limit) -> Option<LimitPlan> {
    let (min, max) = *limit.range.as_ref()?.get_ref();
    Some(LimitPlan { names: limit.names.get_ref().clone(), min, max })
}

impl LinkPlan {
    /// Whether the link writes a slot of its reader's image.
    pub fn carries_to(&self, slot: u32) -> bool {
        (self.first_slot..self.first_slot + self.slots.len()).contains(&(slot as usize))
    }
}

impl Plan {
    /// Checks and resolves a configuration. All errors are found together.
    ///
    /// Blocks of the library are stepped with their constants, to warn of those that make a block report
    /// an error from its first call. Blocks from elsewhere in [`Rules::catalogue`] are not stepped.
    pub fn new(source: Source, rules: &Rules<'_>) -> Result<Self, Findings> {
        let (config, mut findings) = parse::parse(&source, rules.catalogue);
        if findings.iter().any(|finding| finding.problem == crate::Problem::Syntax) {
            return Err(Findings::new(source, findings));
        }
        let names = names::Names::resolve(&config, rules, &mut findings);
        follow::check(&config, &names, &mut findings);
        let wiring = wires::Wiring::resolve(&config, &names, &mut findings);
        let depths = order::depths(&names, &wiring, &mut findings);
        probe::constants(&names, &wiring, &mut findings);
        operate::check(&config, &names, &wiring, &mut findings);
        if findings.iter().any(|finding| !finding.is_warning()) {
            names.suggest(&mut findings);
            return Err(Findings::new(source, findings));
        }
        // Only now: what an error keeps from being read is not the reader's choice.
        wiring.report_unread(&config, &mut findings);
        let (tasks, links) = layout::lay_out(&config, &names, &wiring, &depths);
        findings.extend(follow::starved_sources(&tasks));
        advice::feedback_without_effect(&config, &tasks, &links, &mut findings);
        Ok(Self {
            node: config.node.as_ref().map(|node| node.get_ref().clone()).unwrap_or_default(),
            tasks,
            links,
            obs: names.obs(),
            control: config.control,
            protected: config.protected.iter().map(|name| name.get_ref().clone()).collect(),
            limits: config.limits.iter().filter_map(limit).collect(),
            warnings: findings,
            notes: advice::without_max_age(&config)
                .into_iter()
                .chain(wiring.latched(&names))
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
    pub fn starved_sources(&self) -> Vec<Finding> {
        follow::starved_sources(&self.tasks)
    }

    /// Number of block instances.
    pub fn instances(&self) -> usize {
        self.tasks.iter().flat_map(|task| &task.banks).map(|bank| bank.instances.len()).sum()
    }

    /// The output pin or input that a slot of a task's image holds, as a wire would name it, or the
    /// input pin that it belongs to.
    pub fn slot_name(&self, task: usize, slot: usize) -> String {
        self.find_slot_name(task, slot).unwrap_or_default()
    }

    fn find_slot_name(&self, task: usize, slot: usize) -> Option<String> {
        let plan = self.tasks.get(task)?;
        if let Some((input, part)) = plan.input_at(slot) {
            return Some(format!("{}{}", plan.inputs.get(input)?.name, part.suffix()));
        }
        let bank = plan.banks.partition_point(|bank| bank.first_slot <= slot);
        if let Some(bank) = bank.checked_sub(1).and_then(|bank| plan.banks.get(bank)) {
            let (stride, offset) = (bank.block_type.slots(), slot - bank.first_slot);
            let mut pins = bank.block_type.inputs.iter().chain(bank.block_type.outputs);
            let pin = pins.nth(offset % stride)?;
            return Some(format!("{}.{}", bank.instances.get(offset / stride)?, pin.name));
        }
        let link = self.links.iter().rfind(|link| link.to == task && link.first_slot <= slot)?;
        let from = *link.slots.get(slot - link.first_slot)?;
        self.find_slot_name(link.from, from as usize)
    }

    /// Looks a task up by name.
    pub fn task_index(&self, name: &str) -> Option<usize> {
        self.tasks.iter().position(|task| task.name == name)
    }
}
