//! Whose frames a reader takes when several write a service.

use crate::variants::{NOW_NS, layout, send};
use iceoryx2::port::publisher::Publisher;
use isochrone_ipc::{Depth, FrameHeader, FramePublisher, FrameSubscriber, OpenError, Service};
use isochrone_testing::Domain;

const MS: u64 = 1_000_000;
const SECOND: u64 = 1_000 * MS;

for_both_variants! {
    a_second_writer_is_counted_and_neither_read_nor_taken_for_a_loss
    a_frame_of_a_second_writer_is_not_what_a_reader_watches_for
    a_writer_that_has_left_is_replaced_at_once_and_that_is_no_second_writer
    a_writer_that_is_silent_is_replaced_after_a_second
    a_reader_of_all_frames_follows_one_writer_too
    publishers_of_ours_have_rising_terms
    a_service_is_taken_from_a_plain_writer_only_by_a_participant_that_is_told_to
}

/// A writer that knows nothing of this crate but the types.
struct Plain<S: Service> {
    port: Publisher<S, [f64], FrameHeader>,
    header: FrameHeader,
}

impl<S: Service> Plain<S> {
    fn open(domain: &Domain) -> Self {
        Self { port: domain.plain_writer("x"), header: FrameHeader::default() }
    }

    fn send(&mut self, value: f64) {
        let mut frame = self.port.loan_slice(1).unwrap();
        frame.payload_mut()[0] = value;
        *frame.user_header_mut() = self.header;
        self.header.sequence = self.header.sequence.wrapping_add(1);
        frame.send().unwrap();
    }
}

fn reader<S: Service>(domain: &Domain, depth: Depth) -> FrameSubscriber<S> {
    FrameSubscriber::open(&domain.join_variant::<S>("tester"), "x", 1, depth).unwrap()
}

/// The newest value, at a time.
fn newest<S: Service>(reader: &mut FrameSubscriber<S>, now_ns: u64) -> Option<f64> {
    let value = reader.newest(now_ns).map(|frame| frame.values()[0]);
    reader.maintain();
    value
}

fn a_second_writer_is_counted_and_neither_read_nor_taken_for_a_loss<S: Service>() {
    let domain = Domain::new();
    let mut reader = reader::<S>(&domain, Depth::Newest);
    let (mut first, mut second) = (Plain::<S>::open(&domain), Plain::<S>::open(&domain));
    second.header.sequence = 5_000;
    for cycle in 0..200 {
        first.send(1.0);
        second.send(2.0);
        second.header.sequence += 77;
        assert_eq!(newest(&mut reader, cycle * MS), Some(1.0));
    }
    let counters = reader.counters();
    assert_eq!((counters.received, counters.lost, counters.restarts), (200, 0, 0));
    assert_eq!(counters.other_writers, 200);
    assert_eq!(counters.receive_errors, 0);
}

fn a_frame_of_a_second_writer_is_not_what_a_reader_watches_for<S: Service>() {
    let domain = Domain::new();
    let mut reader = reader::<S>(&domain, Depth::Newest);
    let (mut first, mut second) = (Plain::<S>::open(&domain), Plain::<S>::open(&domain));
    first.send(1.0);
    assert!(reader.has_newer(0, |_| true));
    assert_eq!(newest(&mut reader, 0), Some(1.0));
    for cycle in 1..20 {
        second.send(2.0);
        assert!(!reader.has_newer(cycle * MS, |_| true));
        first.send(1.0);
        assert!(reader.has_newer(cycle * MS, |_| true));
        assert_eq!(newest(&mut reader, cycle * MS), Some(1.0));
    }
    assert_eq!(reader.counters().other_writers, 19);
}

fn a_writer_that_has_left_is_replaced_at_once_and_that_is_no_second_writer<S: Service>() {
    let domain = Domain::new();
    let mut reader = reader::<S>(&domain, Depth::Newest);
    let mut first = Plain::<S>::open(&domain);
    first.send(1.0);
    assert_eq!(newest(&mut reader, 0), Some(1.0));
    drop(first);
    let mut second = Plain::<S>::open(&domain);
    second.send(2.0);
    // The first cycle finds out who is there, the next one reads.
    assert_eq!(newest(&mut reader, MS), None);
    second.send(3.0);
    assert_eq!(newest(&mut reader, 2 * MS), Some(3.0));
    let counters = reader.counters();
    assert_eq!((counters.restarts, counters.lost, counters.other_writers), (1, 0, 0));
}

fn a_writer_that_is_silent_is_replaced_after_a_second<S: Service>() {
    let domain = Domain::new();
    let mut reader = reader::<S>(&domain, Depth::Newest);
    let (mut first, mut second) = (Plain::<S>::open(&domain), Plain::<S>::open(&domain));
    first.send(1.0);
    assert_eq!(newest(&mut reader, NOW_NS), Some(1.0));
    for cycle in 1..1_000 {
        second.send(2.0);
        assert_eq!(newest(&mut reader, NOW_NS + cycle * MS), None);
    }
    second.send(2.0);
    assert_eq!(newest(&mut reader, NOW_NS + SECOND), Some(2.0));
    first.send(1.0);
    assert_eq!(newest(&mut reader, NOW_NS + SECOND + MS), None, "now the first is the other");
    assert_eq!(reader.counters().restarts, 1);
}

/// All values that wait.
fn all<S: Service>(reader: &mut FrameSubscriber<S>) -> Vec<f64> {
    let mut values = Vec::new();
    while let Some(frame) = reader.next(NOW_NS) {
        values.push(frame.values()[0]);
    }
    values
}

fn a_reader_of_all_frames_follows_one_writer_too<S: Service>() {
    let domain = Domain::new();
    let mut reader = reader::<S>(&domain, Depth::All);
    let (mut first, mut second) = (Plain::<S>::open(&domain), Plain::<S>::open(&domain));
    for _ in 0..3 {
        first.send(1.0);
        second.send(2.0);
    }
    assert_eq!(all(&mut reader), [1.0; 3]);
    // What the first has left comes before its successor, and that loses nothing.
    first.send(1.5);
    drop(first);
    second.send(2.5);
    second.send(2.5);
    reader.maintain();
    assert_eq!(all(&mut reader), [1.5, 2.5, 2.5]);
    // One that nobody knew before needs no such look.
    drop(second);
    let mut third = Plain::<S>::open(&domain);
    third.send(3.0);
    third.send(3.0);
    assert_eq!(all(&mut reader), [3.0; 2]);
    let counters = reader.counters();
    assert_eq!((counters.received, counters.lost, counters.restarts), (8, 0, 2));
    assert_eq!(counters.other_writers, 3);
}

fn publishers_of_ours_have_rising_terms<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let mut reader = reader::<S>(&domain, Depth::Newest);
    let mut last = 0;
    for life in 0..10 {
        let mut writer = FramePublisher::open(&node, "x", &layout(&["a:LREAL"])).unwrap();
        send(&mut writer, life.into(), 1);
        let frame = reader.newest(NOW_NS).unwrap();
        assert_eq!(frame.values(), [f64::from(life)]);
        assert!(frame.header().term > last);
        last = frame.header().term;
    }
    assert_eq!((reader.counters().restarts, reader.counters().other_writers), (9, 0));
}

fn a_service_is_taken_from_a_plain_writer_only_by_a_participant_that_is_told_to<S: Service>() {
    let domain = Domain::new();
    let _reader = reader::<S>(&domain, Depth::Newest);
    let plain = Plain::<S>::open(&domain);
    let node = domain.join_variant::<S>("tester");
    let shape = layout(&["a:LREAL"]);
    let refused = FramePublisher::open(&node, "x", &shape).map(drop).unwrap_err();
    assert!(matches!(refused, OpenError::PlainWriter { .. }), "{refused}");
    let own = format!("pid {}", std::process::id());
    for part in ["\"x\" is written by", &own, "--take-over"] {
        assert!(refused.to_string().contains(part), "{part}: {refused}");
    }
    let node = node.taking_over(true);
    let first = FramePublisher::open(&node, "x", &shape).unwrap();
    let second = FramePublisher::open(&node, "x", &shape).map(drop).unwrap_err();
    assert!(matches!(second, OpenError::SecondPublisher { .. }), "{second}");
    drop((first, plain));
    FramePublisher::open(&node.taking_over(false), "x", &shape).unwrap();
}
