//! Units and comments, from a configuration to whoever reads its values.

use isochrone_testing::{Domain, Process, wait_until};
use serde_json::{Value, json};

/// Reads a level in metres, and flow in whatever unit that is announced.
const NODE: &str = r#"
[node]
name = "tank"
control = "force"
[[task]]
name = "fast"
period = "5ms"
[[input]]
name = "level"
service = "plant/level"
signal = "level"
unit = "m"
comment = "Transmitter LT-101"
[[input]]
name = "flow"
service = "plant/flow"
signal = "flow"
[[variable]]
name = "setpoint"
initial = 1.0
unit = "m"
comment = "Wanted level"
[[variable]]
name = "dose"
initial = 0.0
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
unit = "m"
units = { setChangeRate = "m/s" }
comment = "Smooths the set point"
in = { value = "setpoint", setChangeRate = 1000.0 }
[[output]]
service = "tank/out"
unit = "l/s"
comment = "For the historian"
signals = ["level", "dose", "ramp.delayedValue", "level.ok"]
"#;

/// Publishes one value under a header with a unit.
fn publish(domain: &Domain, service: &str, header: &str) -> Process {
    domain.write("source.csv", format!("time_s,{header}\n0.0,0.5\n0.01,0.5\n"));
    domain.start(&format!("publish {service} --csv source.csv --count 1000000"))
}

fn alarms(domain: &Domain) -> Vec<Value> {
    domain.answer("alarms tank --json").as_array().unwrap().clone()
}

fn alarm(domain: &Domain, input: &str) -> Option<String> {
    let is_it = |alarm: &&Value| alarm["code"] == "unit" && alarm["name"] == input;
    let alarms = alarms(domain);
    alarms.iter().find(is_it).map(|alarm| alarm["meaning"].as_str().unwrap().to_owned())
}

fn signal(domain: &Domain, name: &str) -> Value {
    domain.answer(&format!("show tank {name} --json"))["signals"][0].clone()
}

#[test]
fn units_and_comments_are_shown_published_and_recorded() {
    let domain = Domain::new();
    let node = domain.start_node("tank.toml", NODE, "--record tank.mcap");
    let shown = domain.stdout("show tank setpoint ramp.delayedValue ramp.setChangeRate");
    for row in [
        "setpoint            1 m    variable   LREAL    Wanted level",
        "ramp.setChangeRate  1000 m/s  parameter  LREAL",
    ] {
        let is_it = |line: &str| line.split_whitespace().eq(row.split_whitespace());
        assert!(shown.lines().any(is_it), "{row}: {shown}");
    }
    assert!(shown.contains("Smooths the set point"), "{shown}");
    let described = signal(&domain, "ramp.delayedValue");
    assert_eq!(
        [&described["unit"], &described["comment"]],
        [&json!("m"), &json!("Smooths the set point")]
    );

    let observer = domain.start_until("subscribe tank/out --csv out.csv", "carries");
    domain.wait_for_rows("out.csv", 3);
    observer.stop().expect_code(0);
    let header = "time_s,cycle,level [m],dose [l/s],ramp.delayedValue [m],level.ok";
    assert_eq!(domain.read("out.csv").lines().next(), Some(header));
    let recorder = domain.start("record tank/out -o frames.mcap");
    let export = || domain.run("export frames.mcap -o - --incomplete").stdout;
    wait_until("a frame is recorded", || export().lines().count() > 1);
    recorder.stop().expect_code(0);
    node.stop().expect_code(0);

    domain.run("export frames.mcap -o again.csv").expect_code(0);
    assert!(domain.read("again.csv").starts_with(header));
    domain.run("export tank.mcap -o rows.csv --task fast").expect_code(0);
    let rows = domain.read("rows.csv");
    let head = rows.lines().next().unwrap();
    for column in ["in.level [m]", "in.level.age [s]", "in.flow,", "out.tank/out.dose [l/s]"] {
        assert!(head.contains(column), "{column}: {head}");
    }
}

#[test]
fn a_sample_in_another_unit_is_rejected_until_the_announced_unit_fits() {
    let domain = Domain::new();
    let node = domain.start_node("tank.toml", NODE, "--report tank.json");
    let centimetres = publish(&domain, "plant/level", "level [cm]");
    wait_until("the alarm", || alarm(&domain, "level").is_some());
    let meaning = alarm(&domain, "level").unwrap();
    for part in ["input \"level\" is in \"m\"", "announces it in \"cm\"", "correct the unit"] {
        assert!(meaning.contains(part), "{part}: {meaning}");
    }
    let level = signal(&domain, "level");
    assert_eq!(
        [&level["ok"], &level["value"], &level["unit"]],
        [&json!(false), &json!(0.0), &json!("m")]
    );
    let frame = domain.start_until("subscribe tank/out", "level=0.0");
    let printed = frame.stop().expect_code(0).stdout;
    assert!(printed.contains("REJECTED"), "{printed}");

    centimetres.stop().expect_code(0);
    let metres = publish(&domain, "plant/level", "level [m]");
    wait_until("the level", || signal(&domain, "level")["ok"] == true);
    assert_eq!(signal(&domain, "level")["value"], 0.5);
    wait_until("no alarm", || alarm(&domain, "level").is_none());
    metres.stop().expect_code(0);
    let log = node.stop().expect_code(0).stderr;
    assert!(log.contains("the frames of service \"plant/level\" have it in another unit"), "{log}");
    let report = domain.json("tank.json");
    assert_eq!(report["tasks"][0]["inputs"][0]["unit"], "m", "{report}");
    assert_eq!(report["tasks"][0]["inputs"][1].get("unit"), None, "{report}");
    let codes: Vec<&Value> =
        report["warnings"].as_array().unwrap().iter().map(|warning| &warning["code"]).collect();
    assert!(codes.contains(&&json!("unit")) && !codes.contains(&&json!("unfit_input")), "{report}");
}

#[test]
fn an_input_without_a_unit_takes_the_announced_one_and_a_change_of_it_only_alarms() {
    let domain = Domain::new();
    let node = domain.start_node("tank.toml", NODE, "");
    assert_eq!(signal(&domain, "flow")["unit"], json!(null));
    let litres = publish(&domain, "plant/flow", "flow [l/s]");
    wait_until("the unit", || signal(&domain, "flow")["unit"] == "l/s");
    wait_until("the flow", || signal(&domain, "flow")["ok"] == true);
    assert_eq!(alarm(&domain, "flow"), None);
    litres.stop().expect_code(0);
    let cubic = publish(&domain, "plant/flow", "flow [m³/h]");
    wait_until("the alarm", || alarm(&domain, "flow").is_some());
    assert!(alarm(&domain, "flow").unwrap().contains("\"l/s\""));
    wait_until("the flow", || signal(&domain, "flow")["ok"] == true);
    assert_eq!(signal(&domain, "flow")["unit"], "m³/h");
    cubic.stop().expect_code(0);
    node.stop().expect_code(0);
}

#[test]
fn a_column_in_another_unit_than_its_input_is_refused() {
    let domain = Domain::with(&[("tank.toml", NODE)]);
    domain.write("in.csv", "level [cm],flow [l/s]\n50,1\n");
    let says = ["in.csv: column \"level\" is in \"cm\", and the configuration has it in \"m\""];
    domain.expect("simulate tank.toml --inputs in.csv", 2, &says);
    domain.write("in.csv", "level [m],flow [l/s],setpoint [m]\n0.5,1,1\n");
    domain.run("simulate tank.toml --inputs in.csv").expect_code(0);
}

#[test]
fn a_column_is_chosen_by_its_name_or_its_header() {
    let domain = Domain::new();
    domain.write("a.csv", "time_s,level [m],flow [l/s],odd [x] []\n0.0,0.5,1,2\n");
    for (names, header) in [
        ("flow,level [m]", "time_s,cycle,flow [l/s],level [m]"),
        ("odd [x]", "time_s,cycle,odd [x] []"),
        ("odd [x] []", "time_s,cycle,odd [x] []"),
    ] {
        let chosen = ["--signals", names, "--count", "1000000"];
        let publisher =
            domain.start_with(&[&["publish", "a/b", "--csv", "a.csv"], &chosen[..]].concat());
        domain.run("subscribe a/b --csv again.csv --count 1").expect_code(0);
        publisher.stop().expect_code(0);
        assert_eq!(domain.read("again.csv").lines().next(), Some(header));
    }
}

#[test]
fn a_comment_is_applied_and_another_unit_of_what_is_published_is_refused() {
    let domain = Domain::new();
    let node = domain.start_node("tank.toml", NODE, "");
    let input = ("unit = \"m\"\ncomment = \"Transmitter", "unit = \"cm\"\ncomment = \"Transmitter");
    let output = ("unit = \"m\"\nunits", "unit = \"cm\"\nunits");
    for ((from, to), what) in [
        (input, "input \"level\" cannot be changed while the node runs: its unit would change"),
        (output, "the unit of ramp.delayedValue would change"),
    ] {
        domain.write("other.toml", NODE.replace(from, to));
        let refused = domain.run("apply tank other.toml --allow-missed").expect_code(1).stderr;
        assert!(refused.contains(what), "{refused}");
        assert!(refused.contains("stop the node and start it with the new"), "{refused}");
    }
    let other = NODE
        .replace("setChangeRate = \"m/s\"", "setChangeRate = \"mm/ms\"")
        .replace("Wanted level", "Set point of the level");
    domain.write("other.toml", other);
    domain.run("apply tank other.toml --allow-missed").expect_code(0);
    wait_until("the new comment", || {
        signal(&domain, "setpoint")["comment"] == "Set point of the level"
    });
    assert_eq!(signal(&domain, "ramp.setChangeRate")["unit"], "mm/ms");
    node.stop().expect_code(0);
}
