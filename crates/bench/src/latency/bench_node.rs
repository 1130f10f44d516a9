//! The control nodes of a bench.

use std::fmt;

/// Values of a message through nodes.
pub(super) const NODE_VALUES: usize = 1;
/// What arms through nodes are paced at where nothing is asked for that they can have.
pub(super) const NODE_HZ: f64 = 1_000.0;
/// How long a node may take to start.
pub(super) const START_NS: u64 = 30_000_000_000;

/// A node that passes a value on, and limits how fast it changes, as a node would. `Display` is its
/// configuration.
#[derive(Debug, Clone, Copy)]
pub(super) struct BenchNode {
    pub(super) name: &'static str,
    pub(super) period_ns: u64,
    /// How long after its release it waits for a frame; `None`: it does not follow its input.
    pub(super) within_ns: Option<u64>,
    pub(super) input: &'static str,
    pub(super) output: &'static str,
    pub(super) place: NodePlace,
}

/// Where the nodes of a bench may run.
#[derive(Debug, Clone, Copy)]
pub(super) struct NodeSite {
    /// CPU of the process that sends.
    pub(super) sender_cpu: usize,
    /// CPU of the only node, and of the last one of several; that of the sender if there is no third one.
    pub(super) node_cpu: usize,
    /// SCHED_FIFO priority of all of them; `None` for normal scheduling.
    pub(super) priority: Option<u8>,
}

/// Where a node runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NodePlace {
    /// Its CPU.
    pub cpu: usize,
    /// Its SCHED_FIFO priority; `None` for normal scheduling.
    pub priority: Option<u8>,
}

impl fmt::Display for BenchNode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, period_ns, within_ns, input, output, place } = self;
        write!(
            f,
            "[node]\nname = \"{name}\"\n[[task]]\nname = \"fast\"\nperiod = \"{period_ns}ns\"\n\
             wake = \"hybrid\"\ncpu = {}\n",
            place.cpu
        )?;
        if let Some(priority) = place.priority {
            writeln!(f, "priority = {priority}")?;
        }
        if let Some(within_ns) = within_ns {
            writeln!(f, "follow = {{ service = \"{input}\", within = \"{within_ns}ns\" }}")?;
        }
        write!(
            f,
            r#"[[input]]
name = "value"
service = "{input}"
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
[block.in]
value = "value"
setChangeRate = 10.0
[[output]]
service = "{output}"
signals = ["value", "ramp.delayedValue"]
"#
        )
    }
}

impl fmt::Display for NodePlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "CPU {}", self.cpu)?;
        match self.priority {
            Some(priority) => write!(f, " (SCHED_FIFO {priority})"),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use isochrone_engine::config::Cpu;
    use isochrone_engine::{Plan, Rules, Source};

    use super::*;

    #[test]
    fn the_configurations_are_ones_that_run() {
        for (priority, within_ns) in [(None, None), (Some(80), Some(200_000)), (None, Some(1))] {
            let node = BenchNode {
                name: "latency",
                period_ns: 1_000_000,
                within_ns,
                input: "node/in",
                output: "node/out",
                place: NodePlace { cpu: 1, priority },
            };
            let source = Source::new("latency.toml", node.to_string());
            let plan = Plan::new(source, &Rules::default()).unwrap();
            assert!(plan.warnings.is_empty());
            let task = &plan.tasks[0];
            assert_eq!(task.settings.period_ns, 1_000_000);
            assert_eq!(task.settings.schedule().follow_within_ns, within_ns);
            assert_eq!((task.settings.cpu, task.settings.priority), (Cpu::Number(1), priority));
        }
    }
}
