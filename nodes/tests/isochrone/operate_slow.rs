//! Tasks that sleep for long between their cycles, and those who look at them.

use isochrone_testing::Ended;
use isochrone_testing::plants::tank;
use serde_json::{Value, json};

const TANK: &str = r#"
[node]
name = "tank"
[[task]]
name = "fast"
period = "10ms"
[[task]]
name = "hourly"
period = "1h"
[[task]]
name = "follower"
period = "1h"
follow = { service = "tank/in", within = "1ms" }
[[input]]
name = "in"
service = "tank/in"
task = "follower"
[[block]]
name = "beat"
type = "SawTooth"
task = "fast"
in = { timeRange = "1500ms", incrementRange = 1, numberSteps = 3 }
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
task = "hourly"
in = { value = 25.0, setChangeRate = 10.0 }
[[block]]
name = "data"
type = "LimRateOfChangeCI"
task = "follower"
in = { value = "in", setChangeRate = 10.0 }
"#;

fn json(ended: Ended) -> Value {
    serde_json::from_str(&ended.expect_code(0).stdout).unwrap()
}

#[test]
fn the_values_of_a_task_that_is_due_in_an_hour_are_those_of_its_last_cycle() {
    let (domain, node) = tank(TANK);
    let read =
        || json(domain.run("get tank ramp.setChangeRate data.setChangeRate beat.value --json"));
    for _ in 0..2 {
        let reading = read();
        for task in ["hourly", "follower"] {
            assert_eq!(reading["tasks"][task]["cycle"], 0, "{reading}");
        }
        assert_eq!(reading["values"]["ramp.setChangeRate"], 10.0);
        assert!(reading["quality"].is_object(), "{reading}");
    }
    // What is still to come is not shown as if it had come.
    let set = json(domain.run("set tank ramp.setChangeRate=5 --json"));
    assert_eq!(set["tasks"]["hourly"], json!({"cycle": 1, "pending": true}), "{set}");
    assert_eq!(read()["values"]["ramp.setChangeRate"], 10.0);
    let journal = domain.stdout("journal tank");
    assert!(journal.contains("set 1, cycle 1 of task \"hourly\""), "{journal}");
    assert!(journal.contains("\n  ramp.setChangeRate  -> 5\n"), "{journal}");
    let undo = domain.run("undo tank").expect_code(1).stderr;
    assert!(undo.contains("set 1 is still to come, in cycle 1 of task \"hourly\""), "{undo}");
    domain.run("set tank beat.incrementRange=2").expect_code(0);
    let undone = domain.run("undo tank").expect_code(0).stdout;
    assert!(undone.starts_with("transaction 2 "), "{undone}");
    let undo = domain.run("undo tank").expect_code(1).stderr;
    assert!(undo.contains("set 1 is still to come"), "{undo}");
    let watched = domain.run("watch tank ramp.setChangeRate --count 1").expect_code(0);
    assert_eq!(watched.stdout, "0  ramp.setChangeRate=10\n");
    assert!(domain.run("show tank ramp data").expect_code(0).stdout.contains("ramp.setChangeRate"));
    node.stop().expect_code(0);
}
