//! Who asks a node for a screen or a page.

use isochrone_ipc::{Participant, ipc};

use crate::failure::Failure;
use crate::operate::NodeArgs;

/// Who asks.
#[derive(Debug, Clone)]
pub(crate) struct Asker {
    /// The verb.
    pub(crate) verb: &'static str,
    /// Who that is for the node's journal.
    pub(crate) client: Option<String>,
}

impl Asker {
    /// Joins the node's domain.
    pub(super) fn join(&self, args: &NodeArgs) -> Result<Participant<ipc::Service>, Failure> {
        args.domain.join(&format!("isochrone/{}", self.verb))
    }
}
