//! What `export` and `publish --from` say of recordings that are damaged, or claim the impossible.

use std::path::Path;
use std::process::Command;

use isochrone_ipc::SignalSpec;
use isochrone_recording::{Carried, ClockReading, Frame, Writer};

/// A recording of `plant/level`, each frame in a chunk of its own.
fn recording(lost: &[u64]) -> Writer<Vec<u8>> {
    let mut writer = Writer::create(Vec::new(), ClockReading::default()).unwrap();
    let signals = vec![SignalSpec::new("y", "LREAL")];
    let carried = Carried { service: "plant/level".into(), signals, ..Carried::default() };
    let channel = writer.add(&carried).unwrap();
    for lost in lost.iter().copied() {
        let header = Default::default();
        let frame = Frame { header, values: &[0.5], received_ns: 1, due_ns: 1, sent_ns: 1, lost };
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
    let folder = tempfile::tempdir().unwrap();
    let file: &Path = &folder.path().join("out.mcap");
    std::fs::write(file, bytes).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_isochrone"));
    let output = command.args(arguments.split(' ')).current_dir(folder.path()).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
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
    assert_eq!((code, csv.lines().count()), (1, 1 + 4), "{said}");
}

#[test]
fn more_lost_frames_than_can_be_counted_are_the_most_that_can() {
    let bytes = recording(&[u64::MAX; 2]).finish().map_err(|(error, _)| error).unwrap();
    let (code, _, said) = run(&bytes, "export out.mcap -o out.csv");
    assert_eq!((code, said.trim()), (0, "2 frames, 18446744073709551615 lost"));
}
