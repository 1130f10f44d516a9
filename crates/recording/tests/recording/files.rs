//! Files as they are written and read back: whole, cut off, and damaged.

use std::io::{self, Cursor, Write};

use isochrone_ipc::{FrameHeader, SignalSpec};
use isochrone_recording::{
    Carried, ClockReading, FileCondition, Frame, Item, Mark, Reader, RecordingReadError,
    WriteError, Writer, repair,
};

pub(crate) const CLOCK: ClockReading =
    ClockReading { monotonic_ns: 1_000, unix_ns: 1_795_000_000_000_000_000 };

pub(crate) fn carried(service: &str, names: &[&str]) -> Carried {
    let signals = names.iter().map(|name| SignalSpec::new(*name, "LREAL")).collect();
    let (service, publisher) = (service.to_owned(), "level".to_owned());
    Carried { service, publisher, period_ns: Some(1_000_000), signals }
}

pub(crate) fn frame(sequence: u64, values: &[f64]) -> Frame<'_> {
    let release_ns = 2_000 + sequence * 1_000_000;
    let publish_ns = release_ns + 500;
    let header = FrameHeader {
        sequence,
        cycle: sequence * 2,
        release_ns,
        publish_ns,
        ..FrameHeader::default()
    };
    let received_ns = publish_ns + 70;
    Frame {
        header,
        values,
        received_ns,
        due_ns: release_ns,
        sent_ns: publish_ns,
        lost: sequence % 3,
    }
}

/// A file of so many frames, flushed after each tenth, not closed.
pub(crate) fn written(frames: u64) -> Writer<Vec<u8>> {
    let mut writer = Writer::create(Vec::new(), CLOCK).unwrap();
    let level =
        writer.add(&carried("plant/level", &["ramp.delayedValue", "y", "ramp.error"])).unwrap();
    for sequence in 0..frames {
        writer.write(level, &frame(sequence, &[sequence as f64, f64::NAN, -0.0])).unwrap();
        if sequence % 10 == 9 {
            writer.flush().unwrap();
        }
    }
    writer
}

/// What stands in a file, as text, and in what state it is.
pub(crate) fn read(bytes: &[u8]) -> Result<(Vec<String>, FileCondition), RecordingReadError> {
    let mut reader = Reader::open(bytes)?;
    let mut items = Vec::new();
    while let Some(item) = reader.next_item()? {
        items.push(match item {
            Item::Frame(frame) => {
                let bits: Vec<u64> = frame.values.iter().map(|value| value.to_bits()).collect();
                format!("{} {:?} {bits:x?} {}", frame.carried.service, frame.header, frame.lost)
            }
            Item::Mark(mark) => format!("{mark:?}"),
            other => panic!("none of services: {other:?}"),
        });
    }
    Ok((items, reader.condition().clone()))
}

pub(crate) fn expected(frames: u64) -> Vec<String> {
    let line = |sequence: u64| {
        let values = [sequence as f64, f64::NAN, -0.0];
        let Frame { header, lost, .. } = frame(sequence, &values);
        let bits = values.map(f64::to_bits);
        format!("plant/level {header:?} {bits:x?} {lost}")
    };
    (0..frames).map(line).collect()
}

#[test]
fn frames_read_back_bit_for_bit_with_their_times() {
    let bytes = written(25).finish().map_err(|(error, _)| error).unwrap();
    let closed = FileCondition { is_closed: true, ..FileCondition::default() };
    assert_eq!(read(&bytes).unwrap(), (expected(25), closed));

    let mut reader = Reader::open(&bytes[..]).unwrap();
    let Some(Item::Frame(first)) = reader.next_item().unwrap() else { panic!("a frame") };
    assert_eq!(*first.carried, carried("plant/level", &["ramp.delayedValue", "y", "ramp.error"]));
    assert_eq!((first.due_ns, first.received_ns), (2_000, 2_570));
    assert_eq!(first.due_unix_ns, CLOCK.unix_ns + 1_000);
    assert_eq!(first.sent_unix_ns, CLOCK.unix_ns + 1_500);
}

#[test]
fn marks_and_a_clock_that_was_set_stand_where_they_happened() {
    let mut writer = Writer::create(Vec::new(), CLOCK).unwrap();
    let level = writer.add(&carried("plant/level", &["y"])).unwrap();
    writer.write(level, &frame(0, &[1.0])).unwrap();
    let mark = Mark {
        kind: Mark::LOST.into(),
        service: "plant/level".into(),
        count: 3,
        ..Mark::default()
    };
    writer.mark(&mark).unwrap();
    // A clock that is disciplined drifts; one that is set jumps.
    writer.follow(ClockReading { unix_ns: CLOCK.unix_ns - 1_000_000, ..CLOCK }).unwrap();
    writer.write(level, &frame(3, &[1.0])).unwrap();
    writer.follow(ClockReading { unix_ns: 5_000, ..CLOCK }).unwrap();
    writer.write(level, &frame(4, &[1.0])).unwrap();
    let bytes = writer.finish().map_err(|(error, _)| error).unwrap();

    let mut reader = Reader::open(&bytes[..]).unwrap();
    let mut seen = Vec::new();
    while let Some(item) = reader.next_item().unwrap() {
        seen.push(match item {
            Item::Frame(frame) => format!("{} {}", frame.due_ns, frame.due_unix_ns),
            Item::Mark(read) => format!("{}", read == mark),
            other => panic!("none of services: {other:?}"),
        });
    }
    assert_eq!(
        seen,
        ["2000 1795000000000001000", "true", "3002000 1795000000003001000", "4002000 4006000"]
    );
}

#[test]
fn two_layouts_of_a_service_are_two_channels_of_one_topic_and_services_spelled_alike_are_two_topics()
 {
    let mut writer = Writer::create(Vec::new(), CLOCK).unwrap();
    for carried in [
        carried("plant/level", &["y"]),
        carried("plant/level", &["y", "z"]),
        carried("plant.level", &["y"]),
        carried("plant-level", &["y"]),
    ] {
        let channel = writer.add(&carried).unwrap();
        writer.write(channel, &frame(0, &[1.0])).unwrap();
    }
    let bytes = writer.finish().map_err(|(error, _)| error).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let mut topics: Vec<&str> = summary.channels.values().map(|it| it.topic.as_str()).collect();
    topics.sort_unstable();
    assert_eq!(topics, ["/plant/level", "/plant/level", "/plant_level", "/plant_level_2"]);
    assert_eq!(read(&bytes).unwrap().0.len(), 4);
}

#[test]
fn a_file_that_is_cut_off_anywhere_reads_up_to_its_last_whole_chunk() {
    let bytes = written(25).finish().map_err(|(error, _)| error).unwrap();
    let whole = expected(25);
    let mut most = 0;
    for length in 8..bytes.len() {
        let (items, condition) = read(&bytes[..length]).unwrap();
        assert_eq!(items[..], whole[..items.len()], "cut to {length}");
        assert!([0, 10, 20, 25].contains(&items.len()), "{} of {length}", items.len());
        assert!(
            items.len() >= most && !condition.is_closed && condition.damaged == 0,
            "{condition:?}"
        );
        most = items.len();
    }
    assert_eq!(most, 25);
    let error = read(&bytes[..7]).unwrap_err();
    assert_eq!(error.to_string(), "it is no MCAP file");
}

#[test]
fn a_file_that_is_not_closed_has_all_that_was_flushed_and_repair_closes_it() {
    let failed = written(25).give_up();
    assert_eq!((failed.lost_frames, failed.good_bytes), (5, failed.out.len() as u64));
    let (repaired, bytes) = repair(Cursor::new(&failed.out), Vec::new()).unwrap();
    assert_eq!((repaired.messages, repaired.condition.is_closed), (20, false));
    let closed = FileCondition { is_closed: true, is_of_part: true, ..FileCondition::default() };
    assert_eq!(read(&bytes).unwrap(), (expected(20), closed));
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    assert_eq!(summary.stats.unwrap().message_count, 20);
}

#[test]
fn damage_costs_its_own_chunk_alone_and_is_counted() {
    let mut bytes = written(30).finish().map_err(|(error, _)| error).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let second = &summary.chunk_indexes[1];
    let inside = second.compressed_data_offset().unwrap() + second.compressed_size / 2;
    bytes[inside as usize] ^= 0x10;
    let (items, condition) = read(&bytes).unwrap();
    let all = expected(30);
    assert_eq!(items, [&all[..10], &all[20..]].concat());
    assert_eq!((condition.damaged, condition.is_closed), (1, true));
    let damage = condition.first_damage.unwrap();
    assert_eq!(damage.at, second.chunk_start_offset);
    assert!(damage.what.contains("chunk"), "{damage:?}");
}

/// Takes so many bytes, and then no more.
#[derive(Debug)]
struct Disk {
    bytes: Vec<u8>,
    room: usize,
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let fits = bytes.len().min(self.room - self.bytes.len());
        if fits == 0 && !bytes.is_empty() {
            return Err(io::ErrorKind::StorageFull.into());
        }
        self.bytes.extend_from_slice(&bytes[..fits]);
        Ok(fits)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_disk_that_fills_leaves_a_file_that_reads_and_the_rest_is_counted() {
    let whole = written(40).give_up().out.len();
    for room in (2_000..whole).step_by(97) {
        let mut writer = Writer::create(Disk { bytes: Vec::new(), room }, CLOCK).unwrap();
        let level =
            writer.add(&carried("plant/level", &["ramp.delayedValue", "y", "ramp.error"])).unwrap();
        let mut given = 0;
        let error = (0..40).find_map(|sequence| {
            given += 1;
            let written = writer.write(level, &frame(sequence, &[sequence as f64, f64::NAN, -0.0]));
            let flushed = if sequence % 10 == 9 { writer.flush() } else { Ok(()) };
            written.and(flushed).err()
        });
        assert!(matches!(error, Some(WriteError::Io(_))), "room for {room} of {whole}: {error:?}");
        let failed = writer.give_up();
        let mut bytes = failed.out.bytes;
        bytes.truncate(failed.good_bytes as usize);
        let (items, condition) = read(&bytes).unwrap();
        assert_eq!(items, expected(given - failed.lost_frames));
        assert_eq!(condition, FileCondition::default());
    }
}

#[test]
fn a_disk_that_fills_at_the_end_costs_the_index_alone() {
    let room = written(20).give_up().out.len() + 40;
    let mut writer = Writer::create(Disk { bytes: Vec::new(), room }, CLOCK).unwrap();
    let level =
        writer.add(&carried("plant/level", &["ramp.delayedValue", "y", "ramp.error"])).unwrap();
    for sequence in 0..20 {
        writer.write(level, &frame(sequence, &[sequence as f64, f64::NAN, -0.0])).unwrap();
        if sequence % 10 == 9 {
            writer.flush().unwrap();
        }
    }
    let (_, failed) = writer.finish().unwrap_err();
    assert_eq!(failed.lost_frames, 0);
    let good = &failed.out.bytes[..failed.good_bytes as usize];
    assert_eq!(read(good).unwrap().0, expected(20));
}
