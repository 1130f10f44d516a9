//! Recordings of ROS 2, as other programs write them: exported, and published to a node.
//!
//! They need `pip install mcap-ros2-support==0.6.0 rosbags==0.11.9`.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use isochrone_testing::{Domain, Plant};

use crate::interpreter;

/// The values of a frame, bit for bit.
type Bits = BTreeMap<String, String>;

/// Writes a recording `bag/bag.mcap`, and returns what its frames should have; `None` without the libraries.
fn write(domain: &Domain, library: &str, count: usize) -> Option<Vec<Bits>> {
    let packages = "mcap==1.6.0 mcap-ros2-support==0.6.0 rosbags==0.11.9";
    let python = interpreter::python("mcap_ros2, rosbags", packages)?;
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/isochrone/of_ros2/write.py");
    let mut command = Command::new(python);
    command.arg(script).arg(library).arg(domain.path("bag")).arg(count.to_string());
    let output = command.env("PYTHONDONTWRITEBYTECODE", "1").output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let lines = String::from_utf8(output.stdout).unwrap();
    Some(lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect())
}

/// The rows of a CSV by the names of their columns, as texts.
fn rows(csv: &str) -> Vec<BTreeMap<String, String>> {
    let mut lines = csv.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let row = |line: &str| {
        let cells = names.iter().zip(line.split(','));
        cells.map(|(name, cell)| ((*name).to_owned(), cell.to_owned())).collect()
    };
    lines.map(row).collect()
}

fn bits(text: &str) -> String {
    let bytes = text.parse::<f64>().unwrap().to_le_bytes();
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[test]
fn every_number_of_a_recorded_topic_is_a_column_bit_for_bit_and_what_is_none_is_named() {
    for library in ["rosbags", "mcap"] {
        let domain = Domain::new();
        let Some(expected) = write(&domain, library, 50) else { return };
        let columns = "--columns unix_ns -o state.csv";
        let ended = domain.run(&format!("export bag/bag.mcap {columns}")).expect_code(0);
        let others = "header.frame_id: string, mode: string, axes[0].name: string, axes[1].name: string, \
                      samples: float64[]";
        let said = format!("note: left out of \"robot/state\": {others}\n50 frames, 0 lost\n");
        assert_eq!(ended.stderr, said, "{library}");
        let rows = rows(&domain.read("state.csv"));
        assert_eq!(rows.len(), expected.len());
        for (number, (mut row, expected)) in rows.into_iter().zip(expected).enumerate() {
            let mut take = |column: &str| row.remove(column).unwrap();
            assert_eq!(take("cycle"), number.to_string());
            assert_eq!(take("time_s").parse(), Ok((20_000_000 * number) as f64 / 1e9));
            assert_eq!(
                take("unix_ns"),
                (1_700_000_000_000_000_000 + 20_000_000 * number).to_string()
            );
            let read: Bits = row.iter().map(|(name, text)| (name.clone(), bits(text))).collect();
            assert_eq!(read, expected, "{library}: {number}");
        }
    }
}

#[test]
fn a_recorded_topic_drives_a_node_whose_run_repeats_bit_for_bit() {
    let domain = Domain::new();
    let Some(expected) = write(&domain, "rosbags", 60) else { return };
    let plant = Plant::new("robot")
        .task("t", "5ms")
        .input("position", "robot/state", "signal = \"axes.1.position\"\ndefault = -1.0")
        .input("on", "robot/state", "type = \"BOOL\"\nsignal = \"is_on\"")
        .times(2.0, "twice", "\"position\"")
        .output("robot/out", &["twice.y", "on"]);
    let node = domain.start_node("node.toml", &plant, "--record node.mcap");
    let ended = domain.run("publish --from bag/bag.mcap").expect_code(0);
    assert_eq!(ended.stdout, "published 60 frames on \"robot/state\", 0 could not be sent\n");
    let no_number =
        "note: left out of \"chatter\": a std_msgs/msg/String has no number that all messages have";
    assert!(ended.stderr.contains(no_number), "{}", ended.stderr);
    node.stop().expect_code(0);
    let replayed = domain.run("replay node.mcap").expect_code(0);
    assert!(replayed.stdout.contains("the same, bit for bit"), "{}", replayed.stdout);

    domain.run("export node.mcap --task t -o node.csv").expect_code(0);
    let rows = rows(&domain.read("node.csv"));
    let mut read: Vec<String> = rows.iter().map(|row| bits(&row["in.position"])).collect();
    read.dedup();
    // On a busy machine the node may miss a frame; but it has no other value, and none out of turn.
    let mut sent = expected.iter().map(|frame| &frame["axes.1.position"]);
    let read = read.iter().filter(|value| **value != bits("-1.0"));
    let read: Vec<_> = read.collect();
    assert!(read.iter().all(|value| sent.any(|sent| sent == *value)), "{read:?}");
    assert_eq!(read.last(), expected.last().map(|frame| &frame["axes.1.position"]).as_ref());
    for row in &rows {
        let twice = row["in.position"].parse::<f64>().unwrap() * 2.0;
        assert_eq!(bits(&row["out.robot/out.twice.y"]), bits(&twice.to_string()));
    }
}

#[test]
fn a_recording_without_a_number_says_which_topics_it_has() {
    let domain = Domain::new();
    let Some(_) = write(&domain, "text", 5) else { return };
    let no_number =
        "left out of \"chatter\": a std_msgs/msg/String has no number that all messages have";
    let none = "only 5 messages of another program";
    domain.expect("export bag/bag.mcap -o -", 2, &[no_number, none]);
    domain.expect("publish --from bag/bag.mcap", 2, &[no_number, none]);
}
