//! The control nodes of a domain, and what they say of themselves.

use isochrone_engine::escaped;
use isochrone_ipc::{Participant, ipc};
use isochrone_processes::Stop;
use isochrone_runtime::control::{DescribeResult, RunningNode, running_nodes};
use isochrone_timing::units::counted;
use serde_json::{Value, json};

use super::{Rate, rate};
use crate::failure::Failure;
use crate::operate::described;
use crate::table::Table;

/// A node that runs tasks.
pub(super) struct ControlNode {
    node: RunningNode,
    /// `None` if it takes no requests.
    description: Option<DescribeResult>,
}

/// The control nodes, each asked for its tasks, no longer than `stop` allows.
pub(super) fn control_nodes(
    participant: &Participant<ipc::Service>,
    stop: &Stop,
) -> Result<Vec<ControlNode>, Failure> {
    let running = running_nodes(participant).map_err(Failure::found)?.into_iter();
    let ask = |node: RunningNode| {
        let description = if stop.is_due() { None } else { described(participant, &node.name) };
        ControlNode { node, description }
    };
    Ok(running.map(ask).collect())
}

/// The names of the control nodes, one a line.
pub(super) fn names(participant: &Participant<ipc::Service>) -> Result<String, Failure> {
    let running = running_nodes(participant).map_err(Failure::found)?;
    Ok(running.iter().map(|node| format!("{}\n", node.name)).collect())
}

pub(super) fn text(nodes: &[ControlNode]) -> String {
    if nodes.is_empty() {
        return String::new();
    }
    let mut text = counted(nodes.len(), "control node") + "\n";
    for ControlNode { node, description } in nodes {
        let access =
            description.as_ref().map(|known| format!("{:?}", known.control).to_lowercase());
        let access = access.unwrap_or_else(|| "off".into());
        text += &format!("  {}  pid {}  control {access}\n", escaped(&node.name), node.process);
        let mut table = Table::default();
        for task in description.iter().flat_map(|known| &known.tasks) {
            table.row([
                &*escaped(&task.name),
                &rate(Rate::Announced { period_ns: task.period_ns }),
                &format!("cycle {}", task.cycle),
                &format!("{} missed", task.missed),
                &if task.forces > 0 { format!("{} forced", task.forces) } else { String::new() },
            ]);
        }
        text += &table.draw(4);
    }
    text + "\n"
}

pub(super) fn document(nodes: &[ControlNode]) -> Value {
    let one = |ControlNode { node, description }: &ControlNode| {
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
