//! `check`: what runs is shown, and what does not is shown with its place and the way out.

use isochrone_testing::{Domain, Ended, Plant, assert_says};
use serde_json::json;

/// An input, a variable, blocks in numbers, a loop through `@prev`, and wires from one task to another.
const PLANT: &str = r#"
[node]
name = "plant"

[[task]]
name = "fast"
period = "1ms"
ob = 35
priority = 80
cpu = 1

[[task]]
name = "slow"
period = "2.5ms"
phase = "500us"
overrun = "stop"

[[input]]
name = "raw"
service = "plant/analog"
channel = 3
task = "fast"
default = 2.5
max_age = "20ms"
on_stale = "default"

[[variable]]
name = "switch"
type = "BOOL"
initial = false
task = "slow"

[[variable]]
name = "pace"
initial = 10
range = [0.5, inf]
task = "slow"

[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
task = "fast"
count = 2
in = { value = "raw", setChangeRate = "rate.{i}.y@prev" }

[[block]]
name = "rate"
type = "ScaleLinear"
task = "fast"
count = 2
in = { x = "ramp.{i}.delayedValue", x1 = 0, y1 = 1, x2 = 1, y2 = 2, yMin = 1, yMax = 2 }

[[block]]
name = "show"
type = "LimRateOfChangeCI"
task = "slow"
in = { value = "ramp.1.delayedValue", enDefaultOutValue = "switch", setChangeRate = "pace" }

[[output]]
service = "plant/show"
task = "slow"
signals = ["show.delayedValue", "show.status"]

[[output]]
service = "plant/level"
task = "fast"
signals = ["raw", "ramp.0.delayedValue"]
"#;

const PLANT_SHOWN: &str = r#"plant.toml: ok. Node "plant": 2 tasks, 1 input, 2 variables, 5 blocks, 2 outputs

task fast: every 1ms, OB 35, SCHED_FIFO 80, CPU 1, wake hybrid (cpu_budget 0.2), overrun skip
  inputs
    raw  LREAL  plant/analog[3]  default 2.5, stale after 20ms: default
  order of execution
    1.  ramp.0  LimRateOfChangeCI
    2.  ramp.1  LimRateOfChangeCI
    3.  rate.0  ScaleLinear
    4.  rate.1  ScaleLinear
  wires
    rate.0.y@prev        ->  ramp.0.setChangeRate
    rate.1.y@prev        ->  ramp.1.setChangeRate
    raw                  ->  ramp.0.value
    raw                  ->  ramp.1.value
    ramp.0.delayedValue  ->  rate.0.x
    ramp.1.delayedValue  ->  rate.1.x
  outputs
    plant/level  raw LREAL, ramp.0.delayedValue LREAL

task slow: every 2500us, phase 500us, normal scheduling, wake sleep, overrun stop
  variables
    switch  BOOL   initial FALSE
    pace    LREAL  initial 10.0, from 0.5 to inf
  order of execution
    1.  show  LimRateOfChangeCI
  wires
    switch                            ->  show.enDefaultOutValue
    pace                              ->  show.setChangeRate
    ramp.1.delayedValue of task fast  ->  show.value
  outputs
    plant/show  show.delayedValue LREAL, show.status WORD
"#;

/// Two blocks whose constants cannot be meant.
const DUBIOUS: &str = r#"
[node]
name = "dubious"
[[task]]
name = "t"
period = "1ms"
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
in = { setChangeRate = -1.0 }
[[block]]
name = "level"
type = "ScaleLinear"
in = { x = 0, x1 = 0, y1 = 0, x2 = 1, y2 = 1, yMin = 5, yMax = 1 }
[[block]]
name = "other"
type = "LimRateOfChangeCI"
in = { callOB = 36 }
"#;

#[test]
fn a_configuration_that_runs_is_shown() {
    let folder = Domain::with(&[("plant.toml", PLANT)]);
    assert_eq!(folder.run("check plant.toml").silently(), PLANT_SHOWN);
    assert_eq!(folder.run("check --strict plant.toml").silently(), PLANT_SHOWN);
}

#[test]
fn the_cpu_of_a_task_with_a_priority_is_shown_with_the_reason_for_it() {
    let open = PLANT.replacen("cpu = 1\n", "", 1);
    let folder = Domain::with(&[("plant.toml", &open)]);
    let shown = folder.run("check plant.toml").silently();
    for part in ["SCHED_FIFO 80, CPU auto, wake hybrid", "\n  auto would choose CPU "] {
        assert!(shown.contains(part), "{shown}");
    }
    let plan = folder.run("check --json plant.toml").json();
    let [fast, slow] = plan["tasks"].as_array().unwrap().as_slice() else { panic!("{plan}") };
    assert!(fast["cpu"].is_u64() && fast["cpu_reason"].is_string(), "{fast}");
    assert_eq!((&slow["cpu"], &slow["cpu_reason"]), (&json!(null), &json!(null)));

    let any = PLANT.replacen("cpu = 1\n", "cpu = \"any\"\n", 1);
    let shown = Domain::with(&[("plant.toml", &any)]).run("check plant.toml").silently();
    assert!(shown.contains("SCHED_FIFO 80, any CPU, wake hybrid"), "{shown}");
    assert!(!shown.contains("auto"), "{shown}");
}

#[test]
fn the_json_has_all_that_the_text_has() {
    let ran = Domain::with(&[("plant.toml", PLANT)]).run("check --json plant.toml");
    assert_eq!((ran.code(), ran.stderr.as_str()), (0, ""));
    let plan = ran.json();
    assert_eq!(
        (&plan["file"], &plan["node"], &plan["errors"], &plan["warnings"]),
        (&json!("plant.toml"), &json!("plant"), &json!([]), &json!([]))
    );
    let [fast, slow] = plan["tasks"].as_array().unwrap().as_slice() else { panic!("{plan}") };
    for (key, in_fast, in_slow) in [
        ("name", json!("fast"), json!("slow")),
        ("period_ns", json!(1_000_000), json!(2_500_000)),
        ("phase_ns", json!(0), json!(500_000)),
        ("ob", json!(35), json!(null)),
        ("priority", json!(80), json!(null)),
        ("cpu", json!(1), json!(null)),
        ("wake", json!("hybrid"), json!("sleep")),
        ("overrun", json!("skip"), json!("stop")),
    ] {
        assert_eq!((&fast[key], &slow[key]), (&in_fast, &in_slow), "{key}");
    }
    assert_eq!(
        fast["inputs"],
        json!([{
            "name": "raw", "type": "LREAL", "service": "plant/analog", "channel": 3,
            "default": 2.5, "range": null, "finite": true, "max_age_ns": 20_000_000,
            "on_stale": "default",
            "bad": "ignore", "feedback": false,
        }])
    );
    assert_eq!(
        slow["variables"],
        json!([
            { "name": "switch", "type": "BOOL", "initial": false, "range": null },
            // JSON has no infinity.
            { "name": "pace", "type": "LREAL", "initial": 10.0, "range": [0.5, null] },
        ])
    );
    assert_eq!((&slow["inputs"], &fast["variables"]), (&json!([]), &json!([])));
    assert_eq!(
        slow["order"],
        json!([{ "block": "show", "type": "LimRateOfChangeCI", "depth": 0 }])
    );
    assert_eq!(fast["order"][3], json!({ "block": "rate.1", "type": "ScaleLinear", "depth": 1 }));
    assert_eq!(
        fast["wires"][1],
        json!({ "from": "rate.1.y@prev", "from_task": "fast", "to": "ramp.1.setChangeRate" })
    );
    assert_eq!(
        slow["wires"][2],
        json!({ "from": "ramp.1.delayedValue", "from_task": "fast", "to": "show.value" })
    );
    assert_eq!(
        slow["outputs"],
        json!([{
            "service": "plant/show",
            "signals": [
                { "name": "show.delayedValue", "type": "LREAL" },
                { "name": "show.status", "type": "WORD" },
            ],
        }])
    );
}

#[test]
fn a_long_list_is_cut_in_the_text_and_whole_in_the_json() {
    let many = PLANT.replace("count = 2", "count = 500");
    let folder = Domain::with(&[("many.toml", &many)]);
    let text = folder.run("check many.toml").silently();
    assert_says(
        &text,
        &["1001 blocks", "ramp.39", "… and 960 more (--json lists all)", "… and 1460 more"],
    );
    assert!(text.lines().count() < 120, "{text}");
    let plan = folder.run("check --json many.toml").json();
    let fast = &plan["tasks"][0];
    assert_eq!(fast["order"].as_array().unwrap().len(), 1_000);
    assert_eq!(fast["wires"].as_array().unwrap().len(), 1_500);
}

#[test]
fn constants_that_a_block_refuses_are_warnings() {
    let folder = Domain::with(&[("dubious.toml", DUBIOUS)]);
    let Ended { stdout: text, stderr: warnings, .. } =
        folder.run("check dubious.toml").expect_code(0);
    assert!(text.starts_with("dubious.toml: ok."), "{text}");
    assert_says(
        &warnings,
        &[
            "dubious.toml: 3 warnings",
            "[dubious.toml:8:8]",
            "\"ramp\"",
            "16#8200",
            "setChangeRate is negative",
            "[dubious.toml:12:8]",
            "\"level\"",
            "16#8200",
            "yMin is greater than yMax",
            "[dubious.toml:16:8]",
            "\"other\"",
            "16#8601",
            "no task has the OB number",
            "help: change the constants",
            "help: leave callOB out",
        ],
    );
    let ran = folder.run("check --json dubious.toml");
    assert_eq!((ran.code(), ran.stderr.as_str()), (0, ""));
    let plan = ran.json();
    assert_eq!(plan["errors"], json!([]));
    let places = plan["warnings"].as_array().unwrap().iter();
    let places: Vec<_> = places.map(|warning| (&warning["code"], &warning["line"])).collect();
    let code = &json!("constant_error");
    assert_eq!(places, [(code, &json!(8)), (code, &json!(12)), (code, &json!(16))]);
}

/// A sawtooth that is not what it seems, and a ramp whose sample time is that of a task without a
/// number.
const WIRED: &str = r#"
[node]
name = "wired"
[[task]]
name = "fast"
period = "1ms"
[[task]]
name = "slow"
period = "100ms"
[[variable]]
name = "steps"
type = "INT"
initial = 3
task = "fast"
[[block]]
name = "saw"
type = "SawTooth"
task = "fast"
in = { numberSteps = "steps", timeRange = "T#0.5s", incrementRange = 1 }
[[block]]
name = "ramp"
type = "LimRateOfChangeCI"
task = "fast"
in = { value = 5.0, setChangeRate = 10.0, callOB = "slow" }
"#;

#[test]
fn what_is_read_at_certain_times_only_is_noted_and_is_no_fault() {
    let folder = Domain::with(&[("wired.toml", WIRED)]);
    let message = "block \"saw\" (SawTooth) reads what is wired to numberSteps in its first call and \
        while reset is TRUE, at no other time";
    let shown = folder.run("check --strict wired.toml").silently();
    let (_, notes) = shown.split_once("\nnotes\n").unwrap();
    assert!(notes.starts_with(&format!("  wired.toml:16:8: {message}\n    set reset")), "{notes}");
    let plan = folder.run("check --json wired.toml").json();
    assert_eq!(plan["warnings"], json!([]));
    let [note] = plan["notes"].as_array().unwrap().as_slice() else { panic!("{plan}") };
    let shown = (&note["code"], &note["message"], &note["line"], &note["column"]);
    assert_eq!(shown, (&json!("latched"), &json!(message), &json!(16), &json!(8)));
    assert!(note["remedy"].is_string());
}

#[test]
fn strict_makes_warnings_errors() {
    let folder = Domain::with(&[("dubious.toml", DUBIOUS)]);
    let error = folder.run("check --strict dubious.toml").refused(2);
    assert_says(&error, &["dubious.toml: 3 warnings", "[dubious.toml:8:8]"]);
    let ran = folder.run("check --strict --json dubious.toml");
    assert_eq!(ran.code(), 2);
    let document = ran.json();
    assert_eq!(document["tasks"], json!(null), "there is no plan to run");
    assert_eq!(document["warnings"].as_array().unwrap().len(), 3);
}

#[test]
fn a_file_that_is_no_configuration_is_refused_by_name() {
    let folder = Domain::with(&[
        ("empty", ""),
        ("blank", " \n\n"),
        ("comment", "# nothing\n"),
        ("no text", ""),
    ]);
    std::fs::create_dir(folder.path("folder")).unwrap();
    folder.write("binary", [b"[node]\nname = \"x\"".as_slice(), &[0xff, 0xfe, 0x00]].concat());
    folder.write("zeros", [0; 64]);
    std::fs::File::create(folder.path("huge")).unwrap().set_len(100 << 20).unwrap();
    for (file, says) in [
        ("empty", &["empty is empty", "[node]", "[[task]]"][..]),
        ("blank", &["blank is empty", "[node]", "[[task]]"]),
        ("comment", &["comment: 2 errors", "[comment:1:1]", "no [node]", "no [[task]]", "help:"]),
        ("folder", &["folder is a directory", "name the configuration file in it"]),
        ("folder/", &["folder/ is a directory"]),
        ("binary", &["binary is not a text file", "byte 17", "TOML"]),
        ("zeros", &["[zeros:1:1]", "not TOML"]),
        ("huge", &["huge is larger than 16 MiB", "count"]),
        ("missing", &["cannot read missing", "No such file"]),
        ("empty/x", &["cannot read empty/x", "Not a directory"]),
        ("/dev/null", &["/dev/null is not a file but a pipe, socket or device"]),
    ] {
        for args in [format!("check {file}"), format!("check --json {file}")] {
            let ran = folder.run(&args);
            assert_eq!(ran.code(), 2, "{args}");
            assert_says(&ran.stderr, says);
            assert!(ran.stderr.len() < 1_000, "{}", ran.stderr);
        }
        let error = folder.run(&format!("simulate {file} --cycles 1")).refused(2);
        assert_says(&error, says);
    }
}

#[test]
fn a_name_that_is_not_utf8_is_a_file_like_any_other() {
    use std::os::unix::ffi::OsStrExt;
    let folder = Domain::new();
    let name = std::ffi::OsStr::from_bytes(b"plant\xff.toml");
    std::fs::write(folder.path("").join(name), PLANT).unwrap();
    let shown = Ended::from(folder.command(&["check".as_ref(), name]).output().unwrap()).silently();
    assert_eq!(shown, PLANT_SHOWN.replace("plant.toml", "plant\u{fffd}.toml"));
}

#[test]
fn the_default_of_a_time_is_shown_as_a_time() {
    let text = Plant::new("n")
        .task("t", "1ms")
        .column("range", "TIME")
        .with("default = 1500")
        .saw("saw", "timeRange = \"range\"");
    let ran = Domain::with(&[("n.toml", &text)]).run("check n.toml");
    assert!(ran.silently().contains("default T#1s500ms\n"));
}
