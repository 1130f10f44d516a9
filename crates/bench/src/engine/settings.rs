//! Settings of a bench of the engine.

use std::time::Duration;

use isochrone_blocks::BlockType;
use isochrone_engine::Workload;

/// A size, and the arms that take turns at it.
#[derive(Debug, Clone)]
pub struct TaskSize {
    /// Instances in a task.
    pub instances: usize,
    /// What the tasks consist of.
    pub workloads: Vec<Workload>,
}

/// What is measured, and how.
#[derive(Debug, Clone)]
pub struct EngineSettings<'a> {
    /// The block types that there are.
    pub catalogue: &'a [BlockType],
    /// One after the other.
    pub sizes: Vec<TaskSize>,
    /// Time of each arm at each size, in s.
    pub seconds: f64,
    /// SCHED_FIFO priority; `None` for normal scheduling.
    pub priority: Option<u8>,
    /// CPU to pin to, if any.
    pub cpu: Option<usize>,
}

impl EngineSettings<'_> {
    /// The names of the arms, each once.
    pub fn names(&self) -> Vec<&'static str> {
        let mut names = Vec::new();
        for name in self.sizes.iter().flat_map(|size| &size.workloads).map(Workload::name) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    /// How long to measure, without warming up and building.
    pub fn total(&self) -> Duration {
        let turns: usize = self.sizes.iter().map(|size| size.workloads.len()).sum();
        let seconds = turns as f64 * self.seconds;
        Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX)
    }
}
