//! The node `level`, and what its operator refuses.

use isochrone_control::desk::*;
use isochrone_model::*;

/// A node with a fast and a slow task, a protected block and limits for ramps, and what is given.
macro_rules! level {
    ($rest:literal) => {
        concat!(
            r#"
[node]
name = "level"
control = "force"

[[protect]]
names = ["guard.*"]

[limits]
"ramp.*.setChangeRate" = [0.0, 50.0]

[[task]]
name = "fast"
period = "100ms"

[[task]]
name = "slow"
period = "1s"

"#,
            $rest
        )
    };
}

/// Two ramps behind an input.
pub(crate) const NODE: &str = level!(
    r#"[[input]]
name = "raw"
type = "INT"
service = "plant/raw"
task = "fast"
default = 3

[[block]]
name = "scale"
type = "ScaleLinear"
task = "fast"
in = { x = "raw", x1 = 0.0, y1 = 0.0, x2 = 10.0, y2 = 10.0, yMin = -100.0, yMax = 100.0 }

[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
task = "fast"
count = 2
in = { value = "scale.y", setChangeRate = 10.0 }

[[block]]
name = "guard"
type = "LimRateOfChangeCI"
task = "fast"
in = { value = 1.0, setChangeRate = 10.0 }

[[block]]
name = "after"
type = "LimRateOfChangeCI"
task = "slow"
in = { value = "ramp.0.delayedValue", setChangeRate = 10.0 }

[[block]]
name = "free"
type = "LimRateOfChangeCI"
task = "slow"
in = { value = 25.0, setChangeRate = 10.0 }

[[output]]
service = "plant/ramp"
task = "fast"
signals = ["ramp.0.delayedValue"]

[[output]]
service = "plant/guard"
task = "fast"
signals = ["guard.delayedValue"]

[[output]]
service = "plant/after"
task = "slow"
signals = ["after.delayedValue"]
"#
);

/// Three ramps to a constant.
pub(crate) const RAMPS: &str = level!(
    r#"[[input]]
name = "raw"
service = "plant/raw"
task = "fast"
default = 3.0

[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
task = "fast"
count = 3
in = { value = 25.0, setChangeRate = 10.0 }

[[block]]
name = "guard"
type = "LimRateOfChangeCI"
task = "fast"
in = { value = "raw", setChangeRate = 10.0 }

[[block]]
name = "after"
type = "LimRateOfChangeCI"
task = "slow"
in = { value = "ramp.0.delayedValue", setChangeRate = 1000.0 }

[[output]]
service = "plant/ramp"
task = "fast"
signals = ["ramp.0.delayedValue"]

[[output]]
service = "plant/after"
task = "slow"
signals = ["after.delayedValue"]
"#
);

/// All that is wrong with a request, each with its way out.
pub(crate) fn messages(result: Result<PreparedRequest, Refusal>) -> Vec<String> {
    result.unwrap_err().findings.iter().map(Finding::to_string).collect()
}
