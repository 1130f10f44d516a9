//! The tasks of other nodes that run on this machine, and when they need which CPU.

use isochrone_ipc::{OpenError, Participant, Service};

use super::CpuUser;
use isochrone_control::{DescribedNode, TaskDescription, describe_nodes};

/// The nodes that run in a participant's domain.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Neighbours {
    /// The tasks of the nodes that answered, by node, then in the order of its configuration.
    pub tasks: Vec<CpuUser>,
    /// Nodes that did not answer: they take no requests, are just starting or are stopped, or are of an older
    /// version.
    pub silent: Vec<String>,
}

impl Neighbours {
    /// Asks all nodes of a participant's domain, except the one of this name, as
    /// [`describe_nodes`] does, and waits as long.
    ///
    /// # Errors
    /// The domain cannot be locked or read.
    pub fn find<S: Service>(participant: &Participant<S>, except: &str) -> Result<Self, OpenError> {
        let mut found = Self::default();
        let described = describe_nodes(participant, |node| node.name == except, || false)?;
        for DescribedNode { node, description, .. } in described {
            match description {
                Ok(described) => found.add(&node.name, &described.tasks),
                Err(_) => found.silent.push(node.name),
            }
        }
        Ok(found)
    }

    /// Adds the tasks that a node describes.
    pub fn add(&mut self, node: &str, tasks: &[TaskDescription]) {
        for task in tasks {
            let Some(placement) = task.placement.clone() else {
                self.silent.push(node.to_owned());
                return;
            };
            let (node, period_ns) = (node.to_owned(), task.period_ns);
            self.tasks.push(CpuUser { node, task: task.name.clone(), period_ns, placement });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use isochrone_control::Placement;

    #[test]
    fn a_node_of_a_version_that_does_not_tell_is_silent() {
        let task = |text: &str| serde_json::from_str::<TaskDescription>(text).unwrap();
        let without = task(
            r#"{"name": "fast", "period_ns": 1000000, "phase_ns": 0, "cycle": 7, "missed": 0,
                "overruns": 0, "parameters": 1, "forces": 0}"#,
        );
        let placement = Placement {
            cpu: Some(1),
            scheduler: "fifo:80".into(),
            wake: "hybrid".into(),
            first_release_ns: 500_000,
            longest_watch_ns: 200_000,
            response_ns: None,
            phase_reason: None,
            cpu_reason: None,
            follow: None,
            sends: Vec::new(),
        };
        let with = TaskDescription { placement: Some(placement.clone()), ..without.clone() };
        let mut neighbours = Neighbours::default();
        neighbours.add("old", &[without]);
        neighbours.add("new", &[with]);
        assert_eq!(neighbours.silent, ["old"]);
        let expected =
            CpuUser { node: "new".into(), task: "fast".into(), period_ns: 1_000_000, placement };
        assert_eq!(neighbours.tasks, [expected]);
    }
}
