//! `replay`: what was recorded and the configuration does not have is not passed over in silence.

use crate::recorded_run::{CYCLES, configuration, record};
use isochrone_recording::{ClockReading, OutputLayout, RecordedNode, RowHead, TaskLayout, Writer};
use isochrone_testing::{Domain, Ended, assert_says};

/// Begins `run.mcap`.
fn begun(folder: &Domain, configuration: &str) -> Writer<std::fs::File> {
    let (name, version) = ("level".to_owned(), env!("CARGO_PKG_VERSION").to_owned());
    let node = RecordedNode { name, version, file: "level.toml".into() };
    let out = std::fs::File::create(folder.path("run.mcap")).unwrap();
    Writer::create_for_node(out, ClockReading::default(), &node, configuration).unwrap()
}

#[test]
fn what_the_configuration_does_not_have_is_never_the_same_unless_that_is_meant() {
    let folder = Domain::new();
    record(&folder.path("run.mcap"));
    let slow = "[[output]]\nservice = \"plant/slow\"";
    let without_output = configuration().split(slow).next().unwrap().to_owned();
    let block = |name: &str| {
        let at = configuration().find(&format!("[[block]]\nname = \"{name}\"")).unwrap();
        let end = configuration()[at + 1..].find("\n[[").unwrap() + at + 2;
        configuration()[at..end].to_owned()
    };
    let without_task = without_output
        .replace("[[task]]\nname = \"slow\"\nperiod = \"4ms\"\n", "")
        .replace(&block("back"), "")
        .replace(&block("follow"), "")
        .replace("\"back.delayedValue\", ", "");
    let slow_task = serde_json::json!({"task": "slow", "cycles": CYCLES / 4});
    let slow_signal =
        serde_json::json!({"task": "slow", "signal": "plant/slow.follow.delayedValue"});
    for (other, says, missing, is_told) in [
        (&without_output, "have them: 2 signals of the recording (if", 2, &slow_signal),
        (&without_task, "have them: 3 signals and 1 task of the recording (if", 4, &slow_task),
    ] {
        folder.write("new.toml", other);
        // What the online change did, which is left out, is none of this.
        let replay = "replay run.mcap --config new.toml --tolerance 1000 --report";
        let said = folder.run(&format!("{replay} no.json")).refused(4);
        assert_says(&said, &[says, "give --allow-missing); ", " are the same"]);
        let report = folder.json("no.json");
        assert_eq!((&report["is_same"], &report["different_values"]), (&false.into(), &0.into()));
        let told = report["missing"].as_array().unwrap();
        assert!(told.len() == missing && told.contains(is_told), "{told:?}");
        let Ended { stdout: out, .. } =
            folder.run(&format!("{replay} yes.json --allow-missing")).expect_code(0);
        assert_says(&out, &["the same, within 1000.0: "]);
        let report = folder.json("yes.json");
        assert_eq!(report["is_same"], true);
    }

    assert_says(
        &folder.run("replay run.mcap --allow-missing").refused(2),
        &["--config <NEW.toml>"],
    );
}

#[test]
fn a_configuration_of_another_run_is_found_and_thousands_of_outputs_take_no_longer_than_their_rows()
{
    const OUTPUTS: usize = 10_000;
    let folder = Domain::new();
    let service = |output: usize| format!("plant/s{output}");
    let signals = vec![isochrone_ipc::SignalSpec::new("x", "LREAL")];
    let output = |output| OutputLayout { service: service(output), signals: signals.clone() };
    let layout = TaskLayout {
        node: "level".into(),
        task: "fast".into(),
        period_ns: 1_000_000,
        outputs: (0..OUTPUTS).map(output).collect(),
        ..TaskLayout::default()
    };
    let configuration = "[node]\nname = \"level\"\n[[task]]\nname = \"fast\"\nperiod = \"1ms\"\n\
        [[input]]\nname = \"x\"\ntask = \"fast\"\nservice = \"plant/in\"\n\
        [[output]]\nservice = \"plant/s0\"\ntask = \"fast\"\nsignals = [\"x\"]\n";
    let mut writer = begun(&folder, configuration);
    let channel = writer.add_task(&layout).unwrap();
    let values = vec![0.0; layout.len()];
    for cycle in 0..10 {
        let release_ns = 1_000_000 * (cycle + 1);
        writer
            .write_row(channel, &RowHead { cycle, release_ns, ..RowHead::default() }, &values)
            .unwrap();
    }
    writer.finish().map_err(|(error, _)| error).unwrap();
    let said = folder.run("replay run.mcap").refused(4);
    assert_says(&said, &["have them: 9999 signals of the recording; 10 values", "9991 more here"]);
    let said = folder.run("publish --from run.mcap").refused(2);
    assert_says(&said, &["has 10000 services"]);
}

#[test]
fn a_task_of_which_every_row_was_lost_is_not_compared() {
    let folder = Domain::new();
    let task = |name: &str| format!("[[task]]\nname = \"{name}\"\nperiod = \"1ms\"\n");
    let of = |task: &str| {
        format!(
            "[[input]]\nname = \"{task}_x\"\ntask = \"{task}\"\nservice = \"plant/in/{task}\"\n\
             [[output]]\nservice = \"plant/{task}\"\ntask = \"{task}\"\nsignals = [\"{task}_x\"]\n"
        )
    };
    let tasks = ["a", "b"];
    let configuration = "[node]\nname = \"level\"\n".to_owned()
        + &tasks.map(task).concat()
        + &tasks.map(of).concat();
    let layout = |task: &str| TaskLayout {
        node: "level".into(),
        task: task.into(),
        period_ns: 1_000_000,
        inputs: vec![isochrone_ipc::SignalSpec::new(format!("{task}_x"), "LREAL")],
        outputs: vec![OutputLayout {
            service: format!("plant/{task}"),
            signals: vec![isochrone_ipc::SignalSpec::new(format!("{task}_x"), "LREAL")],
        }],
        ..TaskLayout::default()
    };
    let mut writer = begun(&folder, &configuration);
    let channel = writer.add_task(&layout("a")).unwrap();
    let head = RowHead { release_ns: 1_000_000, ..RowHead::default() };
    writer.write_row(channel, &head, &vec![0.0; layout("a").len()]).unwrap();
    writer.mark_lost_rows(&layout("b"), 6, 7, 9_000_000).unwrap();
    writer.finish().map_err(|(error, _)| error).unwrap();
    let said = folder.run("replay run.mcap").refused(4);
    assert_says(&said, &["task \"b\" cannot be compared from cycle 0 on: 7 rows were lost"]);
    assert_says(&said, &["1 value in 1 cycle of 2 tasks of \"level\" are the same"]);
}
