//! What a bench of release jitter is to do.

use std::sync::Arc;
use std::time::Duration;

use clap::ValueEnum;
use isochrone_engine::Plan;

use super::load::Load;
use crate::{BenchError, allowed_cpus};

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
}

/// What all arms have in common, and which there are.
#[derive(Debug, Clone)]
pub struct Settings {
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
    /// CPU of all arms.
    pub cpu: usize,
    /// Where releases lie after the grid, in ns.
    pub phase_ns: u64,
    /// Time of each arm, at each period and under each load.
    pub time: Duration,
    /// Time of a turn.
    pub turn: Duration,
}

impl Settings {
    /// The names of the arms, in their order.
    pub fn names(&self) -> Vec<String> {
        let nodes = self.nodes.iter().map(|node| node.name.clone());
        self.loops.iter().map(|arm| arm.name()).chain(nodes).collect()
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
        twice.map_or(Ok(()), |(_, arm)| Err(BenchError::TwoArms { arm: arm.clone() }))
    }
}

/// The CPU that was asked for, or the last one that this process may use.
///
/// # Errors
/// It may not use that one, or none.
pub fn find_cpu(wanted: Option<usize>) -> Result<usize, BenchError> {
    let allowed = allowed_cpus()?;
    match wanted {
        Some(wanted) if allowed.contains(&wanted) => Ok(wanted),
        Some(cpu) => {
            let there: Vec<String> = allowed.iter().map(usize::to_string).collect();
            Err(BenchError::NoSuchCpu { cpu, allowed: there.join(", ") })
        }
        None => allowed.last().copied().ok_or(BenchError::NoCpu),
    }
}
