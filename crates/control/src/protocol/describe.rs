//! The node, its tasks and its configuration.

use isochrone_model::Followed;
use isochrone_timing::Summary;
use serde::{Deserialize, Serialize};

use crate::Access;

params! {
    /// Parameters of `describe`: none.
    Describe: looks DescribeParams -> DescribeResult {}
}

/// Result of `describe`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DescribeResult {
    /// Its name.
    pub node: String,
    /// The version of isochrone.
    pub version: String,
    /// What operators may do.
    pub control: Access,
    /// Its configuration.
    pub configuration: ConfigurationOrigin,
    /// When it started, ns of UTC since 1970.
    pub started_unix_ns: u64,
    /// How often a publisher has announced another unit than before for an input; `signals` may then say another.
    #[serde(default)]
    pub announced_units: u64,
    /// Its tasks, in the order of the configuration.
    pub tasks: Vec<TaskDescription>,
    /// The two processes of a node that runs with `--redundant`; `None`: it does not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub redundancy: Option<Box<RedundancyDescription>>,
}

/// The two processes of a node.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RedundancyDescription {
    /// The process that holds the node.
    pub holder: u32,
    /// The process that stands by; `None`: none follows.
    pub standby: Option<u32>,
    /// Whether it can take over.
    pub is_complete: bool,
    /// How many cycles of the first task it is behind.
    pub behind_cycles: Option<u64>,
    /// How often the node was taken over since the first of its processes started.
    pub takeovers: u64,
    /// The last time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last_takeover: Option<LastTakeover>,
}

/// How a node was taken over.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct LastTakeover {
    /// When, ns of UTC since 1970.
    pub unix_ns: u64,
    /// Whether the holder handed it over (`switch`); if not, it was silent.
    pub was_asked: bool,
    /// For how many cycles of the task that noticed it there are no frames.
    pub lost_cycles: u64,
}

/// The configuration of a node.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ConfigurationOrigin {
    /// The file, as it was given.
    pub file: String,
    /// SHA-256 of its text, hexadecimal.
    pub sha256: String,
    /// The same of the text that the node was started with, before any `apply`; `None`: the node does not say.
    #[serde(default)]
    pub started_sha256: Option<String>,
    /// Whether a value or the configuration was changed since.
    pub changed: bool,
}

/// A task of `describe`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TaskDescription {
    /// Its name.
    pub name: String,
    /// Its OB number, by which a `callOB` can name it; `None`: it has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ob: Option<i16>,
    /// From release to release, ns.
    pub period_ns: u64,
    /// Of its first release after that of the grid, ns.
    pub phase_ns: u64,
    /// The cycle that is due now by the clock.
    pub cycle: u64,
    /// The last cycle that it has run; `None`: none is known yet.
    #[serde(default)]
    pub last_cycle: Option<u64>,
    /// How long it has not run although it should have, ns: it hangs, or the node is held up. `None`: it runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stands_ns: Option<u64>,
    /// Cycles that did not run.
    pub missed: u64,
    /// Cycles that did not end before the next release.
    pub overruns: u64,
    /// How many parameters it has.
    pub parameters: u64,
    /// How many of its signals are forced.
    pub forces: u64,
    /// How many alarms it has.
    #[serde(default)]
    pub alarms: u64,
    /// The timing of all of its cycles in the last second; `None`: the first second is not over, it stands, or the
    /// node's version does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last_second: Option<LastSecond>,
    /// When it needs which CPU; `None`: the node's version does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub placement: Option<Placement>,
}

/// The timing of all cycles that began within a second. Times in ns.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LastSecond {
    /// How many cycles.
    pub cycles: u64,
    /// How late they began.
    pub release_jitter_ns: Summary,
    /// How long they took, mean.
    pub execution_ns: f64,
}

/// When a task needs which CPU. Times in ns.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Placement {
    /// The CPU that it is pinned to; `None`: it may move.
    pub cpu: Option<u32>,
    /// What the kernel granted: `other`, or `fifo:80` with real-time priority 80.
    pub scheduler: String,
    /// How it waits for a release: `sleep`, `hybrid` or `spin`.
    pub wake: String,
    /// When its first cycle was due, on `CLOCK_MONOTONIC`.
    pub first_release_ns: u64,
    /// The longest that it watches the clock before a release.
    pub longest_watch_ns: u64,
    /// From a release to the end of its cycle, median of the last 63 cycles; `None`: no cycle was seen yet.
    pub response_ns: Option<u64>,
    /// Why it has its phase, if `phase = "auto"` chose it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub phase_reason: Option<String>,
    /// Why that CPU was chosen; `None` if the configuration names it, or leaves the thread to the kernel.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cpu_reason: Option<String>,
    /// What its cycles begin with, if it follows a service.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub follow: Option<Followed>,
    /// The services that it publishes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sends: Vec<String>,
}

impl Placement {
    /// How long after a release the task watches for a frame, ns.
    pub fn follow_within_ns(&self) -> u64 {
        self.follow.as_ref().map_or(0, |follow| follow.within_ns)
    }
}

/// An example with every member that a result can have.
#[cfg(test)]
pub(super) fn example() -> DescribeResult {
    let placement = Placement {
        cpu: None,
        scheduler: "other".into(),
        wake: "sleep".into(),
        first_release_ns: 0,
        longest_watch_ns: 0,
        phase_reason: None,
        cpu_reason: None,
        response_ns: None,
        follow: Some(Followed { service: String::new(), within_ns: 0 }),
        sends: vec![String::new()],
    };
    let task = TaskDescription {
        name: String::new(),
        ob: Some(0),
        period_ns: 0,
        phase_ns: 0,
        cycle: 0,
        last_cycle: Some(0),
        stands_ns: Some(0),
        missed: 0,
        overruns: 0,
        parameters: 0,
        forces: 0,
        alarms: 0,
        last_second: Some(LastSecond {
            cycles: 0,
            release_jitter_ns: Summary::default(),
            execution_ns: 0.0,
        }),
        placement: Some(placement),
    };
    DescribeResult {
        node: String::new(),
        version: String::new(),
        control: Access::Set,
        configuration: ConfigurationOrigin {
            file: String::new(),
            sha256: String::new(),
            started_sha256: None,
            changed: false,
        },
        announced_units: 0,
        started_unix_ns: 0,
        tasks: vec![task],
        redundancy: Some(Box::new(RedundancyDescription {
            holder: 1,
            standby: Some(2),
            is_complete: true,
            behind_cycles: Some(0),
            takeovers: 1,
            last_takeover: Some(LastTakeover { unix_ns: 0, was_asked: false, lost_cycles: 1 }),
        })),
    }
}
