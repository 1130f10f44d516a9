//! Configurations that more than one test runs. What a test changes of one it says itself.

use crate::{Domain, Process};

/// A domain in which a node runs, whose configuration is in the file `tank.toml`.
pub fn tank(configuration: &str) -> (Domain, Process) {
    let domain = Domain::new();
    let node = domain.start_node("tank.toml", configuration, "");
    (domain, node)
}

/// A node that passes its input on: `relay/in` to `relay/out`.
pub const RELAY: &str = r#"
[node]
name = "relay"
[[task]]
name = "t"
period = "2ms"
[[input]]
name = "x"
service = "relay/in"
[[output]]
service = "relay/out"
signals = ["x"]
"#;

/// [`RELAY`] with further keys of its input, and entries behind it.
pub fn relay_with(keys: &str) -> String {
    RELAY.replace("[[output]]", &format!("{keys}\n[[output]]"))
}
