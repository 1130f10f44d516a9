//! Process alarms: what people see of them and do to them, and what a node makes of it.

use isochrone_testing::{Domain, Process, wait_until};
use serde_json::{Value, json};

/// A level that people give, with an alarm of each severity on it.
const NODE: &str = r#"
[node]
name = "tank"
control = "force"
[[task]]
name = "fast"
period = "5ms"
[[variable]]
name = "level"
initial = 1.0
[[alarm]]
name = "high"
when = "level > 1.6"
for = "10ms"
hysteresis = 0.1
text = "Tank above 1.6 m"
[[alarm]]
name = "empty"
when = "level <= 0 OR level > 99"
severity = "info"
[[output]]
service = "tank/out"
signals = ["level", "high.active"]
"#;

fn tank(arguments: &str) -> (Domain, Process) {
    let domain = Domain::new();
    let node = domain.start_node("tank.toml", NODE, arguments);
    (domain, node)
}

/// The alarm `high`, once it is in a state.
fn high(domain: &Domain, state: &str) -> Value {
    let mut alarm = json!(null);
    wait_until(state, || {
        let standing = domain.answer("alarms tank --process --json");
        let standing = standing.as_array().unwrap();
        alarm = standing.iter().find(|it| it["name"] == "high").cloned().unwrap_or_default();
        alarm["state"] == state || state == "normal" && alarm.is_null()
    });
    alarm
}

fn set(domain: &Domain, level: f64) {
    domain.run(&format!("set tank level={level}")).expect_code(0);
}

#[test]
fn an_alarm_comes_is_acknowledged_and_returns_with_the_number_of_each_occurrence() {
    let (domain, _node) = tank("");
    domain.run("alarms tank").expect_code(0).says(&["nothing is wrong"]);
    domain.run("alarms tank --process").expect_code(0).says(&["no process alarm stands"]);
    set(&domain, 1.7);
    let alarm = high(&domain, "active_unacknowledged");
    assert_eq!((&alarm["occurrence"], &alarm["first"]["value"]), (&json!(1), &json!(1.7)));
    assert_eq!((&alarm["severity"], &alarm["when"]), (&json!("warning"), &json!("level > 1.6")));
    // Apart from what is wrong with the node, whose JSON stays as it was.
    assert_eq!(domain.answer("alarms tank --json"), json!([]));
    let listed = domain.stdout("alarms tank");
    assert!(listed.contains("active, unacknowledged"), "{listed}");
    assert!(listed.contains("level = 1.7") && listed.contains("Tank above 1.6 m"), "{listed}");

    domain
        .run("ack tank high --occurrence 1 --comment seen")
        .expect_code(0)
        .prints(&["high 1 is acknowledged: active, acknowledged, since "]);
    set(&domain, 1.55);
    assert_eq!(high(&domain, "active_acknowledged")["unacknowledged"], 0, "within the hysteresis");
    set(&domain, 1.4);
    high(&domain, "normal");
    for level in [1.7, 1.4, 1.8] {
        set(&domain, level);
        let state = if level > 1.6 { "active" } else { "returned" };
        high(&domain, &format!("{state}_unacknowledged"));
    }
    let alarm = high(&domain, "active_unacknowledged");
    assert_eq!((&alarm["occurrence"], &alarm["unacknowledged"]), (&json!(3), &json!(2)));
    domain.expect("ack tank high --occurrence 4", 1, &["has no occurrence 4; its newest one is 3"]);
    domain.run("ack tank high --occurrence 2").expect_code(0);
    domain.expect("ack tank high --occurrence 2", 1, &["is acknowledged already"]);
    let answer = domain.answer("ack tank high --json");
    assert_eq!(answer["alarm"]["state"], "active_acknowledged");
    domain.expect("ack tank hgh", 1, &["there is no alarm \"hgh\"; did you mean \"high\"?"]);
    domain.expect("ack tank empty", 1, &["\"empty\" is an event: its severity is info"]);
    let events = domain.answer("alarms tank --events --json");
    let acknowledged =
        events.as_array().unwrap().iter().filter(|it| it["change"] == "acknowledged");
    let acknowledged: Vec<_> = acknowledged.map(|it| (&it["occurrence"], &it["comment"])).collect();
    let expected =
        [(&json!(1), &json!("seen")), (&json!(2), &Value::Null), (&json!(3), &Value::Null)];
    assert_eq!(acknowledged, expected);
    // Events displace nothing of what operators did, and that they acknowledged is among it.
    let journal = domain.stdout("journal tank");
    assert!(journal.contains("set 1,") && !journal.contains("came"), "{journal}");
    let journal = domain.answer("journal tank --json");
    let acks: Vec<_> =
        journal.as_array().unwrap().iter().filter(|it| it["action"] == "ack").collect();
    let change = |before: u64, after: u64| json!([{"name": "high", "before": before, "after": after, "type": "INT"}]);
    let changes: Vec<_> = acks.iter().map(|ack| &ack["changes"]).collect();
    assert_eq!(changes, [&change(0, 1), &change(1, 2), &change(2, 3)]);
    assert!(acks[0]["comment"] == "seen" && acks[0]["client"].is_string(), "{acks:?}");
    let number = &acks[2]["transaction"];
    let cannot = &["is an acknowledgement, which cannot be undone"];
    domain.expect(&format!("undo tank {number}"), 1, cannot);
}

#[test]
fn an_alarm_that_is_active_for_less_than_a_look_is_not_missed() {
    let (domain, _node) = tank("");
    for _ in 0..3 {
        // One transaction each, some cycles apart.
        set(&domain, -1.0);
        set(&domain, 1.0);
    }
    wait_until("the node knows them", || {
        set(&domain, -1.0);
        let standing = domain.answer("alarms tank --process --json");
        let empty = standing.as_array().unwrap().iter().find(|it| it["name"] == "empty").cloned();
        empty.is_some_and(|empty| {
            assert_eq!(empty["state"], "active_acknowledged", "nobody acknowledges an event");
            empty["occurrence"] == 4
        })
    });
}

#[test]
fn a_new_configuration_adds_and_removes_alarms_and_keeps_those_of_the_same_definition() {
    let (domain, _node) = tank("");
    set(&domain, 1.7);
    high(&domain, "active_unacknowledged");
    let next = NODE
        .replace("Tank above 1.6 m", "Tank is too full")
        .replace("name = \"empty\"", "name = \"low\"")
        .replace("level <= 0 OR level > 99", "level < 5");
    domain.write("next.toml", &next);
    domain.run("apply tank next.toml --allow-missed").expect_code(0).prints(&["low"]);
    wait_until("the new alarm is there", || domain.stdout("alarms tank").contains("low"));
    let alarm = high(&domain, "active_unacknowledged");
    assert_eq!((&alarm["occurrence"], &alarm["text"]), (&json!(1), &json!("Tank is too full")));
    domain.write("other.toml", next.replace("level > 1.6", "level > 1.65"));
    let loses = "  loses    high (1 unacknowledged occurrence)\n";
    domain.run("apply tank other.toml --allow-missed --dry-run").expect_code(0).prints(&[loses]);
    domain.run("apply tank other.toml --allow-missed").expect_code(0).prints(&[loses]);
    wait_until("it is another alarm", || {
        high(&domain, "active_unacknowledged")["when"] == "level > 1.65"
    });
    let occurrence = &high(&domain, "active_unacknowledged")["occurrence"];
    assert_eq!(occurrence, 2, "no number is of two occurrences");
    domain.expect("ack tank empty", 1, &["there is no alarm \"empty\""]);
}

#[test]
fn the_log_has_the_events_the_journal_file_the_acknowledgement_and_a_recording_repeats_the_alarms()
{
    let (domain, node) = tank("--journal tank.jsonl --record run.mcap -v");
    set(&domain, 1.7);
    high(&domain, "active_unacknowledged");
    domain.run("ack tank high").expect_code(0);
    set(&domain, 1.0);
    high(&domain, "normal");
    let said = ["high 1 came in ", "high 1 acknowledged in ", "high 1 went in "];
    wait_until("the events, one a second", || {
        let events = domain.stdout("alarms tank --events");
        said.iter().all(|said| events.contains(said))
    });
    let said =
        ["came", "acknowledged", "went"].map(|change| format!("alarm \"high\" {change} in cycle "));
    node.stop().expect_code(0).says(&said);
    let journal = domain.stdout("journal tank.jsonl");
    assert!(journal.contains("ack 2,") && journal.contains("  high  0  -> 1\n"), "{journal}");
    assert!(journal.contains("set 3,") && !journal.contains("came"), "{journal}");
    domain.run("replay run.mcap").expect_code(0).prints(&["the same, bit for bit"]);
}

#[test]
fn a_restart_knows_what_was_acknowledged_and_goes_on_counting_occurrences() {
    let domain = Domain::new();
    let retaining = NODE.replace("[[task]]", "retain = true\nretain_every = \"100ms\"\n[[task]]");
    let start = |text: &str| {
        domain.write("tank.toml", text);
        domain.start_until("run tank.toml --state tank.state", "is running")
    };
    let node = start(&retaining);
    set(&domain, 1.7);
    high(&domain, "active_unacknowledged");
    domain.run("ack tank high").expect_code(0);
    node.stop().expect_code(0);
    let shown = domain.stdout("state tank.state");
    let row = shown.lines().find(|line| line.starts_with("  high ")).unwrap_or_default();
    assert!(
        row.contains("active since 20") && row.ends_with("occurrence 1  acknowledged"),
        "{shown}"
    );
    let alarms = &domain.answer("state tank.state --json")["alarms"];
    assert_eq!(alarms[0]["acknowledged"], 1, "{alarms}");
    assert_eq!(alarms.as_array().map(Vec::len), Some(1), "one was never active: {alarms}");

    let node = start(&retaining);
    let alarm = high(&domain, "active_acknowledged");
    assert_eq!((&alarm["occurrence"], &alarm["unacknowledged"]), (&json!(1), &json!(0)));
    assert_eq!(domain.answer("alarms tank --events --json"), json!([]), "it did not come again");
    for level in [1.0, 1.8] {
        set(&domain, level);
        high(&domain, if level > 1.6 { "active_unacknowledged" } else { "normal" });
    }
    assert_eq!(high(&domain, "active_unacknowledged")["occurrence"], 2);
    node.stop().expect_code(0);

    // What begins anew says what became of an alarm that was active.
    let node = start(&retaining.replace("retain_every", "retain_for = \"1ms\"\nretain_every"));
    wait_until("it came once more", || high(&domain, "active_unacknowledged")["occurrence"] == 3);
    assert_eq!(high(&domain, "active_unacknowledged")["unacknowledged"], 2);
    node.stop().expect_code(0);

    let node = start(&retaining.replace("level > 1.6", "level > 1.65"));
    let lost = "its condition was edited: high; lost: high (2 unacknowledged occurrences)";
    wait_until("the other condition", || {
        high(&domain, "active_unacknowledged")["when"] == "level > 1.65"
    });
    let alarm = high(&domain, "active_unacknowledged");
    assert_eq!((&alarm["occurrence"], &alarm["unacknowledged"]), (&json!(4), &json!(1)));
    node.stop().expect_code(0).says(&[lost]);
}

#[test]
fn check_and_simulate_show_the_alarms() {
    let domain = Domain::new();
    domain.write("tank.toml", NODE);
    domain.run("check tank.toml").expect_code(0).prints(&[
        "0 blocks, 2 alarms, 1 output",
        "    high   warning  level > 1.6 for 10ms, hysteresis 0.1  Tank above 1.6 m\n",
    ]);
    let checked = domain.answer("check tank.toml --json");
    assert_eq!(checked["tasks"][0]["alarms"][1]["severity"], "info");
    domain.write("in.csv", "level\n1.0\n1.7\n1.7\n1.7\n1.55\n1.5\n");
    let simulated = domain.run("simulate tank.toml --inputs in.csv --cycles 8").expect_code(0);
    let simulated = simulated.prints(&["3,1.7,1.0\n", "4,1.55,1.0\n", "5,1.5,0.0\n"]);
    simulated.says(&[
        "process alarms",
        "  high   came  3      0.015 s  level = 1.7  Tank above 1.6 m",
        "  high   went  5      0.025 s  level = 1.5  Tank above 1.6 m",
    ]);
}
