//! What `run --redundant` says of the other process of the node while it runs.

use isochrone_ipc::Takeover;
use isochrone_runtime::{Redundancy, TwinRole};

use crate::base::terminal;

/// One of two processes of a node, as it was told last.
pub(super) struct Twin<'a> {
    node: &'a str,
    redundancy: &'a Redundancy,
    told: TwinRole,
}

impl<'a> Twin<'a> {
    /// As its start has told.
    pub(super) fn new(node: &'a str, redundancy: &'a Redundancy) -> Self {
        let told = if redundancy.holder().is_some() { TwinRole::Joining } else { TwinRole::Holder };
        Self { node, redundancy, told }
    }

    /// Whether this process can take over, if it stands by.
    pub(super) fn stands_by(&self) -> Option<bool> {
        let role = self.redundancy.role();
        (role != TwinRole::Holder).then_some(role == TwinRole::Standby)
    }

    /// Tells what has changed since.
    pub(super) fn tell(&mut self) {
        let role = self.redundancy.role();
        let before = std::mem::replace(&mut self.told, role);
        if role == before {
            return;
        }
        let node = self.node;
        let text = match role {
            TwinRole::Joining if before == TwinRole::Standby => {
                format!(
                    "node \"{node}\" cannot be taken over by this process for now: the holder has not heard it for 100 ms"
                )
            }
            TwinRole::Joining => {
                format!("node \"{node}\" was taken over by the other process; this one stands by")
            }
            TwinRole::Standby => {
                format!("node \"{node}\" can be taken over by this process from now on")
            }
            TwinRole::Holder => {
                let how = self.redundancy.last_takeover().map_or_else(String::new, how);
                format!("node \"{node}\" is taken over by this process{how}")
            }
        };
        terminal::note(&text);
    }
}

/// How this process came to hold the node.
fn how(last: Takeover) -> String {
    if last.was_asked {
        return " as the holder had asked".to_owned();
    }
    let unmet = match last.unmet_releases {
        0 => String::new(),
        unmet => format!("; it was not awake for {unmet} of its releases"),
    };
    format!(", as the holder was silent (lost cycles: {}{unmet})", last.lost_cycles)
}
