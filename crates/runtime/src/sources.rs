//! Who sends what a task follows, and whether the task may keep it from running.

use std::fs;
use std::path::Path;

use isochrone_ipc::ListedNode;

/// The publishers of a service.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Sources {
    pub(crate) nodes: Vec<ListedNode>,
    /// The highest real-time priority of their threads; `None` if they have none, or it is not known.
    priority: Option<u8>,
}

impl Sources {
    pub(crate) fn of(nodes: Vec<ListedNode>) -> Self {
        let priorities = nodes.iter().filter_map(|node| highest_priority(node.pid));
        let priority = priorities.max();
        Self { nodes, priority }
    }

    /// Whether a task of this priority may keep them from running, were they on its CPU. Without a priority it
    /// takes turns with others.
    pub(crate) fn may_wait_for(&self, follower: Option<u8>) -> bool {
        follower.is_some_and(|own| self.priority.is_none_or(|priority| priority <= own))
    }

    /// Whether one of them is, or may be, a control node, whose tasks have their priorities by its configuration.
    pub(crate) fn may_be_control_nodes(&self) -> bool {
        let is_node = |node: &ListedNode| {
            node.name.strip_prefix("isochrone/").is_some_and(|name| name != "publish")
        };
        self.nodes.is_empty() || self.nodes.iter().any(is_node)
    }

    /// Their names, or that they are not known.
    pub(crate) fn names(nodes: &[ListedNode]) -> String {
        match nodes {
            [] => "its source".to_owned(),
            nodes => nodes.iter().map(ListedNode::to_string).collect::<Vec<_>>().join(" and "),
        }
    }
}

/// The highest real-time priority of a process's threads.
fn highest_priority(pid: u32) -> Option<u8> {
    let threads = fs::read_dir(format!("/proc/{pid}/task")).ok()?.flatten();
    threads.filter_map(|thread| priority(&thread.path())).max()
}

/// That of a thread, if it has one.
fn priority(thread: &Path) -> Option<u8> {
    let stat = fs::read_to_string(thread.join("stat")).ok()?;
    of_stat(&stat)
}

/// proc_pid_stat(5): `rt_priority` is field 40. The program's name, field 2, may contain anything.
fn of_stat(stat: &str) -> Option<u8> {
    let (_, behind_name) = stat.rsplit_once(')')?;
    let priority = behind_name.split_whitespace().nth(40 - 3)?.parse().ok()?;
    (priority > 0).then_some(priority)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_priority_of_a_thread_is_read_behind_whatever_its_name_is() {
        let stat = |priority: u8| {
            let zeros = "0 ".repeat(36);
            format!("7 (a) b (c) S {zeros}{priority} 1 0")
        };
        assert_eq!(of_stat(&stat(80)), Some(80));
        assert_eq!(of_stat(&stat(0)), None);
        let own = fs::read_to_string("/proc/self/stat").unwrap();
        assert!(own.rsplit_once(')').unwrap().1.split_whitespace().count() > 38, "{own}");
    }

    #[test]
    fn only_a_task_of_the_same_or_a_higher_priority_keeps_its_source_from_running() {
        let of = |priority| Sources { nodes: Vec::new(), priority };
        for (source, follower, may_wait) in [
            (None, Some(80), true),
            (Some(80), Some(80), true),
            (Some(81), Some(80), false),
            (None, None, false),
        ] {
            assert_eq!(of(source).may_wait_for(follower), may_wait, "{source:?} {follower:?}");
        }
    }
}
