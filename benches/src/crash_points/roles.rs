//! The roles of the processes: a publisher feeds a node, which feeds a subscriber.

use super::point::Role;

/// A node that hands its input on.
#[derive(Debug, Clone, Copy)]
pub(super) struct NodeFile {
    pub(super) file: &'static str,
    name: &'static str,
    output: &'static str,
}

pub(super) const INPUT: &str = "crash/in";
pub(super) const OUTPUT: &str = "crash/out";
pub(super) const SECOND_OUTPUT: &str = "crash/second";
pub(super) const NODE: NodeFile = NodeFile { file: "node.toml", name: "crash", output: OUTPUT };
/// Where the first runs, the fresh node is another.
pub(super) const SECOND_NODE: NodeFile =
    NodeFile { file: "second.toml", name: "second", output: SECOND_OUTPUT };

/// What the publishers send that live on, that were killed before, that are struck, and that come
/// afterwards.
pub(super) const LIVING: f64 = 5.0;
pub(super) const PREDECESSOR: f64 = 6.0;
pub(super) const VICTIM: f64 = 7.0;
pub(super) const FRESH: f64 = 9.0;

/// A process ends by then even if nobody is left to end it.
const LIFE: &str = "--seconds 60";
impl NodeFile {
    pub(super) fn config(&self) -> String {
        let Self { name, output, .. } = self;
        format!(
            r#"
[node]
name = "{name}"
[[task]]
name = "t"
period = "2ms"
[[input]]
name = "x"
service = "{INPUT}"
default = -1.0
[[output]]
service = "{output}"
signals = ["x"]
"#
        )
    }
}

pub(super) fn publish(value: f64) -> String {
    format!("publish {INPUT} --value {value} --rate 500 {LIFE}")
}

pub(super) fn run(node: NodeFile) -> String {
    format!("run {} {LIFE}", node.file)
}

pub(super) fn subscribe(service: &str) -> String {
    format!("subscribe {service} --csv - {LIFE}")
}

/// The command of the process that is struck, or of one before it. A publisher sends `value`.
pub(super) fn command(role: Role, value: f64) -> String {
    match role {
        Role::Publisher => publish(value),
        Role::Node => run(NODE),
        Role::Subscriber => subscribe(OUTPUT),
    }
}
