//! Configurations that more than one test runs. What a test changes of one it says itself.
//!
//! | plant | node | what it has |
//! |---|---|---|
//! | [`RELAY`] | `relay` | an input and nothing else |
//! | [`SAW`] | `saw` | a saw tooth that counts cycles |
//! | [`follower`] | `follower` | a task that follows a [`counter`] |
//! | [`RAMP`] | `tank` | a ramp between constants, with a limit |
//! | [`TANK`] | `tank` | an input, a ramp that follows it, limits and protected parameters |
//! | [`LEVEL`] | `level` | a saw tooth and a ramp in one task, read by another task |
//! | [`CLIMB`] | `level` | a ramp that climbs for as long as it runs, read by another task |
//! | [`GAUGE`] | `level` | a sensor in one task, read by another task |
//! | [`GUARD`] | `guard` | a sensor with its quality |

use crate::{Domain, Process};

/// A domain in which a node runs, whose configuration is in the file `tank.toml`.
pub fn tank(configuration: &str) -> (Domain, Process) {
    let domain = Domain::new();
    let node = domain.start_node("tank.toml", configuration, "");
    (domain, node)
}

/// A node that passes its input on: `relay/in` to `relay/out`, every 2 ms in task `t`.
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

/// The node `second` behind [`RELAY`]: it passes `relay/out` on to `second/out`.
pub fn second_relay() -> String {
    RELAY
        .replace("\"relay\"", "\"second\"")
        .replace("relay/out", "second/out")
        .replace("relay/in", "relay/out")
}

/// A node whose frames on `plant/saw` have the number of its cycle, counted from the first that ran, as
/// `saw.value`: one every 2 ms. Block and output name their task, `t`, so that a test can add another one.
pub const SAW: &str = r#"
[node]
name = "saw"
[[task]]
name = "t"
period = "2ms"
[[block]]
name = "saw"
type = "SawTooth"
task = "t"
in = { incrementRange = 1, endlessSteps = true }
[[output]]
service = "plant/saw"
task = "t"
signals = ["saw.value"]
"#;

/// [`SAW`] as a node of another name, whose frames are those of `plant/NAME`, and with another period.
pub fn counter(name: &str, period: &str) -> String {
    SAW.replacen("\"saw\"", &format!("\"{name}\""), 1)
        .replace("plant/saw", &format!("plant/{name}"))
        .replace("2ms", period)
}

/// The node `follower`, whose task `t` of 10 ms follows a [`counter`], without outputs. The file ends with
/// its input, which is called as the counter is.
pub fn follower(counter: &str, within: &str) -> String {
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

/// The smallest node to operate. In the task `fast`, `ramp` runs between constants and goes out to `tank/out`;
/// `ramp.value` has limits.
pub const RAMP: &str = r#"
[node]
name = "tank"
control = "force"
[limits]
"ramp.value" = [0.0, 100.0]
[[task]]
name = "fast"
period = "5ms"
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
in = { value = 25.0, setChangeRate = 10.0 }
[[output]]
service = "tank/out"
signals = ["ramp.delayedValue"]
"#;

/// A node to operate. In the task `fast`, `ramp` follows the input `level` of `tank/in`, which goes stale after
/// 200 ms; `ramp.setChangeRate` has limits, and a comment behind it in the file. `guard` scales the ramp with
/// parameters that are protected, and `beat` is a saw tooth with a time. Ramp and guard go out to `tank/out`.
pub const TANK: &str = r#"
[node]
name = "tank"
control = "force"
[[protect]]
names = ["guard.*"]
[limits]
"ramp.setChangeRate" = [0.0, 50.0]
[[task]]
name = "fast"
period = "5ms"
[[input]]
name = "level"
service = "tank/in"
max_age = "200ms"
# How fast the level may change.
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
[block.in]
value = "level"
setChangeRate = 10.0      # per second
[[block]]
name = "guard"
type = "ScaleLinear"
in = { x = "ramp.delayedValue", x1 = 0.0, y1 = 0.0, x2 = 100.0, y2 = 1.0, yMin = 0.0, yMax = 1.0 }
[[block]]
name = "beat"
type = "SawTooth"
in = { timeRange = "1500ms", incrementRange = 1, numberSteps = 3 }
[[output]]
service = "tank/out"
signals = ["ramp.delayedValue", "guard.y"]
"#;

/// A node to watch, with two tasks. In `fast`, `saw` steps to 900 in each cycle, `ramp` follows it, and
/// `lim.highLim` is a BOOL that `lim.autoValue` decides: it rises above 100. All three go out to `level/out`.
/// In `slow`, `late` follows the ramp.
pub const LEVEL: &str = r#"
[node]
name = "level"
control = "force"
[[task]]
name = "fast"
period = "2ms"
[[task]]
name = "slow"
period = "20ms"
[[block]]
name = "saw"
type = "SawTooth"
task = "fast"
in = { incrementRange = 1, numberSteps = 900 }
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
task = "fast"
in = { value = "saw.value", setChangeRate = 333.3 }
[[block]]
name = "lim"
type = "LimRateOfChangeAdvancedCI"
task = "fast"
in = { autoValue = 0.0, setPosUpRateLim = 1e6, setPosDownRateLim = 1e6, setHighLim = 100.0 }
[[block]]
name = "late"
type = "LimRateOfChangeCI"
task = "slow"
in = { value = "ramp.delayedValue", setChangeRate = 77.7 }
[[output]]
service = "level/out"
task = "fast"
signals = ["saw.value", "ramp.delayedValue", "lim.highLim"]
"#;

/// A node to change while it runs, with two tasks. In `fast`, `ramp` climbs by 1000 a second for as long as it
/// runs, and goes out to `level/out`: a cycle that is skipped or repeated shows in it. In `slow`, `late` has its
/// newest value.
pub const CLIMB: &str = r#"
[node]
name = "level"
control = "force"
[[task]]
name = "fast"
period = "2ms"
[[task]]
name = "slow"
period = "20ms"
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
task = "fast"
in = { value = 1e9, setChangeRate = 1000.0 }
[[block]]
name = "late"
type = "LimRateOfChangeCI"
task = "slow"
in = { value = "ramp.delayedValue", setChangeRate = 1e9 }
[[output]]
service = "level/out"
task = "fast"
signals = ["ramp.delayedValue"]
"#;

/// A node behind a sensor, with two tasks. In `fast`, `ramp` follows the input `x` of `plant/sensor`, and both
/// go out to `level/out`, as does `x.ok`. In `slow`, `late` follows the ramp, and `alone` follows nothing.
pub const GAUGE: &str = r#"
[node]
name = "level"
control = "force"
[[task]]
name = "fast"
period = "2ms"
[[task]]
name = "slow"
period = "20ms"
[[input]]
name = "x"
service = "plant/sensor"
task = "fast"
max_age = "1s"
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
task = "fast"
in = { value = "x", setChangeRate = 17.3 }
[[block]]
name = "late"
type = "LimRateOfChangeCI"
task = "slow"
in = { value = "ramp.delayedValue", setChangeRate = 5.0 }
[[block]]
name = "alone"
type = "LimRateOfChangeCI"
task = "slow"
in = { value = 1.0, setChangeRate = 10.0 }
[[output]]
service = "level/out"
task = "fast"
signals = ["ramp.delayedValue", "x", "x.ok"]
"#;

/// A node that reads one value of a sensor, `plant/sensor`, and publishes it with what it is worth on
/// `guard/out`.
pub const GUARD: &str = r#"
[node]
name = "guard"
[[task]]
name = "t"
period = "5ms"
[[input]]
name = "x"
service = "plant/sensor"
default = -1.0
max_age = "500ms"
[[output]]
service = "guard/out"
signals = ["x", "x.ok", "x.age"]
"#;
