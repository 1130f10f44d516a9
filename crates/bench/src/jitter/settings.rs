//! Settings of a bench of release jitter.

use std::sync::Arc;
use std::time::Duration;

use clap::ValueEnum;
use isochrone_engine::Plan;
use isochrone_machine::Machine;
use isochrone_runtime::TaskCpus;

use super::load::Load;
use crate::BenchError;

/// The arms that need no configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Loop {
    /// cyclictest's loop
    Sleep,
    /// The node's loop, up to a fifth of a CPU
    Hybrid,
    /// The node's loop, up to a tenth of a CPU
    Economical,
    /// Never sleeps
    Spin,
    /// The cyclictest program
    Cyclictest,
    /// A node whose peers stay: a reader and a writer of 1 value and of 1,000 values
    Quiet,
    /// The same node while 20 such peers join and leave each second
    Joins,
}

impl Loop {
    /// Its name on the command line and in reports.
    pub fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }
}

/// A whole node as an arm.
#[derive(Debug, Clone)]
pub struct NodeArm {
    /// Its name in reports.
    pub name: String,
    /// What it runs.
    pub plan: Arc<Plan>,
    /// Where its tasks run.
    pub cpus: TaskCpus,
}

/// A CPU on which every loop runs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ArmCpu {
    /// The CPU.
    pub cpu: usize,
    /// Why it is the best, of all or of several that were named.
    pub reason: Option<String>,
}

/// What all arms have in common, and which there are.
#[derive(Debug, Clone)]
pub struct JitterSettings {
    /// Loops; the others are compared with the first.
    pub loops: Vec<Loop>,
    /// Nodes as further arms.
    pub nodes: Vec<NodeArm>,
    /// Every arm runs at each, in ns.
    pub periods_ns: Vec<u64>,
    /// Every arm runs under each.
    pub loads: Vec<Load>,
    /// SCHED_FIFO priority; `None` for normal scheduling.
    pub priority: Option<u8>,
    /// Every loop runs on each.
    pub cpus: Vec<ArmCpu>,
    /// Where releases lie after the grid, in ns.
    pub phase_ns: u64,
    /// Time of each arm, at each period and under each load.
    pub time: Duration,
    /// Time of a turn.
    pub turn: Duration,
}

impl JitterSettings {
    /// The names of the arms, in their order.
    pub fn names(&self) -> Vec<String> {
        let nodes = self.nodes.iter().map(|node| node.name.clone());
        self.loops_on_cpus().map(|(arm, cpu)| self.loop_name(arm, cpu)).chain(nodes).collect()
    }

    /// Every loop on every CPU.
    pub(super) fn loops_on_cpus(&self) -> impl Iterator<Item = (Loop, &ArmCpu)> {
        self.loops.iter().flat_map(|arm| self.cpus.iter().map(|cpu| (*arm, cpu)))
    }

    /// The name of a loop's arm: `hybrid`, or `hybrid@1` where loops run on several CPUs.
    pub(super) fn loop_name(&self, arm: Loop, on: &ArmCpu) -> String {
        if self.cpus.len() > 1 { format!("{}@{}", arm.name(), on.cpu) } else { arm.name() }
    }

    /// Turns of each arm under each circumstance.
    pub(super) fn rounds(&self) -> usize {
        (self.time.as_secs_f64() / self.turn.as_secs_f64()).ceil().max(1.0) as usize
    }

    /// What is counted of a turn.
    pub(super) fn counted(&self) -> Duration {
        self.turn.min(self.time)
    }

    /// Sees that every name stands for one arm.
    ///
    /// # Errors
    /// It stands for two.
    pub fn check_names(&self) -> Result<(), BenchError> {
        let names = self.names();
        let twice = names
            .iter()
            .enumerate()
            .find(|(index, name)| names.iter().take(*index).any(|other| other == *name));
        twice.map_or(Ok(()), |(_, arm)| {
            Err(BenchError::Usage(format!(
                "there are two arms \"{arm}\"; give each once, and configurations other file names"
            )))
        })
    }
}

/// The CPUs that were asked for, or the one that is the best for one more thread
/// ([`choose`](isochrone_machine::Observation::choose)). Of several that were asked for, the best one has the
/// reason why it is.
///
/// # Errors
/// The process may not use one of them, or none at all.
pub fn find_cpus(wanted: &[usize], machine: &Machine) -> Result<Vec<ArmCpu>, BenchError> {
    let no_cpu =
        || BenchError::Failed("this process may use no CPU; widen its cpuset or taskset".into());
    let allowed = machine.bindable().ok_or_else(no_cpu)?;
    if let Some(cpu) = wanted.iter().copied().find(|cpu| !allowed.contains(cpu)) {
        let allowed: Vec<String> = allowed.iter().map(usize::to_string).collect();
        let allowed = allowed.join(", ");
        return Err(BenchError::Usage(format!(
            "there is no CPU {cpu} that this process may use; there are: {allowed}"
        )));
    }
    if let [only] = wanted {
        return Ok(vec![ArmCpu { cpu: *only, reason: None }]);
    }
    let choice = machine.observation().and_then(|observation| {
        let mut observation = observation.clone();
        observation.cpus.retain(|cpu| wanted.is_empty() || wanted.contains(&cpu.cpu));
        observation.choose()
    });
    if wanted.is_empty() {
        let choice = choice.ok_or_else(no_cpu)?;
        return Ok(vec![ArmCpu { cpu: choice.cpu, reason: Some(choice.to_string()) }]);
    }
    let reason = |cpu| Some(choice.as_ref().filter(|choice| choice.cpu == cpu)?.to_string());
    Ok(wanted.iter().map(|cpu| ArmCpu { cpu: *cpu, reason: reason(*cpu) }).collect())
}
