//! A recording of ROS 2, played by a peer: what comes out of the bridge is what the recording itself has.

use std::fs::File;
use std::path::Path;
use std::process::Command;

use isochrone_ipc::SignalReader;
use isochrone_recording::{Item, Reader};
use isochrone_testing::{Domain, PATIENCE};

use crate::harness::Bridge;

const MESSAGES: usize = 80;

/// The values of a frame by the names of their signals, bit for bit.
type Bits = Vec<(String, u64)>;

/// Writes a recording and its messages as JSON with the library `rosbags`, and returns the frames that are read of it.
fn write(domain: &Domain) -> Vec<Bits> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let python = folder.ancestors().nth(2).unwrap().join("target/python-ros2/bin/python");
    assert!(
        python.exists(),
        "rosbags is missing: python3 -m venv target/python-ros2 && target/python-ros2/bin/pip install rosbags==0.11.9"
    );
    let mut command = Command::new(python);
    command.arg(folder.join("tests/bag.py")).arg(domain.path("bag")).arg(MESSAGES.to_string());
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    domain.write("messages.json", output.stdout);
    let mut reader = Reader::open(File::open(domain.path("bag/bag.mcap")).unwrap()).unwrap();
    let mut frames = Vec::new();
    while let Some(item) = reader.next_item().unwrap() {
        let Item::Frame(frame) = item else { continue };
        let values = frame.carried.signals.iter().zip(frame.values);
        frames.push(values.map(|(signal, value)| (signal.name.clone(), value.to_bits())).collect());
    }
    frames
}

#[test]
fn a_recording_that_a_peer_plays_comes_out_bit_for_bit() {
    let bridge = Bridge::start(
        r#"
        [[from_ros]]
        topic = "/imu"
        type = "sensor_msgs/msg/Imu"
        service = "robot/imu"
        depth = 1000
        "#,
    );
    let recorded = write(&bridge.domain);
    assert_eq!((recorded.len(), recorded[0].len()), (MESSAGES, 37));
    let participant = bridge.domain.join("reader");
    let mut reader = SignalReader::open(&participant, "robot/imu", &[]).unwrap();
    let messages = bridge.domain.path("messages.json");
    let peer = bridge.peer(&["play", "/imu", "Imu", messages.to_str().unwrap()]);
    let mut played: Vec<Bits> = Vec::new();
    while played.len() < MESSAGES {
        let frame = reader.wait(PATIENCE).expect("a frame comes");
        let values = frame.values().expect("its signals are announced");
        played.push(values.map(|(name, value)| (name.to_owned(), value.to_bits())).collect());
    }
    assert_eq!(played, recorded);
    peer.kill();
    bridge.stop().says(&[&format!("{MESSAGES} sent")]);
}
