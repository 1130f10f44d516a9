//! The control nodes of a domain, and what they say of themselves.

use isochrone_control::{
    ClientError, DescribeResult, DescribedNode, RunningNode, describe_nodes, running_nodes,
};
use isochrone_ipc::{Participant, ipc};
use isochrone_processes::Stop;
use isochrone_runtime::{Conflict, Neighbours};
use serde::Serialize;

use crate::failure::Failure;
use crate::operate::silence;
use crate::terminal;

/// A node that runs tasks.
pub(super) struct ControlNode {
    pub(super) node: RunningNode,
    pub(super) description: Option<DescribeResult>,
    pub(super) state: State,
}

/// Whether a node tells what it does.
#[derive(Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum State {
    Answers,
    /// It takes no requests.
    Off,
    /// Its process is stopped.
    Stopped,
    /// It does not answer, though it is not stopped.
    Silent,
    /// It could not be asked.
    Unknown,
}

impl State {
    fn of(description: &Result<DescribeResult, ClientError>) -> Self {
        match description {
            Ok(_) => Self::Answers,
            Err(ClientError::NotOperated { .. }) => Self::Off,
            Err(ClientError::NoAnswer { is_stopped: true, .. }) => Self::Stopped,
            Err(ClientError::NoAnswer { .. }) => Self::Silent,
            Err(_) => Self::Unknown,
        }
    }
}

/// The control nodes, all asked for their tasks, no longer than `stop` allows. Notes which do not answer.
pub(super) fn control_nodes(
    participant: &Participant<ipc::Service>,
    stop: &Stop,
) -> Result<Vec<ControlNode>, Failure> {
    let described = describe_nodes(participant, |_| false, || stop.is_due());
    let control_node = |DescribedNode { node, description, .. }| {
        let state = State::of(&description);
        if let Err(error) = &description
            && state != State::Off
            && !matches!(error, ClientError::Interrupted { .. })
        {
            let (name, why) = (&node.name, silence(error));
            terminal::note(&format!("note: what node \"{name}\" does is not known: {why}"));
        }
        ControlNode { node, description: description.ok(), state }
    };
    Ok(described.map_err(Failure::found)?.into_iter().map(control_node).collect())
}

/// The names of the control nodes, one per line.
pub(super) fn names(participant: &Participant<ipc::Service>) -> Result<String, Failure> {
    let running = running_nodes(participant).map_err(Failure::found)?;
    Ok(running.iter().map(|node| format!("{}\n", node.name)).collect())
}

/// Which tasks of the nodes are in each other's way.
pub(super) fn conflicts(nodes: &[ControlNode]) -> Vec<Conflict> {
    let mut neighbours = Neighbours::default();
    for ControlNode { node, description, .. } in nodes {
        neighbours.add(&node.name, description.as_ref().map_or(&[], |known| &known.tasks));
    }
    Conflict::among(&neighbours.tasks)
}
