//! The publishers of the service that a task follows, and whether the task may keep them from running.

use isochrone_engine::starves;
use isochrone_ipc::ListedNode;
use isochrone_machine::Machine;

/// The publishers of a service.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Sources {
    pub(super) nodes: Vec<ListedNode>,
    /// The highest real-time priority of their threads; `None` if they have none, or it is not known.
    priority: Option<u8>,
}

impl Sources {
    pub(super) fn of(nodes: Vec<ListedNode>) -> Self {
        let machine = Machine::here();
        let priority = nodes.iter().filter_map(|node| machine.highest_priority(node.pid)).max();
        Self { nodes, priority }
    }

    /// Whether a task of this priority that watches for their frames would keep them from running on a shared CPU.
    pub(super) fn may_wait_for(&self, follower: u8) -> bool {
        starves(Some(follower), self.priority)
    }

    /// Whether one of them is, or may be, a control node, whose tasks have their priorities by its configuration.
    pub(super) fn may_be_control_nodes(&self) -> bool {
        let is_node = |node: &ListedNode| {
            node.name.strip_prefix("isochrone/").is_some_and(|name| name != "publish")
        };
        self.nodes.is_empty() || self.nodes.iter().any(is_node)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_task_of_the_same_or_a_higher_priority_keeps_its_source_from_running() {
        let of = |priority| Sources { nodes: Vec::new(), priority };
        for (source, follower, may_wait) in
            [(None, 80, true), (Some(80), 80, true), (Some(81), 80, false)]
        {
            assert_eq!(of(source).may_wait_for(follower), may_wait, "{source:?} {follower}");
        }
    }
}
