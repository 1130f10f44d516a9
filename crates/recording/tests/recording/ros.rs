//! Recordings of ROS 2: topics as services, and files that are none.

use std::collections::BTreeMap;
use std::io::Cursor;

use isochrone_recording::{Item, Reader, Uncarried};
use mcap::records::MessageHeader;
use proptest::prelude::*;

const STATE: &str = "\
std_msgs/Header header
float64[2] gains
uint64 ticks
string[] names
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
";

/// A message of `STATE`, little-endian.
fn state(gains: [f64; 2], ticks: u64, names: u32) -> Vec<u8> {
    let mut bytes = vec![0, 1, 0, 0];
    for number in [7_u32, 5, 1] {
        bytes.extend(number.to_le_bytes());
    }
    // An empty text, and what fills up to a multiple of eight.
    bytes.extend([0; 4]);
    for gain in gains {
        bytes.extend(gain.to_le_bytes());
    }
    bytes.extend(ticks.to_le_bytes());
    bytes.extend(names.to_le_bytes());
    bytes
}

/// A file with a topic of this schema, and messages 1 ms apart.
fn file(schema: (&str, &str, &[u8]), messages: &[Vec<u8>]) -> Vec<u8> {
    let mut writer = mcap::Writer::new(Cursor::new(Vec::new())).unwrap();
    let (name, encoding, text) = schema;
    let schema = writer.add_schema(name, encoding, text).unwrap();
    let channel = writer.add_channel(schema, "/robot/state", "cdr", &BTreeMap::new()).unwrap();
    for (number, message) in (0..).zip(messages) {
        let time = 1_000_000 * (10_000 + number);
        let header =
            MessageHeader { channel_id: channel, sequence: 0, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, message).unwrap();
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// A frame as its cycle, its source time and its values.
type Frame = (u64, u64, Vec<f64>);

/// Frames, what they do not carry, and what is damaged.
fn read(bytes: &[u8]) -> (Vec<Frame>, Vec<Uncarried>, Option<String>) {
    let mut reader = Reader::open_with_index(Cursor::new(bytes)).unwrap();
    let mut frames = Vec::new();
    while let Some(item) = reader.next_item().unwrap() {
        let Item::Frame(frame) = item else { panic!("{item:?}") };
        assert_eq!(frame.carried.service, "robot/state");
        frames.push((frame.header.cycle, frame.header.source_ns, frame.values.to_vec()));
    }
    let damage = reader.condition().first_damage.as_ref().map(|damage| damage.what.clone());
    (frames, reader.uncarried().cloned().collect(), damage)
}

fn refused(schema: (&str, &str, &[u8])) -> String {
    let (frames, uncarried, damage) = read(&file(schema, &[vec![0; 12]]));
    assert_eq!((frames.len(), damage), (0, None));
    let [Uncarried { service, what }] = &uncarried[..] else { panic!("{uncarried:?}") };
    assert_eq!(service, "robot/state");
    what.clone()
}

#[test]
fn the_numbers_of_a_topic_are_the_values_of_a_service() {
    let messages = [state([0.5, -1.0], 3, 0), state([f64::INFINITY, 1e-300], 1 << 60, 0)];
    let (frames, uncarried, damage) =
        read(&file(("own/msg/State", "ros2msg", STATE.as_bytes()), &messages));
    let values = [vec![0.5, -1.0, 3.0], vec![f64::INFINITY, 1e-300, (1_u64 << 60) as f64]];
    let [first, second] = values;
    assert_eq!(frames, [(0, 7_000_000_005, first), (1, 7_000_000_005, second)]);
    let what = "header.frame_id: string, names: string[]".to_owned();
    assert_eq!(uncarried, [Uncarried { service: "robot/state".into(), what }]);
    assert_eq!(damage, None);
}

#[test]
fn messages_that_are_none_of_their_type_are_damage_and_cost_no_other_one() {
    let good = state([1.0, 2.0], 3, 0);
    let cut = good[..20].to_vec();
    let other = [&[0, 7][..], &good[2..]].concat();
    for (bad, why) in [
        (cut, "a message of /robot/state that is no own/msg/State: gains: 2 elements do not fit"),
        (state([1.0, 2.0], 3, u32::MAX), "names: 4294967295 elements do not fit into the 0 bytes"),
        (state([1.0, 2.0], u64::MAX, 0), "ticks: no value holds this integer exactly"),
        (other, "it does not begin as plain CDR"),
        (Vec::new(), "it does not begin as plain CDR"),
    ] {
        let schema = ("own/msg/State", "ros2msg", STATE.as_bytes());
        let (frames, _, damage) = read(&file(schema, &[good.clone(), bad, good.clone()]));
        let cycles: Vec<u64> = frames.iter().map(|(cycle, ..)| *cycle).collect();
        assert_eq!(cycles, [0, 2], "{why}");
        assert!(damage.as_ref().is_some_and(|damage| damage.contains(why)), "{why}: {damage:?}");
    }
}

#[test]
fn a_topic_whose_schema_cannot_be_used_is_left_out_and_says_why() {
    let of = |text: &str| refused(("own/msg/State", "ros2msg", text.as_bytes()));
    assert!(of("own/Lost lost\n").contains("there is no definition of own/Lost"));
    assert!(of("float64 x\nfloat64 x\n").contains("line 2: there is a field x already"));
    assert!(of("wstring text\n").contains("wstring is not supported"));
    assert!(of("State[] again\n").contains("perhaps in itself"));
    assert!(of("float64[4294967295] x\n").contains("at most 1048576 are possible"));
    assert!(of("float64[5000] x\n").contains("own/msg/State has more than 4096 values"));
    assert!(of("string[] names\n").contains("has no number that all messages have"));
    assert!(of(&"#".repeat(1 << 21)).contains("has a definition of 2097152 bytes"));
    assert!(refused(("own/msg/State", "ros2msg", &[0xff])).contains("no UTF-8"));
    assert!(refused(("own/msg/State", "ros2idl", b"struct")).contains("ros2idl"));
}

#[test]
fn a_file_that_breaks_off_has_the_frames_before() {
    let messages: Vec<_> = (0..2000).map(|ticks| state([0.1, 0.2], ticks, 0)).collect();
    let whole = file(("own/msg/State", "ros2msg", STATE.as_bytes()), &messages);
    assert_eq!(read(&whole).0.len(), 2000);
    for bytes in [whole.len() / 2, whole.len() - 20] {
        let mut reader = Reader::open(&whole[..bytes]).unwrap();
        while reader.next_item().unwrap().is_some() {}
        assert!(!reader.condition().is_whole());
    }
}

proptest! {
    #[test]
    fn whatever_schema_and_message_there_are_reading_ends(
        text in "([a-z/]{1,8}(\\[[0-9]{0,9}\\])? [a-z]{1,3}\n){0,6}(===\nMSG: [a-z/]{1,6}\n){0,2}",
        message in prop::collection::vec(any::<u8>(), 0..80),
        at in 0..200_usize,
    ) {
        read_to_the_end(&file(("a/b", "ros2msg", text.as_bytes()), std::slice::from_ref(&message)));
        let mut state = state([1.0, 2.0], 3, 0);
        for (place, byte) in message.iter().enumerate() {
            let length = state.len();
            state[(at + 7 * place) % length] = *byte;
        }
        read_to_the_end(&file(("own/msg/State", "ros2msg", STATE.as_bytes()), &[state]));
    }
}

/// Each frame has a value for each of its signals.
fn read_to_the_end(bytes: &[u8]) {
    let mut reader = Reader::open_with_index(Cursor::new(bytes)).unwrap();
    while let Some(item) = reader.next_item().unwrap() {
        let Item::Frame(frame) = item else { panic!("{item:?}") };
        assert_eq!(frame.values.len(), frame.carried.signals.len());
    }
}
