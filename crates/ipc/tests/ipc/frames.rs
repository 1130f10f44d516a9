//! What a frame is when it arrives.

use std::collections::{BTreeSet, VecDeque};

use crate::variants::{NOW_NS, joined, layout, open_reader, open_writer, send};
use isochrone_ipc::{
    Depth, Flags, FrameHeader, FramePublisher, FrameSubscriber, Service, Stamp, raw_subscriber,
};

for_both_variants! {
    a_frame_arrives_bit_for_bit
    the_header_tells_all_that_was_stamped
    the_sequence_has_no_gap
    the_newest_of_many_frames_wins
    a_frame_that_a_reader_watched_for_is_kept_until_it_reads
    frames_that_a_reader_does_not_watch_for_are_left_for_it_to_read
    a_reader_of_all_frames_gets_them_in_order
    a_frame_that_was_looked_at_is_the_next_one
    a_late_reader_gets_the_next_frame_and_no_old_one
    a_restarted_publisher_is_picked_up_by_the_same_reader
    nothing_is_sent_that_was_not_prepared
    a_prepared_frame_starts_at_zero
    preparing_twice_keeps_what_was_written
    a_frame_can_be_read_while_the_next_ones_overrun_the_buffer
    a_publisher_always_has_a_frame_to_write_whatever_its_readers_hold
    a_publisher_that_asks_for_them_has_places_for_64_readers
    peers_that_join_and_leave_are_counted
}

fn a_frame_arrives_bit_for_bit<S: Service>() {
    let (_domain, node) = joined::<S>();
    let bits = [
        f64::NAN.to_bits(),
        0x7ff0_0000_dead_beef,
        (-0.0_f64).to_bits(),
        f64::MIN_POSITIVE.to_bits() >> 3,
        f64::NEG_INFINITY.to_bits(),
    ];
    let shape = layout(&["a:LREAL", "b:LREAL", "c:LREAL", "d:LREAL", "e:LREAL"]);
    let mut reader = FrameSubscriber::open(&node, "x", shape.signals.len(), Depth::Newest).unwrap();
    let mut writer = FramePublisher::open(&node, "x", &shape).unwrap();
    assert!(writer.prepare());
    for (value, bits) in writer.values_mut().unwrap().iter_mut().zip(bits) {
        *value = f64::from_bits(bits);
    }
    assert!(writer.send(Stamp::default(), || 1));
    let frame = reader.newest(NOW_NS).unwrap();
    let received: Vec<u64> = frame.values().iter().map(|v| v.to_bits()).collect();
    assert_eq!(received, bits);
}

fn the_header_tells_all_that_was_stamped<S: Service>() {
    let (_domain, node) = joined::<S>();
    let shape = layout(&["a:LREAL"]);
    let mut reader = open_reader(&node, Depth::Newest);
    let mut writer = open_writer(&node);
    writer.prepare();
    let flags = Flags::STALE | Flags::FORCED;
    let stamp = Stamp { cycle: 11, release_ns: 22, source_ns: 44, missed: 55, flags };
    writer.send(stamp, || 33);
    let header = *reader.newest(NOW_NS).unwrap().header();
    assert!(header.term > 1_600_000_000_000_000_000, "Unix ns: {}", header.term);
    assert_eq!(
        header,
        FrameHeader {
            sequence: 0,
            cycle: 11,
            release_ns: 22,
            publish_ns: 33,
            source_ns: 44,
            missed: 55,
            flags: flags.bits(),
            term: header.term,
            layout: shape.number(),
        }
    );
}

fn the_sequence_has_no_gap<S: Service>() {
    let (_domain, node) = joined::<S>();
    let mut reader = open_reader(&node, Depth::Newest);
    let mut writer = open_writer(&node);
    for cycle in 0..20_000_u64 {
        send(&mut writer, cycle as f64, cycle);
        let frame = reader.newest(NOW_NS).unwrap();
        assert_eq!(frame.header().sequence, cycle);
        assert_eq!(frame.values(), [cycle as f64]);
    }
    assert_eq!(writer.counters().sent, 20_000);
    assert_eq!(writer.counters().silent, 0);
    assert_eq!(reader.counters().received, 20_000);
}

fn the_newest_of_many_frames_wins<S: Service>() {
    let (_domain, node) = joined::<S>();
    let mut writer = open_writer(&node);
    for depth in [Depth::Newest, Depth::All] {
        let mut reader = open_reader(&node, depth);
        for n in 0..1000_u32 {
            send(&mut writer, f64::from(n), n.into());
        }
        assert_eq!(reader.newest(NOW_NS).unwrap().values(), [999.0]);
        assert!(reader.newest(NOW_NS).is_none(), "all were taken");
    }
}

fn frames_that_a_reader_does_not_watch_for_are_left_for_it_to_read<S: Service>() {
    let (_domain, node) = joined::<S>();
    let mut writer = open_writer(&node);
    let mut reader = open_reader(&node, Depth::Newest);
    for n in 0..1000_u64 {
        send(&mut writer, 1.0, 3 * n);
        assert!(!reader.has_newer(NOW_NS, |header| header.publish_ns > 3 * n), "it is too old");
        if n % 2 == 0 {
            assert_eq!(reader.newest(NOW_NS).unwrap().values(), [1.0]);
        }
        send(&mut writer, 2.0, 3 * n + 1);
        send(&mut writer, 3.0, 3 * n + 2);
        assert!(reader.has_newer(NOW_NS, |header| header.publish_ns > 3 * n));
        assert_eq!(reader.newest(NOW_NS).unwrap().values(), [3.0]);
        assert!(reader.newest(NOW_NS).is_none());
    }
    assert_eq!(reader.counters().lost, 0);
}

fn a_frame_that_a_reader_watched_for_is_kept_until_it_reads<S: Service>() {
    let (_domain, node) = joined::<S>();
    let mut writer = open_writer(&node);
    let mut reader = open_reader(&node, Depth::Newest);
    for n in 0..1000_u64 {
        assert!(!reader.has_newer(NOW_NS, |_| true), "nothing was sent since");
        send(&mut writer, 0.0, 10 * n);
        assert!(reader.has_newer(NOW_NS, |_| true) && reader.has_newer(NOW_NS, |_| true));
        // Those that come after it are newer, however many the buffer holds.
        let more = n % 5;
        (1..=more).for_each(|k| send(&mut writer, k as f64, 10 * n + k));
        if n % 2 == 0 {
            assert_eq!(reader.newest(NOW_NS).unwrap().values(), [more as f64]);
        } else {
            assert_eq!(reader.next(NOW_NS).unwrap().values(), [0.0]);
            assert_eq!(reader.newest(NOW_NS).is_some(), more > 0);
        }
    }
    let counters = reader.counters();
    assert_eq!(counters.received + counters.lost, writer.counters().sent);
    assert_eq!((counters.restarts, counters.receive_errors), (0, 0));
}

fn a_reader_of_all_frames_gets_them_in_order<S: Service>() {
    let (_domain, node) = joined::<S>();
    let mut writer = open_writer(&node);
    let mut reader = open_reader(&node, Depth::All);
    for n in 0..256_u32 {
        send(&mut writer, f64::from(n), n.into());
    }
    for n in 0..256_u32 {
        assert_eq!(reader.next(NOW_NS).unwrap().header().sequence, u64::from(n));
    }
    assert!(reader.next(NOW_NS).is_none());
    assert_eq!(reader.counters().receive_errors, 0);
}

fn a_frame_that_was_looked_at_is_the_next_one<S: Service>() {
    let (_domain, node) = joined::<S>();
    let mut reader = FrameSubscriber::open(&node, "x", 1, Depth::All).unwrap();
    let mut writer = FramePublisher::open(&node, "x", &layout(&["a:LREAL"])).unwrap();
    assert!(reader.peek_next(NOW_NS).is_none());
    (0..3).for_each(|n| send(&mut writer, 1.0, n));
    assert_eq!(reader.peek_next(NOW_NS).map(|header| header.publish_ns), Some(0));
    assert_eq!(reader.peek_next(NOW_NS).map(|header| header.publish_ns), Some(0));
    for n in 0..3 {
        assert_eq!(reader.next(NOW_NS).map(|frame| frame.header().publish_ns), Some(n));
    }
    assert!(reader.next(NOW_NS).is_none());
    assert_eq!(reader.counters().received, 3);
}

fn a_late_reader_gets_the_next_frame_and_no_old_one<S: Service>() {
    let (_domain, node) = joined::<S>();
    let mut writer = open_writer(&node);
    send(&mut writer, 1.0, 1);
    let mut reader = open_reader(&node, Depth::All);
    writer.prepare();
    assert!(reader.newest(NOW_NS).is_none());
    send(&mut writer, 2.0, 2);
    assert_eq!(reader.newest(NOW_NS).unwrap().values(), [2.0]);
}

fn a_restarted_publisher_is_picked_up_by_the_same_reader<S: Service>() {
    let (_domain, node) = joined::<S>();
    let mut reader = open_reader(&node, Depth::Newest);
    let mut publish_ns = 0;
    for life in 0..20 {
        let mut writer = open_writer(&node);
        reader.maintain();
        for n in 0..5 {
            publish_ns += 1;
            send(&mut writer, f64::from(life * 100 + n), publish_ns);
        }
        // Every other one ends before it is read, and leaves its frames.
        if life % 2 == 0 {
            let frame = reader.newest(NOW_NS).unwrap();
            assert_eq!(frame.values(), [f64::from(life * 100 + 4)]);
            assert_eq!(frame.header().sequence, 4);
        }
    }
    assert_eq!(reader.newest(NOW_NS).unwrap().values(), [1904.0]);
    assert!(reader.newest(NOW_NS).is_none());
    assert_eq!(reader.counters().receive_errors, 0);
}

fn nothing_is_sent_that_was_not_prepared<S: Service>() {
    let (_domain, node) = joined::<S>();
    let mut reader = open_reader(&node, Depth::All);
    let mut writer = open_writer(&node);
    assert!(writer.send(Stamp::default(), || 1), "opening prepared a frame");
    assert!(writer.values_mut().is_none());
    assert!(!writer.send(Stamp::default(), || 2));
    assert_eq!(writer.counters().unsent, 1);
    assert_eq!(writer.counters().sent, 1);
    send(&mut writer, 0.0, 3);
    assert_eq!(reader.next(NOW_NS).unwrap().header().sequence, 0);
    let sequence = reader.next(NOW_NS).unwrap().header().sequence;
    assert_eq!(sequence, 2, "the reader sees that one is missing");
    assert!(reader.next(NOW_NS).is_none());
}

fn a_prepared_frame_starts_at_zero<S: Service>() {
    let (_domain, node) = joined::<S>();
    let mut writer = open_writer(&node);
    // More often than there are chunks, so that used ones come back.
    for n in 0..10_000 {
        writer.prepare();
        assert_eq!(writer.values_mut().unwrap(), [0.0], "frame {n}");
        writer.values_mut().unwrap()[0] = 9.0;
        writer.send(Stamp::default(), || n);
    }
}

fn preparing_twice_keeps_what_was_written<S: Service>() {
    let (_domain, node) = joined::<S>();
    let mut writer = open_writer(&node);
    assert!(writer.prepare());
    writer.values_mut().unwrap()[0] = 5.0;
    assert!(writer.prepare());
    assert_eq!(writer.values_mut().unwrap(), [5.0]);
}

fn a_frame_can_be_read_while_the_next_ones_overrun_the_buffer<S: Service>() {
    let (_domain, node) = joined::<S>();
    let mut reader = open_reader(&node, Depth::Newest);
    let mut writer = open_writer(&node);
    send(&mut writer, 1.0, 1);
    let held = reader.newest(NOW_NS).unwrap();
    for n in 2..10_000 {
        send(&mut writer, 2.0, n);
    }
    assert_eq!(held.values(), [1.0]);
    assert_eq!(held.header().sequence, 0);
    assert_eq!(writer.counters().loan_errors, 0);
}

fn a_publisher_always_has_a_frame_to_write_whatever_its_readers_hold<S: Service>() {
    const PLACES: usize = 16;
    let (_domain, node) = joined::<S>();
    // With so little room behind it the readers hold most of what there is.
    let mut writer = FramePublisher::open_with_room(&node, "x", &layout(&["a:LREAL"]), 3).unwrap();
    let join = || (raw_subscriber(&node, "x", 1).unwrap(), VecDeque::new());
    let mut readers: Vec<_> = (0..PLACES).map(|_| join()).collect();
    let mut random = 0x9e37_79b9_7f4a_7c15_u64;
    let mut most_held = 0;
    for cycle in 0..20_000_u64 {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        let (port, held) = &mut readers[random as usize % PLACES];
        match random >> 32 & 63 {
            0 => {
                held.clear();
                readers.swap_remove(random as usize % PLACES);
                readers.push(join());
            }
            1..8 => _ = held.pop_front(),
            _ => {
                held.truncate(1);
                held.extend(port.receive().unwrap());
            }
        }
        let all: BTreeSet<u64> = readers
            .iter()
            .flat_map(|(_, held)| held.iter().map(|frame| frame.user_header().sequence))
            .collect();
        most_held = most_held.max(all.len());
        assert!(writer.prepare(), "cycle {cycle}: {} frames are held", all.len());
        assert!(writer.send(Stamp::default(), || cycle));
    }
    assert!(most_held > PLACES, "each may hold two: {most_held}");
    assert_eq!(writer.counters().loan_errors, 0);
}

fn a_publisher_that_asks_for_them_has_places_for_64_readers<S: Service>() {
    let (_domain, node) = joined::<S>();
    let shape = layout(&["a:LREAL"]);
    let mut writer = FramePublisher::open_for_readers(&node, "x", &shape, 64).unwrap();
    let mut readers: Vec<_> = (0..64).map(|_| open_reader(&node, Depth::Newest)).collect();
    let refused = FrameSubscriber::open(&node, "x", 1, Depth::Newest).unwrap_err().to_string();
    assert!(refused.contains("its creator provided 64"), "{refused}");
    for n in 1..1000 {
        send(&mut writer, 1.0, n);
        let held: Vec<_> = readers.iter_mut().map(|reader| reader.newest(NOW_NS)).collect();
        assert!(held.iter().all(Option::is_some), "{n}");
    }
    assert_eq!(writer.counters().loan_errors, 0);
}

fn peers_that_join_and_leave_are_counted<S: Service>() {
    let (_domain, node) = joined::<S>();
    let mut writer = open_writer(&node);
    assert_eq!(writer.counters().connects, 0);
    let mut reader = open_reader(&node, Depth::All);
    assert_eq!(reader.counters().connects, 1);
    assert_eq!(writer.subscribers(), 1);
    writer.prepare();
    assert_eq!(writer.counters().connects, 1);
    drop(writer);
    reader.maintain();
    assert_eq!(reader.counters().connects, 2);
    assert_eq!(reader.publishers(), 0);
    assert_eq!(reader.counters().connect_errors, 0);
}
