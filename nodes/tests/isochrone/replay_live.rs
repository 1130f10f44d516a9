//! `replay` as a gate: what a node did that ran among other processes is repeated bit for bit, and what was
//! changed since is found where it begins.

use std::collections::BTreeMap;
use std::fs::File;

use crate::plant::Observer;
use crate::recorded_run;
use isochrone_recording::{ClockReading, Item, Reader, Writer};
use isochrone_testing::{Domain, Process, wait_until};
use rustix::process::Signal;
use serde_json::Value;

/// As the run that is stepped by hand, and slow enough for a machine that is busy with other tests.
fn at_ease(text: &str) -> String {
    let slower = text.replace("\"4ms\"", "\"20ms\"").replace("\"1ms\"", "\"5ms\"");
    slower.replace("max_age = \"20ms\"", "max_age = \"60ms\"")
}

fn target(domain: &Domain, wave: &str) -> Process {
    let arguments = ["publish", "plant/target", "--wave", wave, "--rate", "150"];
    let mut publisher = domain.start_with(&arguments);
    publisher.wait_for("publishing");
    publisher
}

/// Records a node whose input comes, goes and comes back as another one, while it is operated, held up and
/// changed.
fn recorded() -> Domain {
    let domain = Domain::new();
    domain.write("level.toml", at_ease(&recorded_run::configuration()));
    domain.write("changed.toml", at_ease(&recorded_run::changed()));
    let mut frames = Observer::before(&domain, "plant/level", 3);
    let node =
        domain.start_until("run level.toml --record run.mcap --report node.json", "is running");
    let mut cycles = |count: u64| {
        let (mut first, mut last) = (None, 0);
        wait_until("cycles came", || {
            while let Some(frame) = frames.next() {
                last = frame.header.cycle;
            }
            last >= *first.get_or_insert(last) + count
        });
    };
    let done = |arguments: &str| drop(domain.run(arguments).expect_code(0));
    cycles(40);
    let first = target(&domain, "sine");
    cycles(40);
    done("set level ramp.setChangeRate=250 follow.setChangeRate=90");
    done("force level target=3 --seconds 0.2");
    cycles(60);
    // Cycles are missed, with a force on its way to them.
    done("force level ramp.delayedValue=-2 --hold");
    node.signal(Signal::STOP);
    first.kill();
    std::thread::sleep(std::time::Duration::from_millis(100));
    node.signal(Signal::CONT);
    cycles(40);
    done("release level ramp.delayedValue");
    let second = target(&domain, "sawtooth");
    cycles(40);
    done("apply level changed.toml --allow-missed");
    done("set level extra.setChangeRate=20");
    cycles(60);
    second.stop().expect_code(0);
    cycles(40);
    node.stop().expect_code(0);
    domain
}

/// Writes the recording again, with the lowest bit of one value of a task's outputs changed, in a row of its
/// second half. Returns the cycle.
fn with_another_bit(domain: &Domain, task: &str) -> u64 {
    let read = || Reader::open(File::open(domain.path("run.mcap")).unwrap()).unwrap();
    let mut rows = 0;
    let mut reader = read();
    while let Some(item) = reader.next_item().unwrap() {
        rows += usize::from(matches!(item, Item::Row(row) if row.layout.task == task));
    }
    let node = reader.node().unwrap().clone();
    let text = at_ease(&recorded_run::configuration());
    let out = File::create(domain.path("flipped.mcap")).unwrap();
    let mut writer = Writer::create_for_node(out, ClockReading::default(), &node, &text).unwrap();
    let (mut channels, mut left, mut flipped) = (BTreeMap::new(), rows / 2, None);
    let mut reader = read();
    while let Some(item) = reader.next_item().unwrap() {
        match item {
            Item::Row(row) => {
                let channel = *channels
                    .entry(row.channel)
                    .or_insert_with(|| writer.add_task(row.layout).unwrap());
                let mut values = row.values.to_vec();
                if row.layout.task == task && flipped.is_none() {
                    left -= 1;
                    if left == 0 {
                        let value = &mut values[row.layout.output(0).start];
                        *value = f64::from_bits(value.to_bits() ^ 1);
                        flipped = Some(row.head.cycle);
                    }
                }
                writer.write_row(channel, &row.head, &values).unwrap();
            }
            Item::Entry(entry) => writer.write_entry(&entry).unwrap(),
            Item::Configuration(configuration) => assert_eq!(configuration, text),
            _ => panic!("nothing was lost, there is no frame, and no state"),
        }
    }
    writer.finish().map_err(|(error, _)| error).unwrap();
    flipped.unwrap()
}

#[test]
fn a_live_run_is_repeated_bit_for_bit_and_a_changed_bit_and_a_changed_rate_are_found() {
    let domain = recorded();
    let report = domain.json("node.json");
    let recording = &report["recording"];
    assert_eq!((&recording["lost"], &recording["is_complete"]), (&0.into(), &true.into()));

    let said = domain.run("replay run.mcap --report same.json").expect_code(0);
    assert!(said.stdout.starts_with("the same, bit for bit: "), "{}", said.stdout);
    let same = domain.json("same.json");
    let tasks = same["tasks"].as_array().unwrap();
    let compared: u64 = tasks.iter().map(|task| task["cycles"].as_u64().unwrap()).sum();
    assert_eq!(compared, recording["cycles"].as_u64().unwrap());
    let missed = report["tasks"][0]["missed"].as_u64().unwrap();
    assert!(missed > 0, "{report}");
    assert_eq!(tasks[0]["missed"], missed, "{same}");

    for task in ["fast", "slow"] {
        let cycle = with_another_bit(&domain, task);
        let said = domain.run("replay flipped.mcap").expect_code(1).stderr;
        let place = format!("in cycle {cycle} of task \"{task}\": ");
        assert!(said.contains(&place) && said.contains(" 1 differs"), "{place}: {said}");
    }

    // So slow that no pause of a busy machine lets it get where the other is.
    let other = at_ease(&recorded_run::configuration()).replace("Rate = 40.0", "Rate = 0.04");
    domain.write("other.toml", &other);
    // What was changed online is left out of the other configuration and differs too: first or second,
    // as the machine had time for the run.
    domain.expect(
        "replay run.mcap --config other.toml --report other.json",
        1,
        &["the first difference is in cycle "],
    );
    let signals = domain.json("other.json")["signals"].as_array().unwrap().clone();
    let names: Vec<&Value> = signals.iter().map(|signal| &signal["signal"]).collect();
    assert!(names.contains(&&"follow.delayedValue".into()), "{names:?}");
}
