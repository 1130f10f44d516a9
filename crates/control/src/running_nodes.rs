//! The nodes that run.

use isochrone_ipc::{OpenError, Participant, Service};

use super::node_of_telemetry;

/// A node that runs.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct RunningNode {
    /// Its name: `name` of `[node]`.
    pub name: String,
    /// Its process.
    pub process: u32,
    /// The file name of its program.
    pub program: String,
}

/// The nodes that run in a participant's domain, by name.
///
/// Touches many files and waits for the domain's lock; never call it in a cycle.
///
/// # Errors
/// The domain cannot be locked or read.
pub fn running_nodes<S: Service>(
    participant: &Participant<S>,
) -> Result<Vec<RunningNode>, OpenError> {
    let services = participant.frame_services()?.into_iter();
    let mut nodes: Vec<_> = services
        .filter_map(|service| {
            let name = node_of_telemetry(&service.name)?.to_owned();
            let publisher = service.publishers.into_iter().next()?;
            Some(RunningNode { name, process: publisher.pid, program: publisher.program })
        })
        .collect();
    nodes.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(nodes)
}
