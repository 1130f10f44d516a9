//! A node of iceoryx2, for people.

use std::fmt;

use iceoryx2::node::NodeDetails;

/// An iceoryx2 node: a process, or a part of one.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct ListedNode {
    /// Its name; the names of isochrone's own nodes begin with `isochrone/`.
    pub name: String,
    /// Its process id.
    pub pid: u32,
    /// The file name of its program.
    pub program: String,
}

impl ListedNode {
    pub(crate) fn of(details: &NodeDetails) -> Self {
        Self {
            name: details.name().to_string(),
            pid: details.process_id().value().cast_unsigned(),
            program: details.executable().to_string(),
        }
    }
}

/// `node "plant" (python3, pid 7)`; of one without a name, `python3 (pid 7)`.
impl fmt::Display for ListedNode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, pid, program } = self;
        match name.as_str() {
            "" => write!(f, "{program} (pid {pid})"),
            name => write!(f, "node \"{name}\" ({program}, pid {pid})"),
        }
    }
}
