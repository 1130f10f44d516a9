//! What `run --record` writes of a node that runs in a process of its own.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

use crate::plant::{Observer, sensor};
use isochrone_control::{
    ApplyParams, Client, ForceParams, Hold, Params, ReleaseParams, SetParams, UndoParams, Values,
    Written,
};
use isochrone_ipc::Participant;
use isochrone_recording::{Item, Reader, RecordedEntry, RowHead};
use isochrone_testing::plants::GAUGE;
use isochrone_testing::{Domain, wait_until};
use serde_json::Value;

/// A row with what belongs to it.
struct Row {
    head: RowHead,
    input: (f64, bool),
    flags: Vec<u64>,
    outputs: Vec<Vec<u64>>,
    wires: Vec<Option<u64>>,
}

#[derive(Default)]
struct Recorded {
    configuration: Option<String>,
    rows: BTreeMap<String, Vec<Row>>,
    entries: Vec<RecordedEntry>,
    marks: usize,
    is_closed: bool,
    is_whole: bool,
}

fn read(path: &Path) -> Recorded {
    let mut reader = Reader::open(File::open(path).unwrap()).unwrap();
    let mut recorded = Recorded::default();
    while let Some(item) = reader.next_item().unwrap() {
        match item {
            Item::Row(row) => {
                let has_input = !row.layout.inputs.is_empty();
                let input =
                    has_input.then(|| row.input(0)).map_or((0.0, false), |it| (it.value, it.ok));
                let outputs = 0..row.layout.outputs.len();
                let bits =
                    |output| row.output(output).iter().map(|value| value.to_bits()).collect();
                let wires = 0..row.layout.wires.len();
                recorded.rows.entry(row.layout.task.clone()).or_default().push(Row {
                    head: row.head,
                    input,
                    flags: outputs.clone().map(|output| row.flags(output)).collect(),
                    outputs: outputs.map(bits).collect(),
                    wires: wires.map(|wire| row.wire(wire).map(|wire| wire.cycle)).collect(),
                });
            }
            Item::Entry(entry) => recorded.entries.push(entry),
            Item::Configuration(text) => recorded.configuration = Some(text),
            Item::Mark(_) => recorded.marks += 1,
            _ => panic!("nothing else is in it"),
        }
    }
    let condition = reader.condition();
    (recorded.is_closed, recorded.is_whole) = (condition.is_closed, condition.damaged == 0);
    recorded
}

/// Every cycle that ran has a row, in order.
#[track_caller]
fn check_rows(rows: &[Row]) {
    let first = rows[0].head;
    assert_eq!(first.cycle, first.missed, "no cycle ran before the first row");
    for pair in rows.windows(2) {
        let [before, row] = pair else { unreachable!() };
        let missed = row.head.missed - before.head.missed;
        assert_eq!((row.head.cycle, row.head.lost), (before.head.cycle + 1 + missed, 0));
        assert!(row.head.start_ns >= row.head.release_ns && row.head.end_ns >= row.head.start_ns);
    }
}

fn values<const N: usize>(values: [(&str, f64); N]) -> Values<Written> {
    values.into_iter().collect()
}

#[test]
fn a_recording_has_every_cycle_of_every_task_as_a_subscriber_saw_it_and_all_that_was_done() {
    let domain = Domain::new();
    let mut frames = Observer::before(&domain, "level/out", 3);
    let sensor = sensor(&domain, "25.5");
    let arguments = "--record out.mcap --report node.json";
    let process = domain.start_node("node.toml", GAUGE, arguments);
    let participant: Participant<_> = domain.join("operator");
    let mut client = Client::connect(&participant, "level", isochrone_testing::PATIENCE).unwrap();
    let mut seen = BTreeMap::new();
    let mut look = |until_cycles: u64| {
        let since = seen.len() as u64;
        wait_until("frames came", || {
            while let Some(frame) = frames.next() {
                seen.insert(frame.header.cycle, frame);
            }
            seen.len() as u64 >= since + until_cycles
        });
    };
    fn done<P: Params>(client: &mut Client, params: &P) -> P::Result {
        client.call(params).unwrap()
    }
    look(50);
    let set = SetParams { values: values([("ramp.setChangeRate", 3.0)]), ..SetParams::default() };
    let set = done(&mut client, &set);
    look(50);
    let (seconds, force) = (Hold::UntilReleased, values([("x", -7.25)]));
    let force =
        done(&mut client, &ForceParams { values: force, seconds, ..ForceParams::default() });
    let forced = force.tasks["fast"].cycle;
    look(50);
    let release = ReleaseParams { names: vec!["x".into()], client: None };
    let released = done(&mut client, &release).tasks["fast"].cycle;
    done(&mut client, &UndoParams { transaction: set.transaction, client: None });
    look(50);
    // Another task has a wire to the other one.
    let configuration = GAUGE.replace(
        "value = \"ramp.delayedValue\", setChangeRate = 5.0",
        "value = 3.0, setChangeRate = 5.0",
    );
    let apply = ApplyParams { configuration, allow_missed: Some(true), ..ApplyParams::default() };
    let changed = done(&mut client, &apply).tasks["slow"].cycle;
    look(100);
    sensor.stop().expect_code(0);
    look(50);
    process.stop().expect_code(0);
    look(0);

    let recorded = read(&domain.path("out.mcap"));
    assert!(recorded.is_closed && recorded.is_whole && recorded.marks == 0);
    assert_eq!(recorded.configuration.as_deref(), Some(GAUGE));
    let [fast, slow] = ["fast", "slow"].map(|task| &recorded.rows[task]);
    check_rows(fast);
    check_rows(slow);
    let mut compared = 0;
    for row in fast {
        // What an input read stands in the recording, and what a force holds it at in the frame.
        if row.input.1 && row.head.cycle > 50 {
            assert_eq!(row.input.0, 25.5, "{:?}", row.head);
        }
        let Some(frame) = seen.get(&row.head.cycle) else { continue };
        let bits: Vec<u64> = frame.values.iter().map(|value| value.to_bits()).collect();
        assert_eq!(row.outputs, [bits], "{:?}", row.head);
        // The last frame of a node says that it is the last, which is none of its values.
        if frame.header.flags & isochrone_ipc::Flags::STOPPED.bits() == 0 {
            assert_eq!(row.flags, [frame.header.flags], "{:?}", row.head);
        }
        let is_forced = (forced..released).contains(&row.head.cycle);
        assert_eq!(frame.values[1] == -7.25, is_forced, "{:?}", row.head);
        compared += 1;
    }
    assert!(compared >= 350, "{compared}");
    for row in slow {
        assert_eq!(row.wires.len(), usize::from(row.head.cycle < changed), "{:?}", row.head);
        let read = row.wires.first().copied().flatten();
        let release_ns =
            |cycle: u64| fast[0].head.release_ns + (cycle - fast[0].head.cycle) * 2_000_000;
        assert!(read.is_none_or(|cycle| release_ns(cycle) <= row.head.end_ns), "{:?}", row.head);
    }
    let actions: Vec<(String, String)> = recorded
        .entries
        .iter()
        .map(|entry| {
            let line: Value = serde_json::from_str(&entry.line).unwrap();
            assert_eq!(line["entry"]["cycle"], entry.cycle);
            (line["entry"]["action"].as_str().unwrap().to_owned(), entry.task.clone())
        })
        .collect();
    let actions: Vec<(&str, &str)> =
        actions.iter().map(|(action, task)| (&**action, &**task)).collect();
    let fast_actions = ["set", "force", "release", "undo"].map(|action| (action, "fast"));
    assert_eq!(actions[..4], fast_actions);
    let mut applied = actions[4..].to_vec();
    applied.sort();
    assert_eq!(applied, [("apply", "fast"), ("apply", "slow")]);
    assert!(recorded.entries.iter().any(|entry| entry.line.contains("value = 3.0")), "its text");
    let report = domain.json("node.json");
    let recording = &report["recording"];
    assert_eq!(recording["cycles"], (fast.len() + slow.len()) as u64);
    assert_eq!(recording["entries"], recorded.entries.len() as u64);
    assert_eq!((&recording["lost"], &recording["is_complete"]), (&0.into(), &true.into()));
}

#[test]
fn the_recording_of_a_node_that_is_killed_can_be_read_up_to_its_last_second() {
    let domain = Domain::new();
    let process = domain.start_node("node.toml", GAUGE, "--record out.mcap");
    let path = domain.path("out.mcap");
    let written = || read(&path).rows.get("fast").map_or(0, Vec::len);
    wait_until("its first second was written", || written() > 0);
    let first = written();
    wait_until("its next second was written", || written() > first);
    process.kill();
    let recorded = read(&path);
    assert!(!recorded.is_closed && recorded.is_whole);
    check_rows(&recorded.rows["fast"]);
}

#[test]
fn a_file_that_cannot_be_recorded_in_is_refused_before_the_node_starts() {
    let domain = Domain::with(&[("node.toml", GAUGE)]);
    for (file, said) in [
        ("node.toml", "node.toml"),
        ("/dev/full", "cannot write /dev/full"),
        ("nowhere/out.mcap", "cannot write nowhere/out.mcap"),
    ] {
        let run = domain.start_with(&["run", "node.toml", "--record", file]);
        run.finish().expect_code(2).says(&[said]);
    }
    assert_eq!(domain.read("node.toml"), GAUGE);
}
