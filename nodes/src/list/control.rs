//! The control nodes of a domain, and what they say of themselves.

use isochrone_engine::escaped;
use isochrone_ipc::{Participant, ipc};
use isochrone_processes::Stop;
use isochrone_report::Table;
use isochrone_runtime::control::{
    ClientError, DescribeResult, RunningNode, TaskDescription, running_nodes,
};
use isochrone_runtime::{Neighbour, Neighbours, SharedCpu};
use isochrone_timing::WarningCode;
use isochrone_timing::units::{counted, period};
use serde_json::{Value, json};

use super::{Rate, rate};
use crate::failure::Failure;
use crate::operate::described;
use crate::terminal;

/// A node that runs tasks.
pub(super) struct ControlNode {
    node: RunningNode,
    description: Option<DescribeResult>,
    /// Whether it is known to take no requests.
    is_off: bool,
}

/// The control nodes, each asked for its tasks, no longer than `stop` allows. Notes which do not answer.
pub(super) fn control_nodes(
    participant: &Participant<ipc::Service>,
    stop: &Stop,
) -> Result<Vec<ControlNode>, Failure> {
    let running = running_nodes(participant).map_err(Failure::found)?.into_iter();
    let ask = |node: RunningNode| {
        if stop.is_due() {
            return ControlNode { node, description: None, is_off: false };
        }
        let asked = described(participant, &node.name);
        let is_off = matches!(asked, Err(ClientError::NotOperated { .. }));
        if let Err(error) = &asked
            && !is_off
        {
            terminal::note(&format!(
                "note: what node \"{}\" does is not known: {error}",
                node.name
            ));
        }
        ControlNode { node, description: asked.ok(), is_off }
    };
    Ok(running.map(ask).collect())
}

/// The names of the control nodes, one per line.
pub(super) fn names(participant: &Participant<ipc::Service>) -> Result<String, Failure> {
    let running = running_nodes(participant).map_err(Failure::found)?;
    Ok(running.iter().map(|node| format!("{}\n", node.name)).collect())
}

pub(super) fn text(nodes: &[ControlNode]) -> String {
    if nodes.is_empty() {
        return String::new();
    }
    let mut text = counted(nodes.len(), "control node") + "\n";
    for ControlNode { node, description, is_off } in nodes {
        let access = match description {
            Some(known) => format!("{:?}", known.control).to_lowercase(),
            None if *is_off => "off".into(),
            None => "unknown".into(),
        };
        text += &format!("  {}  pid {}  control {access}\n", escaped(&node.name), node.process);
        let mut table = Table::default();
        for task in description.iter().flat_map(|known| &known.tasks) {
            table.row([
                &*escaped(&task.name),
                &rate(Rate::Announced { period_ns: task.period_ns }),
                &placed(task),
                &format!("cycle {}", task.cycle),
                &format!("{} missed", task.missed),
                &if task.forces > 0 { format!("{} forced", task.forces) } else { String::new() },
            ]);
        }
        text += &table.draw(4);
        for task in description.iter().flat_map(|known| &known.tasks) {
            let reason = task.placement.as_ref().and_then(|placed| placed.phase_reason.as_deref());
            if let Some(reason) = reason {
                text += &format!("    phase of {}: {}\n", escaped(&task.name), escaped(reason));
            }
        }
    }
    text + "\n"
}

/// Where a task is: its phase and CPU, as far as the node tells.
fn placed(task: &TaskDescription) -> String {
    let cpu = task.placement.as_ref().and_then(|placement| placement.cpu);
    let phase = (task.phase_ns > 0).then(|| format!("phase {}", period(task.phase_ns)));
    let words = cpu.map(|cpu| format!("CPU {cpu}")).into_iter().chain(phase);
    words.collect::<Vec<_>>().join(", ")
}

/// The tasks that share a CPU and need it at the same time.
pub(super) fn meetings(nodes: &[ControlNode]) -> Vec<SharedCpu> {
    let mut neighbours = Neighbours::default();
    for ControlNode { node, description, .. } in nodes {
        neighbours.add(&node.name, description.as_ref().map_or(&[], |known| &known.tasks));
    }
    SharedCpu::of_running(&neighbours.tasks)
}

pub(super) fn meetings_text(meetings: &[SharedCpu]) -> String {
    if meetings.is_empty() {
        return String::new();
    }
    let lines: String = meetings.iter().map(|meeting| format!("  {meeting}\n")).collect();
    format!(
        "{} on one CPU\n{lines}  remedy: {}\n\n",
        counted(meetings.len(), "meeting"),
        WarningCode::SharedCpu.remedy()
    )
}

pub(super) fn meetings_document(meetings: &[SharedCpu]) -> Value {
    let task = |task: &Neighbour| json!({"node": task.node, "task": task.task});
    let one = |SharedCpu { cpu, first, second, meeting }: &SharedCpu| {
        json!({
            "cpu": cpu,
            "first": task(first),
            "second": task(second),
            "met": meeting.met,
            "of": meeting.of,
            "apart_ns": meeting.apart_ns,
            "overlap_ns": meeting.overlap_ns,
        })
    };
    meetings.iter().map(one).collect()
}

pub(super) fn document(nodes: &[ControlNode]) -> Value {
    let one = |ControlNode { node, description, .. }: &ControlNode| {
        json!({
            "name": node.name,
            "pid": node.process,
            "program": node.program,
            "control": description.as_ref().map(|known| known.control),
            "tasks": description.as_ref().map(|known| &known.tasks),
        })
    };
    nodes.iter().map(one).collect()
}
