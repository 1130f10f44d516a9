//! What a frame is when it arrives.

mod domain;

use domain::{Domain, layout, send};
use isochrone_ipc::{Depth, FrameHeader, FramePublisher, FrameSubscriber, Service, Stamp};

for_both_variants! {
    a_frame_arrives_bit_for_bit
    the_header_tells_all_that_was_stamped
    the_sequence_has_no_gap
    the_newest_of_many_frames_wins
    a_reader_of_all_frames_gets_them_in_order
    a_late_reader_gets_the_next_frame_and_no_old_one
    a_restarted_publisher_is_picked_up_by_the_same_reader
    newest_goes_by_publish_time_and_not_by_arrival
    nothing_is_sent_that_was_not_prepared
    a_prepared_frame_starts_at_zero
    preparing_twice_keeps_what_was_written
    a_frame_can_be_read_while_the_next_ones_overrun_the_buffer
    peers_that_join_and_leave_are_counted
}

fn a_frame_arrives_bit_for_bit<S: Service>() {
    let domain = Domain::new();
    let node = domain.join::<S>();
    let bits = [
        f64::NAN.to_bits(),
        0x7ff0_0000_dead_beef,
        (-0.0_f64).to_bits(),
        f64::MIN_POSITIVE.to_bits() >> 3,
        f64::NEG_INFINITY.to_bits(),
    ];
    let shape = layout(&["a:LREAL", "b:LREAL", "c:LREAL", "d:LREAL", "e:LREAL"]);
    let mut reader = FrameSubscriber::open(&node, "x", &shape, Depth::Newest).unwrap();
    let mut writer = FramePublisher::open(&node, "x", &shape).unwrap();
    assert!(writer.prepare());
    for (value, bits) in writer.values_mut().unwrap().iter_mut().zip(bits) {
        *value = f64::from_bits(bits);
    }
    assert!(writer.send(Stamp::default(), || 1));
    let frame = reader.newest().unwrap();
    let received: Vec<u64> = frame.values().iter().map(|v| v.to_bits()).collect();
    assert_eq!(received, bits);
}

fn the_header_tells_all_that_was_stamped<S: Service>() {
    let domain = Domain::new();
    let node = domain.join::<S>();
    let shape = layout(&["a:LREAL"]);
    let mut reader = FrameSubscriber::open(&node, "x", &shape, Depth::Newest).unwrap();
    let mut writer = FramePublisher::open(&node, "x", &shape).unwrap();
    writer.prepare();
    let stamp = Stamp { cycle: 11, release_ns: 22, source_ns: 44, missed: 55 };
    writer.send(stamp, || 33);
    assert_eq!(
        *reader.newest().unwrap().header(),
        FrameHeader {
            sequence: 0,
            cycle: 11,
            release_ns: 22,
            publish_ns: 33,
            source_ns: 44,
            missed: 55,
        }
    );
}

fn the_sequence_has_no_gap<S: Service>() {
    let domain = Domain::new();
    let node = domain.join::<S>();
    let shape = layout(&["a:LREAL"]);
    let mut reader = FrameSubscriber::open(&node, "x", &shape, Depth::Newest).unwrap();
    let mut writer = FramePublisher::open(&node, "x", &shape).unwrap();
    for cycle in 0..20_000_u64 {
        send(&mut writer, cycle as f64, cycle);
        let frame = reader.newest().unwrap();
        assert_eq!(frame.header().sequence, cycle);
        assert_eq!(frame.values(), [cycle as f64]);
    }
    assert_eq!(writer.counters().sent, 20_000);
    assert_eq!(writer.counters().silent, 0);
    assert_eq!(reader.counters().received, 20_000);
}

fn the_newest_of_many_frames_wins<S: Service>() {
    let domain = Domain::new();
    let node = domain.join::<S>();
    let shape = layout(&["a:LREAL"]);
    let mut writer = FramePublisher::open(&node, "x", &shape).unwrap();
    for depth in [Depth::Newest, Depth::All] {
        let mut reader = FrameSubscriber::open(&node, "x", &shape, depth).unwrap();
        for n in 0..1000_u32 {
            send(&mut writer, f64::from(n), n.into());
        }
        assert_eq!(reader.newest().unwrap().values(), [999.0]);
        assert!(reader.newest().is_none(), "all were taken");
    }
}

fn a_reader_of_all_frames_gets_them_in_order<S: Service>() {
    let domain = Domain::new();
    let node = domain.join::<S>();
    let shape = layout(&["a:LREAL"]);
    let mut writer = FramePublisher::open(&node, "x", &shape).unwrap();
    let mut reader = FrameSubscriber::open(&node, "x", &shape, Depth::All).unwrap();
    for n in 0..256_u32 {
        send(&mut writer, f64::from(n), n.into());
    }
    for n in 0..256_u32 {
        assert_eq!(reader.next().unwrap().header().sequence, u64::from(n));
    }
    assert!(reader.next().is_none());
    assert_eq!(reader.counters().receive_errors, 0);
}

fn a_late_reader_gets_the_next_frame_and_no_old_one<S: Service>() {
    let domain = Domain::new();
    let node = domain.join::<S>();
    let shape = layout(&["a:LREAL"]);
    let mut writer = FramePublisher::open(&node, "x", &shape).unwrap();
    send(&mut writer, 1.0, 1);
    let mut reader = FrameSubscriber::open(&node, "x", &shape, Depth::All).unwrap();
    writer.prepare();
    assert!(reader.newest().is_none());
    send(&mut writer, 2.0, 2);
    assert_eq!(reader.newest().unwrap().values(), [2.0]);
}

fn a_restarted_publisher_is_picked_up_by_the_same_reader<S: Service>() {
    let domain = Domain::new();
    let node = domain.join::<S>();
    let shape = layout(&["a:LREAL"]);
    let mut reader = FrameSubscriber::open(&node, "x", &shape, Depth::Newest).unwrap();
    let mut publish_ns = 0;
    for life in 0..20 {
        let mut writer = FramePublisher::open(&node, "x", &shape).unwrap();
        reader.maintain();
        for n in 0..5 {
            publish_ns += 1;
            send(&mut writer, f64::from(life * 100 + n), publish_ns);
        }
        // Every other one ends before it is read, and leaves its frames.
        if life % 2 == 0 {
            let frame = reader.newest().unwrap();
            assert_eq!(frame.values(), [f64::from(life * 100 + 4)]);
            assert_eq!(frame.header().sequence, 4);
        }
    }
    assert_eq!(reader.newest().unwrap().values(), [1904.0]);
    assert!(reader.newest().is_none());
    assert_eq!(reader.counters().receive_errors, 0);
}

fn newest_goes_by_publish_time_and_not_by_arrival<S: Service>() {
    let domain = Domain::new();
    let node = domain.join::<S>();
    let shape = layout(&["a:LREAL"]);
    let mut reader = FrameSubscriber::open(&node, "x", &shape, Depth::Newest).unwrap();
    let mut writer = FramePublisher::open(&node, "x", &shape).unwrap();
    // A link's publisher has the second place, and is read after ours.
    let link = iceoryx2::prelude::NodeBuilder::new().config(&domain.config).create::<S>().unwrap();
    let service = link
        .service_builder(&"x".try_into().unwrap())
        .publish_subscribe::<[f64]>()
        .user_header::<FrameHeader>()
        .open()
        .unwrap();
    let mirror = service.publisher_builder().initial_max_slice_len(1).create().unwrap();
    let mirror = |value, publish_ns, sequence| {
        let mut frame = mirror.loan_slice(1).unwrap();
        frame.payload_mut()[0] = value;
        frame.user_header_mut().publish_ns = publish_ns;
        frame.user_header_mut().sequence = sequence;
        frame.send().unwrap();
    };
    send(&mut writer, 2.0, 200);
    mirror(1.0, 100, 77);
    assert_eq!(reader.newest().unwrap().values(), [2.0]);
    send(&mut writer, 3.0, 300);
    mirror(4.0, 400, 0);
    assert_eq!(reader.newest().unwrap().values(), [4.0]);
    assert_eq!(reader.publishers(), 2);
}

fn nothing_is_sent_that_was_not_prepared<S: Service>() {
    let domain = Domain::new();
    let node = domain.join::<S>();
    let shape = layout(&["a:LREAL"]);
    let mut reader = FrameSubscriber::open(&node, "x", &shape, Depth::All).unwrap();
    let mut writer = FramePublisher::open(&node, "x", &shape).unwrap();
    assert!(writer.send(Stamp::default(), || 1), "opening prepared a frame");
    assert!(writer.values_mut().is_none());
    assert!(!writer.send(Stamp::default(), || 2));
    assert_eq!(writer.counters().unsent, 1);
    assert_eq!(writer.counters().sent, 1);
    send(&mut writer, 0.0, 3);
    assert_eq!(reader.next().unwrap().header().sequence, 0);
    let sequence = reader.next().unwrap().header().sequence;
    assert_eq!(sequence, 2, "the reader sees that one is missing");
    assert!(reader.next().is_none());
}

fn a_prepared_frame_starts_at_zero<S: Service>() {
    let domain = Domain::new();
    let node = domain.join::<S>();
    let mut writer = FramePublisher::open(&node, "x", &layout(&["a:LREAL"])).unwrap();
    // More often than there are chunks, so that used ones come back.
    for n in 0..10_000 {
        writer.prepare();
        assert_eq!(writer.values_mut().unwrap(), [0.0], "frame {n}");
        writer.values_mut().unwrap()[0] = 9.0;
        writer.send(Stamp::default(), || n);
    }
}

fn preparing_twice_keeps_what_was_written<S: Service>() {
    let domain = Domain::new();
    let node = domain.join::<S>();
    let mut writer = FramePublisher::open(&node, "x", &layout(&["a:LREAL"])).unwrap();
    assert!(writer.prepare());
    writer.values_mut().unwrap()[0] = 5.0;
    assert!(writer.prepare());
    assert_eq!(writer.values_mut().unwrap(), [5.0]);
}

fn a_frame_can_be_read_while_the_next_ones_overrun_the_buffer<S: Service>() {
    let domain = Domain::new();
    let node = domain.join::<S>();
    let shape = layout(&["a:LREAL"]);
    let mut reader = FrameSubscriber::open(&node, "x", &shape, Depth::Newest).unwrap();
    let mut writer = FramePublisher::open(&node, "x", &shape).unwrap();
    send(&mut writer, 1.0, 1);
    let held = reader.newest().unwrap();
    for n in 2..10_000 {
        send(&mut writer, 2.0, n);
    }
    assert_eq!(held.values(), [1.0]);
    assert_eq!(held.header().sequence, 0);
    assert_eq!(writer.counters().loan_errors, 0);
}

fn peers_that_join_and_leave_are_counted<S: Service>() {
    let domain = Domain::new();
    let node = domain.join::<S>();
    let shape = layout(&["a:LREAL"]);
    let mut writer = FramePublisher::open(&node, "x", &shape).unwrap();
    assert_eq!(writer.counters().connects, 0);
    let mut reader = FrameSubscriber::open(&node, "x", &shape, Depth::All).unwrap();
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
