//! Recordings of nodes as they are written and read back.

use std::io::Cursor;

use isochrone_ipc::SignalSpec;
use isochrone_recording::{
    Carried, ClockReading, Frame, Item, Mark, OutputLayout, Reader, RecordedEntry, RecordedInput,
    RecordedNode, RecordedWire, RecordingReadError, RowHead, TaskLayout, Writer, repair,
};

const CLOCK: ClockReading =
    ClockReading { monotonic_ns: 1_000, unix_ns: 1_795_000_000_000_000_000 };
const CONFIGURATION: &str = "[node]\nname = \"level\"\n";

fn node() -> RecordedNode {
    let (name, version) = ("level".to_owned(), "0.1.0".to_owned());
    RecordedNode { name, version, file: "level.toml".into() }
}

fn layout(task: &str) -> TaskLayout {
    let signal = |name: &str| SignalSpec::new(name, "LREAL");
    let (service, signals) = ("plant/level".to_owned(), vec![signal("ramp.y"), signal("target")]);
    TaskLayout {
        node: "level".into(),
        task: task.into(),
        period_ns: 1_000_000,
        inputs: vec![signal("target")],
        wires: vec!["slow".into()],
        outputs: vec![OutputLayout { service, signals }],
    }
}

fn head(cycle: u64) -> RowHead {
    let release_ns = 2_000 + cycle * 1_000_000;
    let (start_ns, end_ns) = (release_ns + 10, release_ns + 500);
    RowHead { cycle, release_ns, start_ns, end_ns, missed: 0, lost: 0 }
}

fn values(cycle: u64) -> Vec<f64> {
    let wire = if cycle == 0 { f64::NAN } else { (cycle - 1) as f64 };
    vec![7.0, cycle as f64, 1.0, 0.25, wire, 2.0, 8.0, -0.0, f64::from_bits(0x7ff8_0000_0000_0001)]
}

fn entry() -> RecordedEntry {
    let line = "{\"entry\":{\"sequence\":1}}".to_owned();
    RecordedEntry { time_ns: 5_000, cycle: 3, task: "fast".into(), line }
}

/// A recording of so many cycles, not closed.
fn written(cycles: u64) -> Writer<Vec<u8>> {
    let mut writer = Writer::create_for_node(Vec::new(), CLOCK, &node(), CONFIGURATION).unwrap();
    writer.attach_state(CLOCK, vec![1, 2, 3]).unwrap();
    let fast = writer.add_task(&layout("fast")).unwrap();
    for cycle in 0..cycles {
        writer.write_row(fast, &head(cycle), &values(cycle)).unwrap();
    }
    writer.write_entry(&entry()).unwrap();
    writer.mark_lost_rows(&layout("fast"), cycles, 9, 6_000).unwrap();
    writer
}

fn closed(cycles: u64) -> Vec<u8> {
    written(cycles).finish().map_err(|(error, _)| error).unwrap()
}

/// What stands in a file, as text.
fn read(bytes: &[u8]) -> Result<Vec<String>, RecordingReadError> {
    let mut reader = Reader::open(bytes)?;
    let mut items = Vec::new();
    while let Some(item) = reader.next_item()? {
        items.push(match item {
            Item::Frame(frame) => format!("frame {}", frame.carried.service),
            Item::Mark(mark) => format!("{} {} {}", mark.kind, mark.service, mark.count),
            Item::Row(row) => {
                let bits: Vec<u64> = row.values.iter().map(|value| value.to_bits()).collect();
                format!("{} {:?} {bits:x?}", row.layout.path(), row.head)
            }
            Item::Entry(entry) => format!("{entry:?}"),
            Item::Configuration(text) => text,
            Item::State(state) => format!("state {state:?}"),
        });
    }
    Ok(items)
}

#[test]
fn one_flipped_bit_does_not_cost_which_node_it_is_and_its_configuration_where_the_file_was_closed()
{
    let whole = closed(20);
    for at in 0..whole.len() {
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << (at % 8);
        let mut reader = Reader::open_with_index(Cursor::new(bytes)).unwrap();
        let mut configurations = Vec::new();
        while let Some(item) = reader.next_item().unwrap() {
            if let Item::Configuration(text) = item {
                configurations.push(text);
            }
        }
        assert_eq!(configurations, [CONFIGURATION], "byte {at}");
        assert!(reader.node().is_some(), "byte {at}");
        assert!(!reader.condition().is_whole(), "byte {at}");
    }
}

#[test]
fn rows_entries_and_the_configuration_read_back_bit_for_bit() {
    let bytes = closed(20);
    let row = |cycle| {
        let bits: Vec<u64> = values(cycle).iter().map(|value| value.to_bits()).collect();
        format!("level/fast {:?} {bits:x?}", head(cycle))
    };
    let mut expected = vec![CONFIGURATION.to_owned(), "state [1, 2, 3]".to_owned()];
    expected.extend((0..20).map(row));
    expected.extend([format!("{:?}", entry()), "lost level/fast 9".to_owned()]);
    assert_eq!(read(&bytes).unwrap(), expected);
}

#[test]
fn a_row_says_what_its_cycle_read_and_gave() {
    let bytes = closed(2);
    let mut reader = Reader::open(&bytes[..]).unwrap();
    let mut seen = 0;
    while let Some(item) = reader.next_item().unwrap() {
        let Item::Row(row) = item else { continue };
        let cycle = row.head.cycle;
        assert_eq!(*row.layout, layout("fast"));
        assert_eq!(row.entries(), 7);
        let input = RecordedInput { value: cycle as f64, ok: true, age_s: 0.25 };
        assert_eq!(row.input(0), input);
        let wire = (cycle > 0).then(|| RecordedWire { cycle: cycle - 1, changes: 2 });
        assert_eq!((row.wire(0), row.flags(0)), (wire, 8));
        assert_eq!(row.output(0).len(), 2);
        let unix_ns = |ns: u64| CLOCK.unix_ns + ns - CLOCK.monotonic_ns;
        let times = (row.release_unix_ns, row.end_unix_ns);
        assert_eq!(times, (unix_ns(row.head.release_ns), unix_ns(row.head.end_ns)));
        seen += 1;
    }
    assert_eq!((seen, reader.node()), (2, Some(&node())));
}

#[test]
fn a_task_and_a_service_that_are_spelled_alike_are_two_topics() {
    let mut writer = written(1);
    let carried = Carried { service: "level-fast".into(), ..Carried::default() };
    let same = Carried { service: "level/fast!".into(), ..carried.clone() };
    for carried in [carried, same] {
        let channel = writer.add(&carried).unwrap();
        let header = Default::default();
        let frame = Frame { header, values: &[], received_ns: 0, due_ns: 0, sent_ns: 0, lost: 0 };
        writer.write(channel, &frame).unwrap();
    }
    let bytes = writer.finish().map_err(|(error, _)| error).unwrap();
    let topics: Vec<String> = mcap::MessageStream::new(&bytes)
        .unwrap()
        .map(|message| message.unwrap().channel.topic.clone())
        .collect();
    assert_eq!(topics.first().map(String::as_str), Some("/level/fast"));
    assert!(topics.contains(&"/isochrone/journal".to_owned()), "{topics:?}");
    assert_eq!(topics.last().map(String::as_str), Some("/level/fast_"));
}

#[test]
fn a_recording_that_was_cut_off_is_closed_with_all_that_it_has() {
    let mut writer = written(30);
    writer.flush().unwrap();
    let bytes = writer.give_up().out;
    let (repaired, whole) = repair(Cursor::new(&bytes), Vec::new()).unwrap();
    assert!(!repaired.condition.is_closed);
    assert_eq!(read(&whole).unwrap(), read(&closed(30)).unwrap());
}

#[test]
fn a_configuration_in_which_a_bit_was_flipped_is_damage_and_stands_at_the_end_of_a_closed_file_alone()
 {
    let unclosed = || {
        let mut writer = written(3);
        writer.flush().unwrap();
        writer.give_up().out
    };
    for (mut bytes, expected) in [(closed(3), 1), (unclosed(), 0)] {
        let at = bytes.windows(6).position(|word| word == b"[node]").unwrap();
        bytes[at + 1] ^= 1;
        let mut reader = Reader::open(&bytes[..]).unwrap();
        let (mut rows, mut configurations) = (0, 0);
        while let Some(item) = reader.next_item().unwrap() {
            rows += u64::from(matches!(item, Item::Row(_)));
            configurations += u64::from(matches!(item, Item::Configuration(_)));
        }
        assert_eq!((rows, configurations, reader.condition().damaged), (3, expected, 1));
    }
}

#[test]
fn rows_that_are_lost_at_the_end_are_marked() {
    let items = read(&closed(1)).unwrap();
    assert_eq!(items.last().map(String::as_str), Some("lost level/fast 9"));
    assert_eq!(Mark::LOST, "lost");
}

/// Every byte of a file, changed in several ways: nothing that it claims makes the reader panic, or take more
/// values than the file has bytes for.
#[test]
fn whatever_a_byte_of_a_file_is_changed_to_it_is_read_to_some_end() {
    let whole = closed(3);
    for at in 0..whole.len() {
        for byte in [0, 0xff, whole[at] ^ 0x10] {
            let mut bytes = whole.clone();
            bytes[at] = byte;
            let items = read(&bytes).unwrap_or_default();
            assert!(items.iter().all(|item| item.len() < 1 << 16), "byte {at} = {byte}");
        }
    }
}
