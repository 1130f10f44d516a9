//! Reading signals by their names, whatever happens to their publisher.

use std::process::{Child, Stdio};
use std::thread;
use std::time::Duration;

use isochrone_ipc::{
    Announcement, Flags, FrameHeader, FramePublisher, LayoutAnnouncer, Participant, Service,
    SignalError, SignalFrame, SignalReader, Stamp, ipc,
};
use isochrone_testing::{Domain, PATIENCE, role, role_domain, wait_until};

use crate::variants::{layout, remove_leftovers};

for_both_variants! {
    the_values_of_a_frame_come_by_the_wanted_names_in_their_order
    without_names_all_signals_come
    what_was_stamped_comes_with_the_values
    a_writer_may_come_after_its_reader
    a_layout_that_changes_is_followed
    a_signal_that_is_missing_is_told_by_each_frame_until_it_comes_back
    frames_wait_for_a_layout_that_is_announced_after_them
    frames_whose_layout_nobody_announces_come_without_names_in_the_end
    the_frames_of_a_plain_writer_have_no_names
    a_frame_that_is_shorter_than_its_layout_lacks_its_last_signals
    frames_that_were_received_can_be_given_without_taking_new_ones
    each_frame_says_how_many_were_lost_before_it
    two_readers_get_every_frame_and_one_goes_on_without_the_other
    a_service_that_does_not_exist_is_not_created_by_looking_for_it
}

/// A publisher and its announcements.
struct Writer<'p, S: Service> {
    participant: &'p Participant<S>,
    publisher: FramePublisher<S>,
    announcer: LayoutAnnouncer<S>,
}

impl<'p, S: Service> Writer<'p, S> {
    fn open(participant: &'p Participant<S>, signals: &[&str]) -> Self {
        let layout = layout(signals);
        let publisher = FramePublisher::open(participant, "x", &layout).unwrap();
        let announcer = LayoutAnnouncer::open(participant, "x", "writer", &layout).unwrap();
        Self { participant, publisher, announcer }
    }

    fn send(&mut self, values: &[f64]) {
        self.announcer.tend(self.participant);
        send(&mut self.publisher, values);
    }
}

fn send<S: Service>(publisher: &mut FramePublisher<S>, values: &[f64]) {
    assert!(publisher.prepare());
    publisher.values_mut().unwrap().copy_from_slice(values);
    assert!(publisher.send(Stamp::default(), || 1));
}

/// A reader whose frames wait for their names however busy the machine is.
fn reader<'p, S: Service>(node: &'p Participant<S>, names: &[&str]) -> SignalReader<'p, S> {
    SignalReader::open(node, "x", names).unwrap().with_patience(PATIENCE)
}

fn values<S: Service>(frame: &SignalFrame<'_, S>) -> Vec<(String, f64)> {
    frame.values().unwrap().map(|(name, value)| (name.to_owned(), value)).collect()
}

fn named(values: &[(&str, f64)]) -> Vec<(String, f64)> {
    values.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect()
}

fn the_values_of_a_frame_come_by_the_wanted_names_in_their_order<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let mut reader = reader(&node, &["c", "a"]);
    let mut writer = Writer::open(&node, &["a:LREAL", "b:LREAL", "c:LREAL"]);
    for n in 0..100_u32 {
        let n = f64::from(n);
        writer.send(&[n, -1.0, n + 0.5]);
        let frame = reader.wait(PATIENCE).unwrap();
        assert_eq!(values(&frame), named(&[("c", n + 0.5), ("a", n)]));
        assert_eq!(frame.value("a"), Ok(n));
        assert_eq!(frame.value("b"), Ok(-1.0), "of a signal that was not asked for");
        assert_eq!(frame.channels(), [n, -1.0, n + 0.5]);
    }
    assert!(reader.next_frame().is_none());
}

fn without_names_all_signals_come<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let mut reader = reader(&node, &[]);
    let mut writer = Writer::open(&node, &["b:LREAL", "a:INT"]);
    writer.send(&[1.5, 2.0]);
    let frame = reader.wait(PATIENCE).unwrap();
    assert_eq!(values(&frame), named(&[("b", 1.5), ("a", 2.0)]));
    let announced = Announcement::new("writer", &layout(&["b:LREAL", "a:INT"]));
    assert_eq!(frame.announced(), Some(&announced));
}

fn what_was_stamped_comes_with_the_values<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let mut reader = reader(&node, &["a"]);
    let mut writer = Writer::open(&node, &["a:LREAL"]);
    let flags = Flags::STALE | Flags::FORCED;
    let stamp = Stamp { cycle: 7, release_ns: 5, source_ns: 3, missed: 2, flags };
    writer.publisher.prepare();
    writer.publisher.send(stamp, || 9);
    let frame = reader.wait(PATIENCE).unwrap();
    assert_eq!((frame.flags(), frame.sequence(), frame.lost()), (flags, 0, 0));
    let FrameHeader { cycle, release_ns, publish_ns, source_ns, missed, .. } = *frame.header();
    assert_eq!((cycle, release_ns, publish_ns, source_ns, missed), (7, 5, 9, 3, 2));
    let receipt = frame.receipt();
    assert_eq!(frame.age_ns(), Some(receipt.received_ns - 9));
    assert_eq!(receipt.due_ns(), 5);
}

fn a_writer_may_come_after_its_reader<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let mut reader = reader(&node, &["a"]);
    assert!(reader.wait(Duration::from_millis(20)).is_none());
    let mut writer = Writer::open(&node, &["a:LREAL"]);
    writer.send(&[1.0]);
    let frame = reader.wait(PATIENCE).unwrap();
    assert_eq!((frame.sequence(), values(&frame)), (0, named(&[("a", 1.0)])));
    assert!(reader.wait(Duration::ZERO).is_none());
}

fn a_layout_that_changes_is_followed<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let mut reader = reader(&node, &["b"]);
    for (signals, place) in [
        (["a:LREAL", "b:LREAL"].as_slice(), 1.0),
        (&["b:LREAL", "a:LREAL", "c:INT"], 0.0),
        (&["b:LREAL"], 0.0),
        (&["c:INT", "a:LREAL", "b:LREAL"], 2.0),
        (&["a:LREAL", "b:LREAL"], 1.0),
    ] {
        let mut writer = Writer::open(&node, signals);
        let sent: Vec<f64> = (0..signals.len()).map(|place| place as f64).collect();
        for sequence in 0..3 {
            writer.send(&sent);
            let frame = reader.wait(PATIENCE).unwrap();
            assert_eq!((frame.sequence(), frame.value("b")), (sequence, Ok(place)), "{signals:?}");
            assert_eq!(values(&frame), named(&[("b", place)]), "{signals:?}");
        }
    }
}

fn a_signal_that_is_missing_is_told_by_each_frame_until_it_comes_back<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let mut reader = reader(&node, &["a", "b"]);
    for signals in [["a:LREAL", "c:LREAL"], ["a:LREAL", "b:LREAL"], ["c:LREAL", "a:LREAL"]] {
        let mut writer = Writer::open(&node, &signals);
        for sequence in 0..3 {
            writer.send(&[1.0, 2.0]);
            let frame = reader.wait(PATIENCE).unwrap();
            assert_eq!(frame.sequence(), sequence, "the frame came all the same");
            if signals[1] == "b:LREAL" {
                assert_eq!(values(&frame), named(&[("a", 1.0), ("b", 2.0)]));
                continue;
            }
            let available = layout(&signals).signals.into_iter().map(|signal| signal.name);
            let available = available.collect::<Vec<_>>().join(", ");
            let [service, publisher, name] = ["x", "writer", "b"].map(str::to_owned);
            let error = SignalError::Missing { service, publisher, name, available };
            assert_eq!(frame.values().map(drop), Err(error.clone()));
            assert_eq!(frame.value("b"), Err(error));
            assert!(frame.value("a").is_ok(), "those that are there can be read");
        }
    }
}

fn frames_wait_for_a_layout_that_is_announced_after_them<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let mut reader = reader(&node, &["a"]);
    let shape = layout(&["a:LREAL"]);
    let mut publisher = FramePublisher::open(&node, "x", &shape).unwrap();
    for n in 0..3 {
        send(&mut publisher, &[f64::from(n)]);
        assert!(reader.next_frame().is_none());
        assert!(reader.is_waiting());
    }
    let _announcer = LayoutAnnouncer::open(&node, "x", "writer", &shape).unwrap();
    for n in 0..3 {
        let frame = reader.wait(PATIENCE).unwrap();
        assert_eq!((frame.sequence(), frame.lost()), (u64::from(n as u8), 0));
        assert_eq!(values(&frame), named(&[("a", f64::from(n))]));
    }
    assert!(!reader.is_waiting());
}

fn frames_whose_layout_nobody_announces_come_without_names_in_the_end<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let mut publisher = FramePublisher::open(&node, "x", &layout(&["a:LREAL"])).unwrap();
    for patience in [Duration::ZERO, Duration::from_millis(20)] {
        let mut reader = SignalReader::open(&node, "x", &["a"]).unwrap().with_patience(patience);
        publisher.prepare();
        for n in 0..3 {
            send(&mut publisher, &[f64::from(n)]);
        }
        for n in 0..3 {
            let frame = reader.wait(PATIENCE).unwrap();
            let error = SignalError::Unnamed { service: "x".to_owned(), channels: 1 };
            assert_eq!(frame.values().map(drop), Err(error.clone()));
            assert_eq!(frame.value("a"), Err(error));
            assert_eq!(frame.channels(), [f64::from(n)]);
            assert!(!frame.layout().is_announced);
        }
    }
}

fn the_frames_of_a_plain_writer_have_no_names<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let mut reader = reader(&node, &[]);
    let writer = domain.plain_writer::<S>("x");
    let mut sample = writer.loan_slice(1).unwrap();
    sample.payload_mut()[0] = 4.0;
    sample.send().unwrap();
    let frame = reader.wait(PATIENCE).unwrap();
    assert_eq!(frame.channels(), [4.0]);
    let error = frame.values().map(drop).unwrap_err();
    assert_eq!(error, SignalError::Unnamed { service: "x".to_owned(), channels: 1 });
    assert_eq!((frame.flags(), frame.announced(), frame.obstacle()), (Flags::NONE, None, None));
}

fn a_frame_that_is_shorter_than_its_layout_lacks_its_last_signals<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let mut reader = reader(&node, &["b"]);
    let shape = layout(&["a:LREAL", "b:LREAL"]);
    let _announcer = LayoutAnnouncer::open(&node, "x", "writer", &shape).unwrap();
    let writer = domain.plain_writer::<S>("x");
    let mut sample = writer.loan_slice(1).unwrap();
    sample.user_header_mut().layout = shape.number();
    sample.payload_mut()[0] = 4.0;
    sample.send().unwrap();
    let frame = reader.wait(PATIENCE).unwrap();
    let [service, publisher] = ["x", "writer"].map(str::to_owned);
    let error = SignalError::TooShort { service, publisher, channels: 1, needed: 2 };
    assert_eq!(frame.values().map(drop), Err(error.clone()));
    assert_eq!(frame.value("b"), Err(error));
    assert_eq!(frame.value("a"), Ok(4.0));
}

fn frames_that_were_received_can_be_given_without_taking_new_ones<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let mut reader = reader(&node, &["a"]);
    let shape = layout(&["a:LREAL"]);
    let mut publisher = FramePublisher::open(&node, "x", &shape).unwrap();
    send(&mut publisher, &[1.0]);
    assert!(reader.next_frame().is_none() && reader.is_waiting());
    send(&mut publisher, &[2.0]);
    assert!(reader.next_waiting().is_none(), "its layout is not known");
    let _announcer = LayoutAnnouncer::open(&node, "x", "writer", &shape).unwrap();
    wait_until("the layout is known", || {
        reader.next_waiting().is_some_and(|frame| frame.value("a") == Ok(1.0))
    });
    assert!(!reader.is_waiting() && reader.next_waiting().is_none());
    assert_eq!(reader.wait(PATIENCE).unwrap().value("a"), Ok(2.0));
}

fn each_frame_says_how_many_were_lost_before_it<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let mut reader = reader(&node, &["a"]);
    let mut writer = Writer::open(&node, &["a:LREAL"]);
    writer.send(&[0.0]);
    assert_eq!(reader.wait(PATIENCE).unwrap().lost(), 0);
    // More than wait for a reader.
    (0..1000).for_each(|_| writer.send(&[0.0]));
    let first = reader.wait(PATIENCE).unwrap();
    assert_eq!(first.lost(), first.sequence() - 1);
    let (mut lost, mut frames) = (first.lost(), 2);
    while let Some(frame) = reader.next_frame() {
        lost += frame.lost();
        frames += 1;
    }
    assert_eq!(lost + frames, 1001);
    assert_eq!(reader.subscriber().counters().lost, lost);
}

fn two_readers_get_every_frame_and_one_goes_on_without_the_other<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let mut first = reader(&node, &["a"]);
    let mut second = reader(&node, &["b"]);
    let mut writer = Writer::open(&node, &["a:LREAL", "b:LREAL"]);
    for n in 0..50_u32 {
        writer.send(&[f64::from(n), 0.0]);
        assert_eq!(first.wait(PATIENCE).unwrap().value("a"), Ok(f64::from(n)));
    }
    for sequence in 0..50 {
        let frame = second.wait(PATIENCE).unwrap();
        assert_eq!((frame.sequence(), values(&frame)), (sequence, named(&[("b", 0.0)])));
    }
    drop(first);
    writer.send(&[0.0, 1.0]);
    assert_eq!(values(&second.wait(PATIENCE).unwrap()), named(&[("b", 1.0)]));
    assert_eq!(writer.publisher.subscribers(), 1);
}

fn a_service_that_does_not_exist_is_not_created_by_looking_for_it<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    assert!(SignalReader::open_existing(&node, "x", &[]).unwrap().is_none());
    let mut writer = Writer::open(&node, &["a:LREAL"]);
    let mut reader = SignalReader::open_existing(&node, "x", &[]).unwrap().unwrap();
    reader = reader.with_patience(PATIENCE);
    writer.send(&[1.0]);
    assert_eq!(values(&reader.wait(PATIENCE).unwrap()), named(&[("a", 1.0)]));
    assert!(SignalReader::open(&node, "a\nb", &[]).is_err());
}

#[test]
fn nothing_of_a_reader_is_left_when_it_is_dropped() {
    let domain = Domain::new();
    let node = domain.join("tester");
    let mut reader = reader(&node, &["a"]);
    let mut writer = Writer::open(&node, &["a:LREAL"]);
    writer.send(&[1.0]);
    assert!(reader.wait(PATIENCE).is_some());
    drop(writer);
    drop(reader);
    drop(node);
    remove_leftovers(&domain);
    assert_eq!(domain.files(), Vec::<String>::new());
}

/// Tells the writing process its signals.
const SIGNALS: &str = "ISOCHRONE_TEST_SIGNALS";

#[test]
fn a_reader_goes_on_when_its_writer_is_killed_and_comes_back_with_other_signals() {
    let domain = Domain::new();
    let node = domain.join("tester");
    let mut reader = reader(&node, &["b"]);
    for signals in ["a:LREAL,b:LREAL", "b:LREAL", "c:INT,a:LREAL,b:LREAL"] {
        let mut writer = start_writer(&domain, signals);
        let place = signals.split(',').position(|signal| signal == "b:LREAL").unwrap();
        let mut taken = 0;
        wait_until("ten frames of this writer came", || {
            let frame = reader.wait(PATIENCE).unwrap();
            // Some of the one before may have waited.
            let is_of_it = frame.channels().len() == signals.split(',').count();
            if is_of_it {
                assert_eq!(values(&frame), named(&[("b", place as f64)]));
                taken += 1;
            }
            taken == 10
        });
        writer.kill().unwrap();
        writer.wait().unwrap();
    }
}

fn start_writer(domain: &Domain, signals: &str) -> Child {
    let mut command = role("signal_reader::a_writer_in_a_process_of_its_own", &domain.file());
    command.env(SIGNALS, signals).stdout(Stdio::null()).spawn().unwrap()
}

#[test]
#[ignore = "the other process of a test above"]
fn a_writer_in_a_process_of_its_own() {
    let Some(domain) = role_domain() else { return };
    let signals = std::env::var(SIGNALS).unwrap();
    let signals: Vec<&str> = signals.split(',').collect();
    let participant = Participant::<ipc::Service>::join("writer", domain).unwrap();
    let mut writer = Writer::open(&participant, &signals);
    let sent: Vec<f64> = (0..signals.len()).map(|place| place as f64).collect();
    loop {
        participant.tend();
        writer.send(&sent);
        thread::sleep(Duration::from_millis(1));
    }
}
