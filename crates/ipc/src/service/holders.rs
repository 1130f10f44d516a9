//! The nodes that hold the places of a service.

use iceoryx2::identifiers::UniqueNodeId;
use iceoryx2::node::{NodeListFailure, NodeState, NodeView};
use iceoryx2::prelude::CallbackProgression;
use iceoryx2::service::port_factory::PortFactory;

use super::{Element, Header, Opened};
use crate::{ListedNode, Service, is_stopped};

/// A node that has the service open, for messages.
pub(crate) fn node(opened: &impl PortFactory, id: UniqueNodeId) -> String {
    match details(opened, id) {
        None => format!("a node that does not tell its name (id {id})"),
        // SIGTERM would wait until it is continued.
        Some(node) if is_stopped(node.pid) => format!(
            "{node}, which is stopped (kill -CONT {pid} continues it, kill -KILL {pid} ends it)",
            pid = node.pid
        ),
        Some(node) => node.to_string(),
    }
}

/// A node that has the service open; `None` if it has no name, or the nodes cannot be listed.
pub(crate) fn details(opened: &impl PortFactory, id: UniqueNodeId) -> Option<ListedNode> {
    let mut found = None;
    let _ = opened.nodes(|state| {
        let details = match &state {
            NodeState::Alive(node) if *node.id() == id => node.details(),
            NodeState::Dead(node) if *node.id() == id => node.details(),
            _ => return CallbackProgression::Continue,
        };
        found = details.as_ref().map(ListedNode::of);
        CallbackProgression::Stop
    });
    found
}

/// The process id of another live node of this name that has the service open.
pub(crate) fn other_of_name(
    opened: &impl PortFactory,
    own: UniqueNodeId,
    name: &str,
) -> Result<Option<u32>, NodeListFailure> {
    let mut found = None;
    opened.nodes(|state| {
        if let NodeState::Alive(node) = &state
            && *node.id() != own
            && let Some(details) = node.details().as_ref()
            && details.name().as_str() == name
        {
            found = Some(details.process_id().value().cast_unsigned());
            return CallbackProgression::Stop;
        }
        CallbackProgression::Continue
    })?;
    Ok(found)
}

/// The nodes of a service's publishers, each with how many it has.
pub(crate) fn of_publishers<S: Service, E: Element, H: Header>(opened: &Opened<S, E, H>) -> String {
    let mut owners = Vec::new();
    opened.dynamic_config().list_publishers(|port| {
        owners.push(port.node_id);
        CallbackProgression::Continue
    });
    listed(&**opened, &owners)
}

/// The nodes of a service's subscribers, each with how many it has.
pub(crate) fn of_subscribers<S: Service, E: Element, H: Header>(
    opened: &Opened<S, E, H>,
) -> String {
    let mut owners = Vec::new();
    opened.dynamic_config().list_subscribers(|port| {
        owners.push(port.node_id);
        CallbackProgression::Continue
    });
    listed(&**opened, &owners)
}

/// The owners of a service's ports, each with how many it has.
pub(crate) fn listed(opened: &impl PortFactory, owners: &[UniqueNodeId]) -> String {
    const SHOWN: usize = 5;
    let mut nodes: Vec<(UniqueNodeId, usize)> = Vec::new();
    for owner in owners {
        match nodes.iter_mut().find(|(node, _)| node == owner) {
            Some((_, places)) => *places += 1,
            None => nodes.push((*owner, 1)),
        }
    }
    let mut texts: Vec<String> = nodes
        .iter()
        .take(SHOWN)
        .map(|(id, places)| format!("{places} by {}", node(opened, *id)))
        .collect();
    if nodes.len() > SHOWN {
        texts.push(format!("the others by {} more nodes", nodes.len() - SHOWN));
    }
    texts.join(", ")
}
