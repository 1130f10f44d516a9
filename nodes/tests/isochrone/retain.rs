//! State that a node retains: restarts in order, kills, and files that are damaged, of others or full.

use std::thread;
use std::time::Duration;

use isochrone_testing::{Domain, Ended, Plant, Process, is_full_volume, wait_until};
use rustix::process::Resource;
use serde_json::{Value, json};

/// A task that counts its cycles in two ways, and one that a wire of it enters.
fn counters() -> Plant {
    Plant::new("counters")
        .with("control = \"force\"\nretain = true\nretain_every = \"100ms\"")
        .task("fast", "5ms")
        .task("slow", "20ms")
        .on("fast")
        .ramp("ramp", "value = 1e6, setChangeRate = 200.0")
        .saw("saw", "timeRange = 5, incrementRange = 1, endlessSteps = true")
        .with("[[variable]]\nname = \"setpoint\"\ntype = \"LREAL\"\ninitial = 20.0\nrange = [0.0, 100.0]\ntask = \"fast\"")
        .output("counters/fast", &["ramp.delayedValue", "saw.value"])
        .on("slow")
        .ramp("late", "value = \"setpoint\", setChangeRate = 10.0")
        .output("counters/slow", &["late.delayedValue"])
}

/// Runs a configuration for a number of cycles of its first task, with the state in `node.state`.
fn run(domain: &Domain, file: &str, cycles: u64, arguments: &str) -> Ended {
    domain.run(&format!("run {file} --state node.state --cycles {cycles} {arguments}"))
}

fn start(domain: &Domain, file: &str, arguments: &str) -> Process {
    domain.start_until(&format!("run {file} --state node.state {arguments}"), "is running")
}

fn state(domain: &Domain) -> Value {
    domain.answer("state node.state --json")
}

fn cycle(state: &Value) -> u64 {
    state["tasks"][0]["cycle"].as_u64().unwrap()
}

/// The cycles of the first task in a recording, with its counters.
fn recorded(domain: &Domain, file: &str) -> Vec<(u64, f64, f64)> {
    let csv = domain.run(&format!("export {file} --task fast --output -")).stdout;
    let mut rows = csv.lines().map(|row| row.split(',').collect::<Vec<_>>());
    let header = rows.next().unwrap();
    let column = |end: &str| header.iter().position(|name| name.ends_with(end)).unwrap();
    let columns = ["cycle", "ramp.delayedValue", "saw.value"].map(column);
    let row = |row: Vec<&str>| {
        let [cycle, ramp, saw] = columns.map(|column| row[column].parse::<f64>().unwrap());
        (cycle as u64, ramp, saw)
    };
    rows.map(row).collect()
}

#[test]
fn after_an_orderly_end_the_outputs_go_on_with_exactly_the_next_value() {
    let domain = Domain::with(&[("counters.toml", &counters())]);
    let restarts = if is_full_volume() { 100 } else { 5 };
    let mut rows = Vec::new();
    for restart in 0..restarts {
        let ended = run(&domain, "counters.toml", 7, &format!("--record {restart}.mcap"));
        let ended = ended.expect_code(0);
        assert_eq!(ended.stderr.contains("restored "), restart > 0, "{}", ended.stderr);
        rows.extend(recorded(&domain, &format!("{restart}.mcap")));
    }
    assert_eq!(rows.len(), 7 * restarts);
    assert!(rows.is_sorted_by(|(before, ..), (after, ..)| before < after));
    // On a busy machine the first cycles were missed.
    let (first, ..) = rows[0];
    for (ran, (cycle, ramp, saw)) in rows.into_iter().enumerate() {
        // One counts the cycles that ran, the other those that were due.
        assert_eq!((ramp, saw), ((ran + 1) as f64, f64::from((cycle - first) as i16)));
    }
    // A recording has what its run went on with.
    domain.run(&format!("replay {}.mcap", restarts - 1)).expect_code(0).prints(&["bit for bit"]);
}

#[test]
fn a_node_that_is_killed_at_any_moment_goes_on_from_a_whole_state() {
    let domain = Domain::with(&[("counters.toml", &counters())]);
    run(&domain, "counters.toml", 3, "").expect_code(0);
    let mut before = (cycle(&state(&domain)), 0.0);
    // On a busy machine the first cycles were missed.
    let first = before.0 - state(&domain)["values"]["saw.value"].as_u64().unwrap();
    let kills = if is_full_volume() { 500 } else { 12 };
    let mut seed = 7_u64;
    for _ in 0..kills {
        let node = start(&domain, "counters.toml", "");
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        thread::sleep(Duration::from_millis((seed >> 33) % 300));
        node.kill();
        let state = state(&domain);
        let number = |name: &str| state["values"][name].as_f64().unwrap();
        let (cycle, ramp) = (cycle(&state), number("ramp.delayedValue"));
        let due = f64::from((cycle - first) as i16);
        assert_eq!(number("saw.value"), due, "it counts the cycles that were due");
        assert!(ramp <= (cycle + 1) as f64, "it counts those that ran");
        assert!(cycle >= before.0 && ramp >= before.1, "{cycle}, {ramp} after {before:?}");
        before = (cycle, ramp);
    }
    assert!(before.0 > first + 3, "it was written while the node ran");
}

#[test]
fn what_was_set_comes_back_unless_the_file_was_edited() {
    let domain = Domain::with(&[("counters.toml", &counters())]);
    let node = start(&domain, "counters.toml", "--journal counters.jsonl");
    domain
        .run("set counters setpoint=80 ramp.setChangeRate=400 late.setChangeRate=7")
        .expect_code(0);
    let forced = domain.run("force counters ramp.delayedValue=3 --hold");
    forced.expect_code(0);
    let ended = node.stop().expect_code(0);
    assert!(!ended.stderr.contains("not saved"), "{}", ended.stderr);
    let set = json!({ "setpoint": 80.0, "ramp.setChangeRate": 400.0, "late.setChangeRate": 7.0 });
    assert_eq!(state(&domain)["set"], set);

    let saved = counters().replace("initial = 20.0", "initial = 80.0");
    domain.write("saved.toml", saved.replace("setChangeRate = 10.0", "setChangeRate = 7.0"));
    let restores = domain.answer("state node.state --json --config saved.toml");
    assert_eq!(restores["restores"]["unexpected"], json!([]));

    // Its type was edited, and its range.
    let now = counters().replace(
        "type = \"LREAL\"\ninitial = 20.0\nrange = [0.0, 100.0]",
        "type = \"INT\"\ninitial = 0",
    );
    domain.write("retyped.toml", now);
    let restores = domain.answer("state node.state --json --config retyped.toml");
    let dropped =
        "the value that was set for \"setpoint\" is dropped: it is INT now, and LREAL was set";
    assert_eq!(restores["restores"]["unexpected"], json!([dropped]));
    domain.write("narrow.toml", counters().replace("100.0]", "50.0]"));
    let restores = domain.answer("state node.state --json --config narrow.toml");
    let said = restores["restores"]["unexpected"][0].as_str().unwrap();
    assert!(said.contains("\"setpoint\" is dropped: "), "{said}");

    let edited = counters().replace("initial = 20.0", "initial = 30.0");
    domain.write("edited.toml", edited.replace("setChangeRate = 10.0", "setChangeRate = 11.0"));
    let restores = domain.answer("state node.state --json --config edited.toml");
    assert_eq!(restores["restores"]["values"], 2);
    let node = start(&domain, "edited.toml", "--journal counters.jsonl");
    let values =
        domain.answer("get counters setpoint ramp.setChangeRate late.setChangeRate --json");
    let expected =
        json!({ "setpoint": 80.0, "ramp.setChangeRate": 400.0, "late.setChangeRate": 11.0 });
    assert_eq!(values["values"], expected);
    // Forces are not retained, and what stood beneath one goes on.
    assert_eq!(domain.answer("forces counters --json"), json!([]));
    let journal = domain.stdout("journal counters");
    assert!(journal.contains("set 3, ") && journal.contains("by retained state"), "{journal}");
    node.stop().expect_code(0).says(&[
        "variable \"setpoint\" keeps 80.0, which was set; the file was edited since, and has 30.0",
        "\"late.setChangeRate\" was set to 7.0, and the file was edited since: it is 11.0",
    ]);
}

#[test]
fn an_input_is_stale_and_its_frames_are_restored_until_a_sample_comes() {
    let plant = Plant::new("tank")
        .with("retain = true")
        .task("fast", "5ms")
        .input("level", "tank/level", "default = -1.0\nmax_age = \"1h\"")
        .ramp("ramp", "value = \"level\", setChangeRate = inf")
        .output("tank/out", &["level", "ramp.delayedValue"]);
    let domain = Domain::with(&[("tank.toml", &plant)]);
    let node = start(&domain, "tank.toml", "");
    let publisher = domain.publish("tank/level --value 7");
    wait_until("the input has it", || {
        domain.answer("get tank level --json")["values"]["level"] == json!(7.0)
    });
    drop(node.stop().expect_code(0));
    publisher.stop().expect_code(0);
    let node = start(&domain, "tank.toml", "");
    let first = domain.run("subscribe tank/out --count 1 --json").expect_code(0);
    let first: Value = serde_json::from_str(first.stdout.lines().next_back().unwrap()).unwrap();
    assert_eq!(first["values"]["level"], 7.0);
    assert_eq!(first["flags"], json!(["STALE", "RESTORED"]));
    let mut subscriber = domain.start("subscribe tank/out");
    let publisher = domain.publish("tank/level --value 8");
    subscriber.wait_for("ramp.delayedValue=8.0");
    subscriber.wait_until("frames without flags", |stdout, _| {
        stdout.lines().next_back().is_some_and(|line| line.contains("=8.0") && !line.contains('['))
    });
    drop(subscriber);
    publisher.stop().expect_code(0);
    node.stop().expect_code(0);
}

#[test]
fn old_state_starts_cold_and_what_was_set_comes_back_at_any_age() {
    let plant = counters().replace("retain_every", "retain_for = \"1ms\"\nretain_every");
    let domain = Domain::with(&[("counters.toml", &plant)]);
    let node = start(&domain, "counters.toml", "");
    domain.run("set counters setpoint=80").expect_code(0);
    node.stop().expect_code(0);
    let before = cycle(&state(&domain));
    thread::sleep(Duration::from_millis(2));
    run(&domain, "counters.toml", 1, "").expect_code(0).says(&[
        "node \"counters\" starts cold",
        "retain_for is 1.00 ms",
        "restored 0 blocks, 0 inputs and 1 set value",
    ]);
    let state = state(&domain);
    assert!(cycle(&state) < before);
    assert_eq!(state["set"], json!({ "setpoint": 80.0 }));
}

#[test]
fn a_damaged_state_gives_way_to_the_one_before_and_two_stop_the_start() {
    let domain = Domain::with(&[("counters.toml", &counters())]);
    (0..2).for_each(|_| drop(run(&domain, "counters.toml", 3, "").expect_code(0)));
    domain.write("node.state", "no state");
    domain.run("state node.state").expect_code(0).says(&["it is not a state file"]);
    run(&domain, "counters.toml", 3, "")
        .expect_code(0)
        .says(&["kept as node.state.damaged", "restored 3 blocks"]);
    for file in ["node.state", "node.state.1"] {
        domain.write(file, "no state");
    }
    let refused = run(&domain, "counters.toml", 3, "").refused(2);
    assert!(refused.contains("`run --cold`") && refused.contains("on_damaged"), "{refused}");
    let plant = counters().replace("retain_every", "on_damaged = \"cold\"\nretain_every");
    domain.write("cold.toml", plant);
    let ended = run(&domain, "cold.toml", 3, "").expect_code(0);
    assert!(ended.stderr.contains("everything starts cold"), "{}", ended.stderr);
    assert_eq!(domain.read("node.state.cold"), "no state");
}

#[test]
fn cold_keeps_what_is_there_and_replaces_nothing() {
    let domain = Domain::with(&[("counters.toml", &counters())]);
    run(&domain, "counters.toml", 3, "--cold").expect_code(0);
    for cold in ["node.state.cold", "node.state.cold2"] {
        run(&domain, "counters.toml", 3, "").expect_code(0);
        let kept = std::fs::read(domain.path("node.state")).unwrap();
        let said = format!("starts cold; the state is kept as {cold}");
        run(&domain, "counters.toml", 3, "--cold").expect_code(0).says(&[said]);
        assert_eq!(std::fs::read(domain.path(cold)).unwrap(), kept);
    }
    // What was set in between is found again.
    domain
        .run("run counters.toml --state node.state.cold --cycles 3")
        .expect_code(0)
        .says(&["restored "]);
}

#[test]
fn a_state_of_another_program_or_of_no_file_is_refused() {
    let domain = Domain::with(&[("counters.toml", &counters())]);
    run(&domain, "counters.toml", 3, "").expect_code(0);
    let mut newer = std::fs::read(domain.path("node.state")).unwrap();
    newer[8] += 1;
    domain.write("node.state", newer);
    let refused = run(&domain, "counters.toml", 3, "").refused(2);
    assert!(refused.contains("has a format of version 2"), "{refused}");
    std::fs::remove_file(domain.path("node.state")).unwrap();
    let pipe = rustix::fs::FileType::Fifo;
    rustix::fs::mknodat(rustix::fs::CWD, domain.path("node.state"), pipe, 0o600.into(), 0).unwrap();
    let refused = run(&domain, "counters.toml", 3, "").refused(2);
    assert!(refused.contains("is no ordinary file"), "{refused}");
}

#[test]
fn a_state_that_is_not_the_nodes_own_to_write_refuses_the_start() {
    let domain = Domain::with(&[("counters.toml", &counters())]);
    let node = start(&domain, "counters.toml", "");
    let second = counters().replace("\"counters\"", "\"second\"");
    domain.write("second.toml", second.replace("counters/", "second/"));
    domain.expect("run second.toml --state node.state", 2, &["is in use by another process"]);
    node.stop().expect_code(0);
    domain.expect("run second.toml --state node.state", 2, &["the state of node \"counters\""]);
    domain.expect("run second.toml --state second.toml", 2, &["name another file"]);
    let states = ["node.state", "node.state.1"].map(|file| std::fs::read(domain.path(file)).ok());
    for file in ["--record node.state.1", "--report node.state", "--journal node.state.lock"] {
        let arguments = format!("run counters.toml --state node.state {file}");
        domain.expect(&arguments, 2, &["is a file of the retained state", "name another file"]);
    }
    assert_eq!(
        ["node.state", "node.state.1"].map(|file| std::fs::read(domain.path(file)).ok()),
        states
    );
    domain.write("plain.toml", counters().replace("retain = true\nretain_every = \"100ms\"", ""));
    domain.expect("run plain.toml --state node.state", 2, &["retain = true"]);
    domain.expect("run plain.toml --cold", 2, &["retain = true"]);
    domain.expect("state none.state", 2, &["there is no state none.state"]);
}

#[test]
fn a_full_disk_raises_an_alarm_and_costs_no_cycle() {
    let domain = Domain::with(&[("counters.toml", &counters())]);
    let node = start(&domain, "counters.toml", "");
    wait_until("it is written", || {
        domain.path("node.state").exists() && state(&domain)["tasks"][0]["cycle"].is_u64()
    });
    node.limit(Resource::Fsize, Some(1));
    wait_until("there is an alarm", || {
        domain.run("alarms counters").stdout.contains("cannot be written: File too large")
    });
    let ended = node.stop();
    assert_eq!(ended.code(), 1, "{}", ended.stderr);
    assert!(ended.stderr.contains("cannot be written: File too large"), "{}", ended.stderr);
    // What was written before stays.
    assert!(cycle(&state(&domain)) > 0);
}

#[test]
fn a_change_while_the_node_runs_is_retained_with_it() {
    let domain = Domain::with(&[("counters.toml", &counters())]);
    let new = counters().replace("name = \"saw\"", "name = \"teeth\"").replace("saw.", "teeth.");
    // Signals of outputs stay while a node runs.
    domain.write("new.toml", new.replace("\"teeth.value\"", "\"ramp.status\""));
    let plant = counters().replace("\"saw.value\"", "\"ramp.status\"");
    domain.write("counters.toml", plant);
    let node = start(&domain, "counters.toml", "");
    domain.run("apply counters new.toml --allow-missed").expect_code(0);
    wait_until("the state is of the new configuration", || {
        domain.path("node.state").exists() && state(&domain)["values"].get("teeth.value").is_some()
    });
    node.kill();
    let before = cycle(&state(&domain));
    run(&domain, "new.toml", 2, "").expect_code(0).says(&["restored 3 blocks"]);
    assert!(cycle(&state(&domain)) > before);
}

#[test]
fn without_a_name_the_state_is_in_the_folder_that_systemd_gives_or_at_home() {
    let domain = Domain::with(&[("counters.toml", &counters())]);
    for (variable, value, file) in [
        ("STATE_DIRECTORY", "given:other", "given/counters.state"),
        ("HOME", "home", "home/.local/state/isochrone/counters.state"),
    ] {
        let mut command = domain.command(&["run", "counters.toml", "--cycles", "3"]);
        command.env_remove("STATE_DIRECTORY").env(variable, domain.path("").join(value));
        Process::start(command).finish().expect_code(0);
        assert!(domain.path(file).exists(), "{file}");
    }
}

#[test]
fn with_confirm_nothing_is_sent_before_somebody_starts_a_node_that_goes_on() {
    let plant = counters().replace("retain_every", "warm_start = \"confirm\"\nretain_every");
    let domain = Domain::with(&[("counters.toml", &plant)]);
    // A cold start sends at once.
    run(&domain, "counters.toml", 3, "")
        .expect_code(0)
        .prints(&["link counters/fast (sent)\n  3 frames"]);
    let mut node = start(&domain, "counters.toml", "");
    node.wait_for("note: it sends nothing until you run `isochrone start counters`");
    let alarms = domain.run("alarms counters").stdout;
    assert!(alarms.contains("sends nothing before it is told to"), "{alarms}");
    let waits = "sends nothing before you run `isochrone start counters`";
    domain.expect("subscribe counters/fast --seconds 0.5", 1, &[waits]);
    let mut subscriber = domain.start_until("subscribe counters/fast", "counters/fast");
    assert_eq!(
        domain.stdout("start counters"),
        "node \"counters\" sends from its next cycles on\n"
    );
    subscriber.wait_for("ramp.delayedValue=");
    let again = domain.stdout("start counters");
    assert_eq!(again, "node \"counters\" was not waiting; it sends already\n");
    drop(subscriber);
    node.stop().expect_code(0);
    domain.write("read.toml", plant.replace("\"force\"", "\"read\""));
    domain.expect("check read.toml", 2, &["lets nobody start the node"]);
}
