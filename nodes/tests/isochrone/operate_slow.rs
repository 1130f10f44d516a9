//! Tasks that sleep for long between their cycles, and those who look at them.

use isochrone_testing::Plant;
use isochrone_testing::plants::tank;
use serde_json::json;

fn sleepy() -> Plant {
    Plant::new("tank")
        .task("fast", "10ms")
        .task("hourly", "1h")
        .task("follower", "1h")
        .with("follow = { service = \"tank/in\", within = \"1ms\" }")
        .on("follower")
        .input("in", "tank/in", "")
        .on("fast")
        .saw("beat", "timeRange = \"1500ms\", incrementRange = 1, numberSteps = 3")
        .on("hourly")
        .ramp("ramp", "value = 25.0, setChangeRate = 10.0")
        .on("follower")
        .ramp("data", "value = \"in\", setChangeRate = 10.0")
}

#[test]
fn the_values_of_a_task_that_is_due_in_an_hour_are_those_of_its_last_cycle() {
    let (domain, _node) = tank(&sleepy());
    let read = || domain.answer("get tank ramp.setChangeRate data.setChangeRate beat.value --json");
    for _ in 0..2 {
        let reading = read();
        for task in ["hourly", "follower"] {
            assert_eq!(reading["tasks"][task]["cycle"], 0, "{reading}");
        }
        assert_eq!(reading["values"]["ramp.setChangeRate"], 10.0);
        assert!(reading["quality"].is_object(), "{reading}");
    }
    // What is still to come is not shown as if it had come.
    let set = domain.answer("set tank ramp.setChangeRate=5 --json");
    assert_eq!(set["tasks"]["hourly"], json!({"cycle": 1, "pending": true}), "{set}");
    assert_eq!(read()["values"]["ramp.setChangeRate"], 10.0);
    let journal = domain.stdout("journal tank");
    assert!(journal.contains("set 1, cycle 1 of task \"hourly\""), "{journal}");
    assert!(journal.contains("\n  ramp.setChangeRate  -> 5\n"), "{journal}");
    let _undo = domain
        .expect("undo tank", 1, &["set 1 is still to come, in cycle 1 of task \"hourly\""])
        .stderr;
    domain.run("set tank beat.incrementRange=2").expect_code(0);
    let undone = domain.run("undo tank").expect_code(0).stdout;
    assert!(undone.starts_with("transaction 2 "), "{undone}");
    domain.expect("undo tank", 1, &["set 1 is still to come"]);
    let watched = domain.run("watch tank ramp.setChangeRate --count 1").expect_code(0);
    assert_eq!(watched.stdout, "0  ramp.setChangeRate=10\n");
    assert!(domain.run("show tank ramp data").expect_code(0).stdout.contains("ramp.setChangeRate"));
}
