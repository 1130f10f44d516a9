//! Calls `describe` on all nodes of a domain.

use std::thread;
use std::time::{Duration, Instant};

use isochrone_ipc::{OpenError, Participant, Service};

use super::client::{Client, PAUSE};
use super::client_error::ClientError;
use super::running_nodes::{RunningNode, running_nodes};
use super::{DescribeParams, DescribeResult};

/// How long to wait for all nodes together. A node answers within milliseconds, unless its process is stopped or gets
/// no CPU.
const PATIENCE: Duration = Duration::from_secs(1);

/// A running node, and its description.
#[derive(Debug)]
#[non_exhaustive]
pub struct DescribedNode {
    /// The node.
    pub node: RunningNode,
    /// Its description, or why there is none.
    pub description: Result<DescribeResult, ClientError>,
}

/// Calls `describe` on all nodes of a participant's domain, except those for which `is_left_out` is true, and waits
/// for their answers for one second altogether, or until `is_due`. The result is ordered by name; nodes of other
/// domains are not found.
///
/// Touches many files and waits for the domain's lock; never call it in a cycle. A node that has eight clients
/// already takes most of a second more.
///
/// # Errors
/// The domain cannot be locked or read.
pub fn describe_nodes<S: Service>(
    participant: &Participant<S>,
    is_left_out: impl Fn(&RunningNode) -> bool,
    is_due: impl Fn() -> bool,
) -> Result<Vec<DescribedNode>, OpenError> {
    let nodes: Vec<_> =
        running_nodes(participant)?.into_iter().filter(|node| !is_left_out(node)).collect();
    let ask = |node: &RunningNode| Inquiry::ask(participant, &node.name, is_due());
    let mut asked: Vec<_> = nodes.iter().map(ask).collect();
    let began = Instant::now();
    loop {
        asked.iter_mut().for_each(Inquiry::look);
        let is_open = asked.iter().any(|asked| matches!(asked, Inquiry::Open { .. }));
        if !is_open || is_due() || began.elapsed() >= PATIENCE {
            break;
        }
        thread::sleep(PAUSE);
    }
    let described = nodes
        .into_iter()
        .zip(asked)
        .map(|(node, asked)| DescribedNode { node, description: asked.end(is_due()) });
    Ok(described.collect())
}

/// The progress with a node.
enum Inquiry<S: Service> {
    /// No answer to the request with this id has arrived.
    Open { client: Box<Client<S>>, id: String },
    /// It has answered, or will not.
    Done(Result<DescribeResult, ClientError>),
}

impl<S: Service> Inquiry<S> {
    fn ask(participant: &Participant<S>, node: &str, is_due: bool) -> Self {
        if is_due {
            return Self::Done(Err(ClientError::Interrupted { node: node.to_owned() }));
        }
        let asked = Client::connect(participant, node, PATIENCE).and_then(|mut client| {
            let id = client.send(&DescribeParams {})?;
            Ok(Self::Open { client: Box::new(client), id })
        });
        asked.unwrap_or_else(|error| Self::Done(Err(error)))
    }

    fn look(&mut self) {
        if let Self::Open { client, id } = self
            && let Some(answer) = client.receive::<DescribeParams>(id).transpose()
        {
            *self = Self::Done(answer);
        }
    }

    fn end(self, is_due: bool) -> Result<DescribeResult, ClientError> {
        match self {
            Self::Done(answer) => answer,
            Self::Open { client, .. } if is_due => {
                Err(ClientError::Interrupted { node: client.node().to_owned() })
            }
            Self::Open { client, .. } => Err(client.unanswered()),
        }
    }
}
