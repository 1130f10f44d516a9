//! Asking all nodes of a domain what they are.

use std::thread;
use std::time::{Duration, Instant};

use isochrone_ipc::{OpenError, Participant, Service};

use super::client::{Client, PAUSE, RunningNode, running_nodes};
use super::client_error::ClientError;
use super::{DescribeParams, DescribeResult};

/// How long all nodes together are waited for. One answers within some milliseconds, unless its process is
/// stopped or the machine has no time for it.
const PATIENCE: Duration = Duration::from_secs(1);

/// A node that runs, and what it says of itself.
#[derive(Debug)]
#[non_exhaustive]
pub struct DescribedNode {
    /// The node.
    pub node: RunningNode,
    /// What it says, or why nothing is known.
    pub description: Result<DescribeResult, ClientError>,
}

/// Asks all nodes of a participant's domain what they are, except those that `is_left_out` names, and waits
/// for their answers for one second altogether, or until `is_due`. By name; nodes of other domains are not
/// found.
///
/// Touches many files and waits for the domain's lock; never call it in a cycle. A node that eight clients
/// ask already takes most of a second more.
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

/// How far it is with a node.
enum Inquiry<S: Service> {
    /// No answer has come to the request of this id.
    Open { client: Box<Client<S>>, id: String },
    /// It answered, or will not.
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
