//! A node that counts its cycles, and one that follows it.

/// A node whose frames on `plant/NAME` have the number of its cycle as `saw.value`.
pub(crate) fn counter(name: &str, period: &str) -> String {
    format!(
        r#"
[node]
name = "{name}"
[[task]]
name = "t"
period = "{period}"
[[block]]
name = "saw"
type = "SawTooth"
in = {{ incrementRange = 1, endlessSteps = true }}
[[output]]
service = "plant/{name}"
signals = ["saw.value"]
"#
    )
}

/// The node `follower` with a task of 10 ms that follows a counter, without outputs. The file ends with
/// its input, which is called as the counter is.
pub(crate) fn follower(counter: &str, within: &str) -> String {
    format!(
        r#"
[node]
name = "follower"
[[task]]
name = "t"
period = "10ms"
follow = {{ service = "plant/{counter}", within = "{within}" }}
[[input]]
name = "{counter}"
type = "INT"
service = "plant/{counter}"
signal = "saw.value"
"#
    )
}
