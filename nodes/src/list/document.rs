//! The document of `list`: printed as JSON, and as text by the same rows.

use isochrone_control::{RedundancyDescription, TaskDescription};
use isochrone_ipc::{ListedNode, SignalSpec};
use isochrone_model::Access;
use isochrone_runtime::{Conflict, ConflictKind, CpuUser};
use serde::Serialize;

use super::control::{ControlNode, State};
use super::look::{ObservedService, Rate};

#[derive(Serialize)]
pub(super) struct Document<'a> {
    pub(super) control_nodes: Vec<ControlRow<'a>>,
    meetings: Vec<MeetingRow<'a>>,
    starved_sources: Vec<StarvedRow<'a>>,
    pub(super) nodes: &'a [ListedNode],
    pub(super) services: Vec<ServiceRow<'a>>,
}

/// A node that runs tasks.
#[derive(Serialize)]
pub(super) struct ControlRow<'a> {
    pub(super) name: &'a str,
    pub(super) pid: u32,
    program: &'a str,
    pub(super) state: State,
    pub(super) control: Option<Access>,
    pub(super) tasks: Option<&'a [TaskDescription]>,
    /// The two processes of a redundant node.
    pub(super) redundancy: Option<&'a RedundancyDescription>,
}

/// Two tasks that share a CPU and need it at the same time.
#[derive(Serialize)]
struct MeetingRow<'a> {
    cpu: u32,
    first: TaskName<'a>,
    second: TaskName<'a>,
    met: u64,
    of: u64,
    apart_ns: u64,
    overlap_ns: u64,
}

/// A task that keeps its source from sending.
#[derive(Serialize)]
struct StarvedRow<'a> {
    cpu: u32,
    follower: TaskName<'a>,
    source: TaskName<'a>,
    service: &'a str,
}

#[derive(Serialize)]
struct TaskName<'a> {
    node: &'a str,
    task: &'a str,
}

/// A service of frames.
#[derive(Serialize)]
pub(super) struct ServiceRow<'a> {
    pub(super) name: &'a str,
    pub(super) publishers: &'a [ListedNode],
    pub(super) subscribers: &'a [ListedNode],
    /// Whether another machine sends it.
    pub(super) is_far: Option<bool>,
    #[serde(flatten)]
    pub(super) rate: Rate,
    /// Of the newest frame; `None` if none came while looking.
    pub(super) flags: Option<Vec<String>>,
    layout: Option<String>,
    pub(super) signals: Option<&'a [SignalSpec]>,
    /// Who announces it.
    #[serde(skip)]
    pub(super) announced_by: Option<&'a str>,
}

impl<'a> Document<'a> {
    pub(super) fn of(
        control_nodes: &'a [ControlNode],
        conflicts: &'a [Conflict],
        nodes: &'a [ListedNode],
        services: &'a [ObservedService],
    ) -> Self {
        Self {
            control_nodes: control_nodes.iter().map(ControlRow::of).collect(),
            meetings: conflicts.iter().filter_map(MeetingRow::of).collect(),
            starved_sources: conflicts.iter().filter_map(StarvedRow::of).collect(),
            nodes,
            services: services.iter().map(ServiceRow::of).collect(),
        }
    }
}

impl<'a> ControlRow<'a> {
    fn of(ControlNode { node, description, state }: &'a ControlNode) -> Self {
        Self {
            name: &node.name,
            // Of a redundant node both processes publish telemetry, and the holder answers.
            pid: description
                .as_ref()
                .and_then(|known| known.redundancy.as_ref())
                .map_or(node.process, |redundancy| redundancy.holder),
            program: &node.program,
            state: *state,
            control: description.as_ref().map(|known| known.control),
            tasks: description.as_ref().map(|known| &*known.tasks),
            redundancy: description.as_ref().and_then(|known| known.redundancy.as_deref()),
        }
    }
}

impl<'a> MeetingRow<'a> {
    fn of(Conflict { cpu, first, second, kind, .. }: &'a Conflict) -> Option<Self> {
        let ConflictKind::Meeting(meeting) = kind else { return None };
        Some(Self {
            cpu: *cpu,
            first: TaskName::of(first),
            second: TaskName::of(second),
            met: meeting.met,
            of: meeting.of,
            apart_ns: meeting.apart_ns,
            overlap_ns: meeting.overlap_ns,
        })
    }
}

impl<'a> StarvedRow<'a> {
    fn of(Conflict { cpu, first, second, kind, .. }: &'a Conflict) -> Option<Self> {
        let ConflictKind::StarvedSource { service } = kind else { return None };
        let (follower, source) = (TaskName::of(first), TaskName::of(second));
        Some(Self { cpu: *cpu, follower, source, service })
    }
}

impl<'a> TaskName<'a> {
    fn of(task: &'a CpuUser) -> Self {
        Self { node: &task.node, task: &task.task }
    }
}

impl<'a> ServiceRow<'a> {
    fn of(found: &'a ObservedService) -> Self {
        let announced = found.announced.as_ref();
        Self {
            name: &found.service.name,
            publishers: &found.service.publishers,
            subscribers: &found.service.subscribers,
            is_far: found.is_far(),
            rate: found.rate,
            flags: found.flags.map(|flags| flags.words().collect()),
            layout: announced.map(|announced| format!("{:016x}", announced.number)),
            signals: found.signals(),
            announced_by: announced.map(|announced| &*announced.publisher),
        }
    }
}

#[cfg(test)]
mod tests {
    use isochrone_control::Followed;
    use serde_json::json;

    use super::super::control_text::tests::task;
    use super::*;

    #[test]
    fn a_starved_source_is_a_row_of_its_own_and_no_meeting() {
        let (source, mut follower) = (task("a", 200_000), task("b", 0));
        follower.placement.follow = Some(Followed { service: "a/out".into(), within_ns: 300_000 });
        let conflicts = Conflict::among(&[source, follower]);
        let document = Document::of(&[], &conflicts, &[], &[]);
        let document = serde_json::to_value(&document).unwrap();
        let expected = json!([{
            "cpu": 1,
            "follower": {"node": "b", "task": "fast"},
            "source": {"node": "a", "task": "fast"},
            "service": "a/out",
        }]);
        assert_eq!(document["starved_sources"], expected);
        assert_eq!(document["meetings"], json!([]));
    }
}
