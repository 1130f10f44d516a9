//! Why a call failed, or was refused.

use std::time::Duration;

use isochrone_engine::nearest_name;
use isochrone_ipc::{OpenError, RequestError};
use thiserror::Error;

use crate::Refusal;

/// Why a call failed, or was refused.
#[derive(Error)]
#[non_exhaustive]
pub enum ClientError {
    /// No node of this name runs.
    #[error("no node \"{node}\" runs here; {}", alternatives(node, running, domain))]
    NoNode {
        /// The name.
        node: String,
        /// The nodes that run.
        running: Vec<String>,
        /// The domain that was searched: its root path and prefix, in words.
        domain: String,
    },
    /// It runs, but takes no requests.
    #[error(
        "node \"{node}\" runs but takes no requests: its configuration says control = \"off\" in [node], or it is just starting or ending"
    )]
    NotOperated {
        /// The node.
        node: String,
    },
    /// Another process serves its service, instead of the node.
    #[error(
        "node \"{node}\" itself takes no requests, but {server} serves isochrone/{node}/control: end that"
    )]
    Stranger {
        /// The node.
        node: String,
        /// The process that serves it.
        server: String,
    },
    /// It has as many clients as it can have.
    #[error(
        "node \"{node}\" is asked by {clients} clients already, and takes no more{}; end one of them",
        by(.holders)
    )]
    Full {
        /// The node.
        node: String,
        /// How many there are.
        clients: usize,
        /// Name, program and process id of the clients, as far as they are known.
        holders: String,
    },
    /// The service cannot be opened, or is not a control service.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The request could not be sent.
    #[error(transparent)]
    Send(#[from] RequestError),
    /// The node ended before it answered.
    #[error(
        "node \"{node}\" ended before it answered; what was asked for may have been done before"
    )]
    Ended {
        /// The node.
        node: String,
    },
    /// No answer came in time.
    #[error(
        "node \"{node}\" did not answer within {patience:?}; {}. What was asked for may still be done if the node has received it{}",
        silence(*process, *is_stopped),
        other_servers(node, strangers)
    )]
    NoAnswer {
        /// The node.
        node: String,
        /// How long the client waited.
        patience: Duration,
        /// Its process, if iceoryx2 knows it.
        process: Option<u32>,
        /// Whether the process is stopped, by a signal or a debugger.
        is_stopped: bool,
        /// Other processes that serve its service, in words.
        strangers: Vec<String>,
    },
    /// The flag of [`Client::interrupted_by`](crate::Client::interrupted_by) was set before the answer came.
    #[error(
        "ended by a signal before node \"{node}\" answered; what was asked for may still be done"
    )]
    Interrupted {
        /// The node.
        node: String,
    },
    /// The node refused the request, for this reason.
    #[error("{0}")]
    Refused(Refusal),
    /// The answer is not a result of the method.
    #[error(
        "node \"{node}\" answered what this program does not understand ({cause}); see that both are of one version"
    )]
    Misunderstood {
        /// The node.
        node: String,
        /// What is wrong with it.
        cause: String,
    },
}

/// The end of a sentence that says that other processes serve a node's service; empty if none does.
pub fn other_servers(node: &str, strangers: &[String]) -> String {
    let strangers = strangers.join(" and ");
    if strangers.is_empty() {
        return String::new();
    }
    format!(
        "; {strangers} serves isochrone/{node}/control too, and its answers are not taken: end that"
    )
}

/// The state of the process of a node that does not answer, and what to do about it, as part of a sentence.
pub fn silence(process: Option<u32>, is_stopped: bool) -> String {
    match process {
        Some(pid) if is_stopped => format!(
            "its process {pid} is stopped: continue it (kill -CONT {pid}) or end it (kill -KILL {pid})"
        ),
        Some(pid) => format!(
            "its process {pid} is not stopped, but hangs or gets no CPU time: see what its log says"
        ),
        None => "see that its process is not stopped, and what its log says".to_owned(),
    }
}

fn by(holders: &str) -> String {
    if holders.is_empty() { String::new() } else { format!(" ({holders})") }
}

fn alternatives(node: &str, running: &[String], domain: &str) -> String {
    match nearest_name(node, running.iter().map(String::as_str)) {
        Some(nearest) => format!("did you mean \"{nearest}\"?"),
        None if running.is_empty() => format!("none runs in its domain, {domain}"),
        None => format!("there is: {}", running.join(", ")),
    }
}

isochrone_model::debug_as_display!(ClientError);
