//! A pin that can be without a value, set and set back by a user.

use isochrone_testing::plants::tank;
use isochrone_testing::{Domain, assert_says};

const TANK: &str = r#"
[node]
name = "tank"
[[task]]
name = "fast"
period = "10ms"
ob = 35
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
[block.in]
value = 25.0
setChangeRate = 10.0
callOB = 35            # as the others
[[block]]
name = "free"
type = "LimRateOfChangeCI"
in = { value = 25.0, setChangeRate = 10.0 }
[[output]]
service = "tank/out"
signals = ["ramp.delayedValue"]
"#;

#[test]
fn a_call_ob_is_set_back_as_it_is_shown_and_saved_and_replayed_so() {
    let domain = Domain::new();
    let node = domain.start_node("tank.toml", TANK, "--record tank.mcap");
    domain.run("set tank free.callOB=35").expect_code(0);
    let back = ["set", "tank", "free.callOB=calling task", "ramp.callOB=NaN"];
    domain
        .start_with(&back)
        .finish()
        .expect_code(0)
        .prints(&["free.callOB  35  -> calling task", "ramp.callOB  35  -> calling task"]);
    let shown = domain.run("get tank free.callOB ramp.callOB").expect_code(0);
    assert_eq!(shown.stdout, "calling task\ncalling task\n");
    domain.run("journal tank").expect_code(0).prints(&["35  -> calling task"]);
    for pin in ["ramp.setChangeRate", "ramp.enDefaultOutValue"] {
        let refused = domain.start_with(&["set", "tank", &format!("{pin}=calling task")]);
        refused.finish().expect_code(2).says(&["\"calling task\" is for a callOB"]);
        domain.expect(&format!("set tank {pin}=NaN"), 1, &["NaN is no"]);
    }
    let saved = domain.run("save tank").expect_code(0).stdout;
    assert_eq!(saved, TANK.replace("callOB = 35            #", "callOB = nan           #"));
    domain.write("saved.toml", &saved);
    domain.run("check saved.toml").expect_code(0);
    node.stop().expect_code(0);
    domain.run("replay tank.mcap").expect_code(0).prints(&["the same"]);
}

#[test]
fn a_call_ob_takes_the_name_of_a_task_and_is_shown_by_what_it_takes_from_it() {
    let (of_type, of_output) = ("type = \"LimRateOfChangeCI\"", "service = \"tank/out\"");
    let text = TANK
        .replace("ob = 35\n[", "ob = 35\n[[task]]\nname = \"slow\"\nperiod = \"20ms\"\n[")
        .replace(of_type, &format!("{of_type}\ntask = \"fast\""))
        .replace(of_output, &format!("{of_output}\ntask = \"fast\""));
    let (domain, _node) = tank(&text);
    let set = |value: &str| domain.start_with(&["set", "tank", &format!("free.callOB={value}")]);
    let got = || {
        let got = domain.answer("get tank free.callOB ramp.callOB --json");
        got["values"].clone()
    };
    assert_eq!(got(), serde_json::json!({ "free.callOB": "calling task", "ramp.callOB": 35 }));
    set("slow").finish().expect_code(0).prints(&["free.callOB  calling task  -> 20ms"]);
    assert_eq!(got(), serde_json::json!({ "free.callOB": "20ms", "ramp.callOB": 35 }));
    domain.run("save tank").expect_code(0).prints(&["setChangeRate = 10.0, callOB = \"slow\" }"]);
    assert_says(&set("fast").finish().expect_code(0).stdout, &["20ms  -> 35"]);
    assert_says(&set("20ms").finish().expect_code(0).stdout, &["35  -> 20ms"]);
    for (value, code, says) in [
        ("ob38", 2, "there is no task \"ob38\"; write the number alone: 38"),
        (
            "slwo",
            2,
            "there is no task \"slwo\"; give an OB number, calling task, or a task: fast, slow",
        ),
        ("7ms", 1, "7ms is no INT"),
    ] {
        assert_says(&set(value).finish().expect_code(code).stderr, &[says]);
    }
    assert_eq!(domain.stdout("get tank free.callOB"), "20ms\n");
}
