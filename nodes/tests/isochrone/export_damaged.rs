//! What `export`, `scope` and `publish --from` say of recordings that are damaged, or claim the impossible.

use isochrone_ipc::{FrameHeader, SignalSpec};
use isochrone_recording::{
    Carried, ClockReading, Frame, OutputLayout, RecordedNode, RowHead, TaskLayout, Writer,
};
use isochrone_testing::Domain;

/// A recording of `plant/level` with a frame for each of these losses, each in a chunk of its own.
fn recording(lost: &[u64]) -> Writer<Vec<u8>> {
    let mut writer = Writer::create(Vec::new(), ClockReading::default()).unwrap();
    let signals = vec![SignalSpec::new("y", "LREAL")];
    let carried = Carried { service: "plant/level".into(), signals, ..Carried::default() };
    let channel = writer.add(&carried).unwrap();
    for (cycle, lost) in (0..).zip(lost.iter().copied()) {
        let header = FrameHeader { cycle, sequence: cycle, ..FrameHeader::default() };
        let due_ns = 1 + cycle;
        let (received_ns, sent_ns) = (due_ns, due_ns);
        let frame = Frame { header, values: &[0.5], received_ns, due_ns, sent_ns, lost };
        writer.write(channel, &frame).unwrap();
        writer.flush().unwrap();
    }
    writer
}

/// Changes the first chunk.
fn damage(bytes: &mut [u8]) {
    let is_zstd = |four: &[u8]| four == [0x28, 0xb5, 0x2f, 0xfd];
    let chunk = bytes.windows(4).position(is_zstd).unwrap();
    bytes[chunk + 20] ^= 1;
}

/// Runs a verb on a file: exit status, stdout, stderr.
fn run(bytes: &[u8], arguments: &str) -> (i32, String, String) {
    let domain = Domain::new();
    domain.write("out.mcap", bytes);
    let ended = domain.run(arguments);
    (ended.code(), ended.stdout, ended.stderr)
}

#[test]
fn what_is_missing_where_something_is_damaged_is_said_with_the_damage_first() {
    let mut bytes = recording(&[0]).give_up().out;
    damage(&mut bytes);
    for (arguments, status, lacks) in [
        ("export out.mcap -o -", 1, "the recording has no frames"),
        ("export out.mcap --service plant/level -o -", 1, "has no frames of \"plant/level\""),
        ("publish --from out.mcap", 1, "out.mcap has no frames"),
        ("replay out.mcap", 2, "has neither cycles of a node nor frames"),
    ] {
        let (code, _, said) = run(&bytes, arguments);
        let damage = said.find("out.mcap is damaged: 1 part left out, the first at byte");
        let lacks = said.find(lacks);
        assert!(damage.is_some() && damage < lacks && code == status, "{arguments}: {code} {said}");
    }
}

#[test]
fn a_chunk_with_the_signals_that_is_damaged_costs_its_own_frames_alone() {
    let mut bytes = recording(&[0; 5]).finish().map_err(|(error, _)| error).unwrap();
    damage(&mut bytes);
    let (code, csv, said) = run(&bytes, "export out.mcap -o -");
    assert_eq!((code, csv.lines().count()), (4, 1 + 4), "{said}");
    assert!(said.contains(" bytes and 1 message"), "{said}");
    let (code, ..) = run(&bytes, "export out.mcap --incomplete -o -");
    assert_eq!(code, 0);
}

#[test]
fn a_compression_that_was_flipped_costs_its_own_chunk_alone() {
    let mut bytes = recording(&[0; 5]).finish().map_err(|(error, _)| error).unwrap();
    let name = bytes.windows(4).position(|it| it == b"zstd").unwrap();
    bytes[name + 3] ^= 1;
    let (code, csv, said) = run(&bytes, "export out.mcap -o -");
    assert_eq!((code, csv.lines().count()), (4, 1 + 4), "{said}");
    assert!(said.contains("a chunk with an unknown compression"), "{said}");
}

#[test]
fn cycles_that_were_missed_are_told_from_those_that_were_lost() {
    let (node, clock) =
        (RecordedNode { name: "late".into(), ..RecordedNode::default() }, ClockReading::default());
    let mut writer = Writer::create_for_node(Vec::new(), clock, &node, "").unwrap();
    let outputs = vec![OutputLayout {
        service: "plant/late".into(),
        signals: vec![SignalSpec::new("y", "LREAL")],
    }];
    let (node, task, period_ns) = (node.name, "t".to_owned(), 1_000_000);
    let layout = TaskLayout { node, task, period_ns, inputs: vec![], wires: vec![], outputs };
    let channel = writer.add_task(&layout).unwrap();
    // Six cycles are missed before the third row, and two rows are lost before the last one.
    for (cycle, missed, lost) in [(0, 0, 0), (1, 0, 0), (8, 6, 0), (11, 6, 2)] {
        let release_ns = 1 + cycle * period_ns;
        let (start_ns, end_ns) = (release_ns, release_ns);
        let head = RowHead { cycle, release_ns, start_ns, end_ns, missed, lost };
        writer.write_row(channel, &head, &[0.0, 0.0, 0.5]).unwrap();
    }
    let bytes = writer.finish().map_err(|(error, _)| error).unwrap();
    let domain = Domain::new();
    domain.write("late.mcap", bytes);
    let exported = domain.run("export late.mcap -o late.csv").expect_code(0);
    assert_eq!(exported.stderr.trim(), "4 cycles, 2 lost, 6 missed");
    let csv = domain.read("late.csv");
    let rows: Vec<&str> = csv.lines().collect();
    assert!(rows[0].ends_with(",out.plant/late.y,missed_cycles"), "{csv}");
    assert!(rows[3].starts_with("0.008,8,") && rows[3].ends_with(",0.5,6.0"), "{csv}");
    domain.run("scope late.mcap -o shot.mcap").expect_code(0);
    let exported = domain.run("export shot.mcap -o shot.csv").expect_code(0);
    assert_eq!(exported.stderr.trim(), "4 frames, 2 lost, 6 missed");
    for file in ["late.mcap", "late.csv", "shot.mcap", "shot.csv"] {
        let shown = domain.run(&format!("scope {file}")).expect_code(0).stderr;
        assert!(shown.contains("missed 6 cycles") && shown.contains("2 cycles"), "{file}: {shown}");
    }
    // It is no signal.
    let again = domain.run("publish plant/again --csv late.csv --count 4").expect_code(0);
    assert!(!again.stderr.contains("missed_cycles"), "{}", again.stderr);
}

#[test]
fn more_lost_frames_than_can_be_counted_are_the_most_that_can() {
    let bytes = recording(&[u64::MAX; 2]).finish().map_err(|(error, _)| error).unwrap();
    let (code, _, said) = run(&bytes, "export out.mcap -o out.csv");
    assert_eq!((code, said.trim()), (0, "2 frames, 18446744073709551615 lost"));
}

#[test]
fn part_of_a_recording_is_no_success_unless_that_is_accepted_and_what_was_not_read_is_counted() {
    // Its recorder was killed.
    let whole = recording(&[0; 9]).give_up().out;
    let chunk = |number: usize| {
        let zstd = whole.windows(4).enumerate().filter(|(_, it)| *it == [0x28, 0xb5, 0x2f, 0xfd]);
        // Its head, its fields, and the name of its compression stand before what is compressed.
        zstd.map(|(at, _)| at - 9 - 28 - 4 - 4 - 8).nth(number).unwrap()
    };
    let mut flipped = whole.clone();
    // More than the file has.
    flipped[chunk(4) + 4] ^= 0x40;
    let cut = &whole[..chunk(8) + 30];
    for (bytes, rows, says) in [
        (&whole[..], 9, "what came after cycle 8 of \"plant/level\" is not known"),
        (&flipped, 8, "out.mcap is damaged: 1 part left out, the first at byte"),
        (&flipped, 8, " bytes and 1 cycle"),
        (cut, 8, "what came after cycle 7 of \"plant/level\" is not known; not read: 30 bytes"),
    ] {
        let (code, csv, said) = run(bytes, "export out.mcap -o -");
        assert_eq!((code, csv.lines().count()), (4, 1 + rows), "{said}");
        assert!(said.contains(says) && said.contains("(--incomplete accepts that)"), "{said}");
        let (code, csv, said) = run(bytes, "export out.mcap --incomplete -o -");
        assert_eq!((code, csv.lines().count()), (0, 1 + rows), "{said}");
        assert!(said.contains(says), "{said}");
    }
    // To close what was not closed is what it is for, and a chart needs no whole; what is damaged is another matter.
    for (bytes, status) in [(&whole[..], 0), (cut, 0), (&flipped, 4)] {
        for arguments in ["export out.mcap -o closed.mcap", "scope out.mcap -o shot.csv"] {
            let (code, _, said) = run(bytes, arguments);
            assert_eq!(code, status, "{arguments}: {said}");
        }
    }
}
