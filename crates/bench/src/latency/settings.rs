//! What a bench of latency is to do.

use std::time::Duration;

use super::arms::{Arm, Wait};
use super::circumstance::Circumstance;

/// What is measured, and how.
#[derive(Debug, Clone)]
pub struct Settings {
    /// By the number of values in a message.
    pub sizes: Vec<Size>,
    /// Turns of each arm under each circumstance.
    pub rounds: usize,
    /// Time of a turn, in ns.
    pub turn_ns: u64,
    /// How receivers wait.
    pub wait: Wait,
    /// CPUs of the two processes.
    pub cpus: Cpus,
    /// CPU of the node.
    pub node_cpu: usize,
    /// SCHED_FIFO priority of both; `None` for normal scheduling.
    pub priority: Option<u8>,
}

/// Messages of one size, and what is measured with them.
#[derive(Debug, Clone, PartialEq)]
pub struct Size {
    /// Values in a message.
    pub values: usize,
    /// One after the other.
    pub circumstances: Vec<Circumstance>,
}

/// The CPUs of the two processes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cpus {
    /// Of the one that sends.
    pub sender: usize,
    /// Of the one that measures.
    pub receiver: usize,
}

impl Settings {
    pub(super) fn turn(&self) -> Duration {
        Duration::from_nanos(self.turn_ns)
    }

    /// The names of the arms, each once.
    pub fn names(&self) -> Vec<&'static str> {
        let circumstances = self.sizes.iter().flat_map(|size| &size.circumstances);
        let mut names = Vec::new();
        for name in circumstances.flat_map(|some| &some.arms).map(|arm| arm.as_str()) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    /// How long all turns take.
    pub(super) fn total(&self) -> Duration {
        let circumstances = self.sizes.iter().flat_map(|size| &size.circumstances);
        let turns: usize = circumstances.map(|some| some.arms.len() * self.rounds).sum();
        self.turn() * turns as u32
    }

    /// An arm whose receiver watches for messages without ever sleeping, if there is one.
    pub fn polling_arm(&self) -> Option<Arm> {
        let circumstances = self.sizes.iter().flat_map(|size| &size.circumstances);
        let mut arms = circumstances.flat_map(|some| &some.arms);
        arms.find(|arm| self.wait == Wait::Poll || !arm.can_block()).copied()
    }
}
