//! A node that keeps a journal.

use std::path::Path;

use isochrone_engine::{Plan, Rules, Source};
use isochrone_runtime::journal::Journal;
use isochrone_runtime::{Node, Running};

pub(crate) const NODE: &str = r#"
[node]
name = "level"
control = "force"
[[task]]
name = "fast"
period = "1ms"
[[input]]
name = "raw"
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
in = { value = "raw", setChangeRate = 10.0 }
"#;

pub(crate) fn plan(text: &str) -> Plan {
    Plan::new(Source::new("level.toml", text), &Rules::default()).unwrap()
}

/// Starts the node with its journal in this file.
pub(crate) fn start(path: &Path) -> Running {
    let plan = plan(NODE);
    let journal = Journal::open(path, &plan).unwrap();
    Node::prepare_alone(&plan).unwrap().with_journal(journal).unwrap().start()
}
