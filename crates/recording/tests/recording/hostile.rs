//! Files that are no recordings of this program, or hostile.

use std::collections::BTreeMap;
use std::io::Cursor;

use isochrone_recording::{FileCondition, Item, MAX_RECORD_BYTES, Reader, Writer, repair};
use mcap::records::MessageHeader;
use proptest::prelude::*;

use crate::files::{CLOCK, carried, expected, frame, read, written};

#[test]
fn what_is_no_recording_is_refused_or_passed_over_with_the_reason() {
    let refused = |bytes: &[u8]| read(bytes).unwrap_err().to_string();
    assert_eq!(refused(b""), "it is no MCAP file");
    assert_eq!(refused(b"time_s,cycle,level.y\n0.0,1,2.0\n"), "it is no MCAP file");

    let of_another = |topic: &str, metadata: &[(&str, &str)]| {
        let mut writer = mcap::Writer::new(Cursor::new(Vec::new())).unwrap();
        let metadata = metadata.iter().map(|(key, value)| ((*key).into(), (*value).into()));
        let metadata: BTreeMap<String, String> = metadata.collect();
        let id = writer.add_channel(0, topic, "json", &metadata).unwrap();
        let header = MessageHeader { channel_id: id, sequence: 0, log_time: 1, publish_time: 1 };
        writer.write_to_known_channel(&header, b"{}").unwrap();
        writer.finish().unwrap();
        writer.into_inner().into_inner()
    };
    let bytes = of_another("/tf", &[]);
    let mut reader = Reader::open(&bytes[..]).unwrap();
    assert!(reader.next_item().unwrap().is_none());
    assert_eq!((reader.other_messages(), reader.condition().is_closed), (1, true));

    let later = [("isochrone.service", "a"), ("isochrone.format", "2")];
    assert!(refused(&of_another("/a", &later)).contains("of format \"2\", this program reads 1"));
    let malformed =
        [("isochrone.service", "a"), ("isochrone.format", "1"), ("isochrone.signals", "[{}]")];
    let (items, condition) = read(&of_another("/a", &malformed)).unwrap();
    assert_eq!((items.len(), condition.damaged), (0, 2), "{condition:?}");
}

/// A file with one record as given.
fn with_record(opcode: u8, length: u64, body: &[u8]) -> Vec<u8> {
    let mut bytes = mcap::MAGIC.to_vec();
    bytes.push(opcode);
    bytes.extend_from_slice(&length.to_le_bytes());
    bytes.extend_from_slice(body);
    bytes
}

fn chunk(compression: &str, size: u64, data: &[u8]) -> Vec<u8> {
    let mut body = vec![0; 16];
    body.extend_from_slice(&size.to_le_bytes());
    body.extend_from_slice(&0_u32.to_le_bytes());
    body.extend_from_slice(&(compression.len() as u32).to_le_bytes());
    body.extend_from_slice(compression.as_bytes());
    body.extend_from_slice(&(data.len() as u64).to_le_bytes());
    body.extend_from_slice(data);
    with_record(0x06, body.len() as u64, &body)
}

#[test]
fn a_hostile_file_is_damaged_and_neither_fills_the_memory_nor_ends_the_program() {
    let mut bomb = zstd::bulk::compress(&vec![0; 2 * MAX_RECORD_BYTES], 1).unwrap();
    assert!(bomb.len() < 100_000);
    let attachment = [&[0; 16][..], &u32::MAX.to_le_bytes(), &[0; 3]].concat();
    for (file, says) in [
        (with_record(0x05, u64::MAX, b""), "a record of 18446744073709551615 bytes"),
        (chunk("zstd", 2 * MAX_RECORD_BYTES as u64, &bomb), "a chunk of"),
        (chunk("zstd", 1_000, &bomb), "cannot be decompressed"),
        (chunk("", 5, b"12345"), "ends within a record"),
        (chunk("", 9, &[5, 255, 255, 255, 255, 255, 255, 255, 255]), "ends within a record"),
        (
            with_record(0x09, attachment.len() as u64, &attachment),
            "a record that cannot be as long as it says",
        ),
        (with_record(0x04, 2, b"ab"), "malformed"),
        (with_record(0x06, 2048, &[255; 2048]), "a chunk without its header"),
        (with_record(0x05, 22, &[7; 22]), "contradicts"),
    ] {
        let (items, condition) = read(&file).unwrap();
        assert!(items.is_empty());
        let damage = condition.first_damage.unwrap();
        assert!(damage.what.contains(says) && damage.at == 8, "{damage:?} for {says}");
        repair(Cursor::new(&file), Vec::new()).unwrap();
    }
    // A length that the file does not have is no reason to set that much memory aside.
    let (_, condition) = read(&with_record(0x05, MAX_RECORD_BYTES as u64, b"abc")).unwrap();
    assert_eq!(condition, FileCondition { unread_bytes: 12, ..FileCondition::default() });
    // What stands in a chunk before its damage was read.
    let known = with_record(0x80, 3, b"abc").split_off(mcap::MAGIC.len());
    for (rest, says) in
        [(&[0x06, 0, 0, 0, 0, 0, 0, 0, 0][..], "that no chunk has"), (b"12345", "ends within")]
    {
        let data = [&known, rest].concat();
        let (_, condition) = read(&chunk("", data.len() as u64, &data)).unwrap();
        assert!(condition.first_damage.unwrap().what.contains(says));
        assert_eq!(condition.unread_bytes, rest.len() as u64, "{says}");
    }
    bomb.clear();
    let refused = read(&chunk("lz4", 5, b"12345")).unwrap_err().to_string();
    assert!(refused.contains("mcap compress"), "{refused}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// Like a fuzzer: bytes are changed, taken away, doubled and put in.
    #[test]
    fn whatever_happens_to_a_file_reading_and_repairing_end_in_order(
        changes in prop::collection::vec((any::<prop::sample::Index>(), 0..4, any::<u8>(), 1..40_usize), 1..8)
    ) {
        thread_local!(static FILE: Vec<u8> = written(25).finish().map_err(|(error, _)| error).unwrap());
        let mut bytes = FILE.with(Clone::clone);
        for (place, kind, byte, length) in changes {
            let at = place.index(bytes.len());
            let end = (at + length).min(bytes.len());
            match kind {
                0 => bytes[at] = byte,
                1 => { bytes.drain(at..end); }
                2 => { let again = bytes[at..end].to_vec(); bytes.splice(at..at, again); }
                _ => { bytes.splice(at..at, vec![byte; length]); }
            }
        }
        let all = expected(25);
        if let Ok((items, _)) = read(&bytes) {
            for item in &items {
                prop_assert!(all.contains(item), "a frame that was never written: {}", item);
            }
        }
        if let Ok((_, repaired)) = repair(Cursor::new(&bytes), Vec::new()) {
            let (again, condition) = read(&repaired).unwrap();
            prop_assert!(condition.is_closed && again.len() <= 50, "{:?}", condition);
        }
    }

    #[test]
    fn any_values_of_any_signals_read_back(
        names in prop::collection::vec("[a-cA-C._0-9]{0,8}", 0..12),
        bits in prop::collection::vec(any::<u64>(), 12),
    ) {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let values: Vec<f64> = bits[..names.len()].iter().map(|bits| f64::from_bits(*bits)).collect();
        let mut writer = Writer::create(Vec::new(), CLOCK).unwrap();
        let carried = carried("x", &names);
        let channel = writer.add(&carried).unwrap();
        writer.write(channel, &frame(1, &values)).unwrap();
        let bytes = writer.finish().map_err(|(error, _)| error).unwrap();
        let mut reader = Reader::open(&bytes[..]).unwrap();
        let Some(Item::Frame(read)) = reader.next_item().unwrap() else { panic!("a frame") };
        prop_assert_eq!(read.carried, &carried);
        let read: Vec<u64> = read.values.iter().map(|value| value.to_bits()).collect();
        prop_assert_eq!(&read[..], &bits[..names.len()]);
    }
}
