//! Closed files in which bits were flipped, or parts removed: it is noticed, and all else is read.

use std::io::Cursor;

use isochrone_ipc::{FrameHeader, SignalSpec};
use isochrone_recording::{
    Carried, ClockReading, FileCondition, Frame, Item, Reader, Writer, repair,
};

/// Chunks of ten frames.
const FRAMES: u64 = 40;

fn closed() -> Vec<u8> {
    let mut writer = Writer::create(Vec::new(), ClockReading::default()).unwrap();
    let signals = vec![SignalSpec::new("y", "LREAL")];
    let carried = Carried { service: "plant/level".into(), signals, ..Carried::default() };
    let channel = writer.add(&carried).unwrap();
    for cycle in 0..FRAMES {
        let header = FrameHeader { cycle, ..FrameHeader::default() };
        let values = &[0.5];
        let frame = Frame { header, values, received_ns: 1, due_ns: cycle, sent_ns: 1, lost: 0 };
        writer.write(channel, &frame).unwrap();
        if cycle % 10 == 9 {
            writer.flush().unwrap();
        }
    }
    writer.finish().map_err(|(error, _)| error).unwrap()
}

/// The cycles in a file, and its state; nothing if it is refused.
fn read<R: std::io::Read>(
    reader: Result<Reader<R>, isochrone_recording::RecordingReadError>,
) -> Option<(Vec<u64>, FileCondition)> {
    let mut reader = reader.ok()?;
    let mut cycles = Vec::new();
    while let Some(item) = reader.next_item().ok()? {
        if let Item::Frame(frame) = item {
            cycles.push(frame.header.cycle);
        }
    }
    Some((cycles, reader.condition().clone()))
}

/// The same, read with and without what its end says.
fn both(bytes: &[u8]) -> [Option<(Vec<u64>, FileCondition)>; 2] {
    [read(Reader::open_with_index(Cursor::new(bytes))), read(Reader::open(bytes))]
}

/// Where the chunks begin, and how long they are.
fn chunks(bytes: &[u8]) -> Vec<(usize, usize)> {
    let indexes = mcap::Summary::read(bytes).unwrap().unwrap().chunk_indexes;
    let place = |it: &mcap::records::ChunkIndex| (it.chunk_start_offset, it.chunk_length);
    indexes.iter().map(place).map(|(at, length)| (at as usize, length as usize)).collect()
}

/// All cycles but those of a chunk.
fn without(chunk: u64) -> Vec<u64> {
    (0..FRAMES).filter(|cycle| cycle / 10 != chunk).collect()
}

#[test]
fn no_flipped_bit_goes_unnoticed_or_costs_more_than_the_frames_of_one_chunk() {
    let whole = closed();
    let healthy = Some((
        (0..FRAMES).collect(),
        FileCondition { is_closed: true, ..FileCondition::default() },
    ));
    assert_eq!(both(&whole), [healthy.clone(), healthy]);
    for at in 0..whole.len() {
        for bit in [at % 8, (at + 3) % 8] {
            let mut bytes = whole.clone();
            bytes[at] ^= 1 << bit;
            let [indexed, plain] = both(&bytes);
            let (cycles, condition) = indexed.unwrap_or_else(|| panic!("byte {at}, bit {bit}"));
            let is_most_read =
                cycles.len() as u64 == FRAMES || (0..4).any(|it| cycles == without(it));
            assert!(is_most_read, "byte {at}, bit {bit}: {cycles:?}, {condition:?}");
            for condition in plain.map(|(_, condition)| condition).into_iter().chain([condition]) {
                let is_said = condition.first_damage.is_some() && condition.is_closed;
                assert!(is_said, "byte {at}, bit {bit}: {condition:?}");
            }
        }
    }
}

#[test]
fn a_chunk_that_passes_for_another_record_is_missed_and_the_rest_is_read() {
    let whole = closed();
    for (chunk, (at, _)) in (0..).zip(chunks(&whole)) {
        for opcode in (0..0x80).filter(|opcode| *opcode != 0x06) {
            let mut bytes = whole.clone();
            bytes[at] = opcode;
            let [indexed, plain] = both(&bytes);
            let (cycles, condition) = indexed.unwrap();
            assert_eq!(cycles, without(chunk), "chunk {chunk} as {opcode:#04x}: {condition:?}");
            assert!(condition.damaged > 0 && plain.unwrap().1.damaged > 0, "as {opcode:#04x}");
        }
        // It could be another program's record, if it were not a chunk in all but its kind.
        let mut bytes = whole.clone();
        bytes[at] = 0x86;
        for (_, condition) in both(&bytes).into_iter().flatten() {
            let what = condition.first_damage.unwrap().what;
            assert_eq!(what, "a record (0x86) that cannot stand there");
        }
    }
}

#[test]
fn a_length_that_was_flipped_costs_at_most_its_own_chunk() {
    let whole = closed();
    for (chunk, (at, _)) in (0..).zip(chunks(&whole)) {
        for bit in 0..64 {
            let mut bytes = whole.clone();
            bytes[at + 1 + bit / 8] ^= 1 << (bit % 8);
            let [indexed, plain] = both(&bytes);
            let (cycles, condition) = indexed.unwrap();
            // One that is too long by a little still has all of the chunk.
            let are_others_read = cycles == without(chunk) || cycles.len() as u64 == FRAMES;
            assert!(are_others_read, "chunk {chunk}, bit {bit}: {cycles:?}, {condition:?}");
            assert!(condition.first_damage.unwrap().at >= at as u64, "bit {bit}");
            let (_, condition) = plain.unwrap();
            assert!(condition.is_closed && condition.damaged > 0, "{condition:?}");
        }
    }
}

/// The file as it is if its recorder is killed after its last chunk, and the chunks in it.
fn unclosed() -> (Vec<u8>, Vec<(usize, usize)>) {
    let whole = closed();
    let chunks = chunks(&whole);
    let end = mcap::Summary::read(&whole).unwrap().unwrap().chunk_indexes;
    let last = end.iter().max_by_key(|it| it.chunk_start_offset).unwrap();
    let indexes: u64 = last.message_index_length;
    let (at, length) = *chunks.iter().max().unwrap();
    (whole[..at + length + indexes as usize].to_vec(), chunks)
}

#[test]
fn without_an_end_that_knows_where_they_are_chunks_are_found_behind_a_wrong_length() {
    let (whole, chunks) = unclosed();
    let (cycles, condition) = read(Reader::open(&whole[..])).unwrap();
    assert_eq!((cycles, condition), ((0..FRAMES).collect(), FileCondition::default()));
    // The first one describes the signals of all.
    for (chunk, (at, length)) in (0..).zip(chunks).skip(1) {
        for bit in 0..64 {
            let mut bytes = whole.clone();
            bytes[at + 1 + bit / 8] ^= 1 << (bit % 8);
            for (cycles, condition) in both(&bytes).into_iter().flatten() {
                assert_eq!(cycles, without(chunk), "chunk {chunk}, bit {bit}: {condition:?}");
                assert_eq!((condition.damaged, condition.is_closed), (1, false), "bit {bit}");
                assert_eq!(condition.first_damage.unwrap().at, at as u64);
                assert_eq!(condition.unread_bytes, length as u64, "bit {bit}");
            }
        }
        // Zeros in its place, as a disk has them that lost its power.
        let mut bytes = whole.clone();
        bytes[at..at + length].fill(0);
        let (cycles, condition) = read(Reader::open(&bytes[..])).unwrap();
        assert_eq!((cycles, condition.damaged), (without(chunk), 1));
    }
}

#[test]
fn a_record_at_the_end_that_was_cut_off_is_no_damage_and_its_bytes_are_counted() {
    let (whole, chunks) = unclosed();
    let (at, length) = *chunks.iter().max().unwrap();
    for left in [1, 8, 9, 40, length / 2, length - 1] {
        let (cycles, condition) = read(Reader::open(&whole[..at + left])).unwrap();
        let expected = FileCondition { unread_bytes: left as u64, ..FileCondition::default() };
        assert_eq!((cycles, condition), (without(3), expected), "{left} bytes of it are left");
    }
}

#[test]
fn a_copy_of_a_part_says_that_it_is_one_and_so_does_a_copy_of_that() {
    let (unclosed, _) = unclosed();
    let copy = |bytes: &[u8]| repair(Cursor::new(bytes), Vec::new()).unwrap().1;
    let is_whole = |bytes: &[u8]| read(Reader::open(bytes)).unwrap().1.is_whole();
    assert!(is_whole(&closed()) && is_whole(&copy(&closed())));
    let mut bytes = unclosed;
    for _ in 0..2 {
        bytes = copy(&bytes);
        let (cycles, condition) = read(Reader::open(&bytes[..])).unwrap();
        assert_eq!(cycles.len() as u64, FRAMES);
        assert!(condition.is_closed && condition.is_of_part && !condition.is_whole());
    }
}

#[test]
fn a_chunk_that_is_removed_or_there_twice_is_told() {
    let whole = closed();
    for (at, length) in chunks(&whole) {
        let removed = [&whole[..at], &whole[at + length..]].concat();
        let twice = [&whole[..at + length], &whole[at..]].concat();
        for bytes in [removed, twice] {
            for (_, condition) in both(&bytes).into_iter().flatten() {
                assert!(condition.is_closed && condition.damaged > 0, "{condition:?}");
            }
        }
    }
}

#[test]
fn signals_whose_description_is_damaged_are_described_at_the_end_of_the_file() {
    let mut bytes = closed();
    let (at, length) = chunks(&bytes)[0];
    bytes[at + length / 2] ^= 1;
    let [indexed, plain] = both(&bytes);
    let (cycles, condition) = indexed.unwrap();
    assert_eq!((cycles, condition.damaged), (without(0), 1));
    assert!(plain.unwrap().0.is_empty());
    let (repaired, bytes) = repair(Cursor::new(bytes), Vec::new()).unwrap();
    assert_eq!((repaired.messages, repaired.condition.damaged), (30, 1));
    assert_eq!(read(Reader::open(&bytes[..])).unwrap().0, without(0));
}

#[test]
fn two_files_in_one_are_read_to_the_end_of_the_first_and_that_is_told() {
    let (cycles, condition) = both(&[closed(), closed()].concat())[1].clone().unwrap();
    assert_eq!(cycles.len() as u64, FRAMES);
    assert!(condition.first_damage.unwrap().what.contains("more behind the end of the file"));
}

#[test]
fn a_chunk_of_zeros_is_damaged_at_its_first_record() {
    let mut body = vec![0; 16];
    body.extend_from_slice(&(1_u64 << 20).to_le_bytes());
    body.extend_from_slice(&[0, 0, 0, 0, 4, 0, 0, 0]);
    body.extend_from_slice(b"zstd");
    let zeros = zstd::bulk::compress(&vec![0; 1 << 20], 1).unwrap();
    body.extend_from_slice(&(zeros.len() as u64).to_le_bytes());
    body.extend_from_slice(&zeros);
    let mut bytes = mcap::MAGIC.to_vec();
    bytes.push(0x06);
    bytes.extend_from_slice(&(body.len() as u64).to_le_bytes());
    bytes.extend_from_slice(&body);
    let (_, condition) = read(Reader::open(&bytes[..])).unwrap();
    assert_eq!((condition.damaged, condition.first_damage.unwrap().at), (1, 8));
}
