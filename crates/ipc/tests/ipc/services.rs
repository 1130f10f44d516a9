//! Which services can be opened, and what is said of the others.

use std::fmt::Debug;
use std::sync::mpsc::{RecvTimeoutError, channel};

use crate::variants::{NOW_NS, joined, layout, open_reader, open_writer, send};
use iceoryx2::node::Node;
use iceoryx2::prelude::{IceoryxSend, NodeBuilder, ServiceName, ZeroCopySend};
use iceoryx2::service::builder::publish_subscribe::Builder;
use iceoryx2::service::port_factory::PortFactory as _;
use isochrone_ipc::{
    Depth, FrameHeader, FrameLayout, FramePublisher, FrameSubscriber, LayoutAnnouncer,
    LayoutWatcher, OpenError, Service, check_service_name,
};
use isochrone_testing::Domain;

for_both_variants! {
    a_second_publisher_is_refused_and_told_who_the_first_is
    a_service_of_another_payload_type_is_refused_with_both_sides_named
    a_service_of_another_header_is_refused_with_both_sides_named
    frames_of_the_first_version_are_refused_with_both_sides_named
    a_service_of_layouts_that_carries_something_else_is_refused
    a_frame_without_a_signal_is_refused
    readers_may_come_first_whatever_channels_they_need
    an_observer_finds_no_service_where_there_is_none
    a_service_of_foreign_quality_is_taken_as_it_is
    a_service_without_overflow_never_blocks_the_writer
    whoever_creates_a_service_sets_its_quality
    the_publisher_of_a_link_is_no_second_writer
    a_full_service_says_so
    opening_fails_for_a_name_that_cannot_be
    publishers_that_open_at_once_end_as_one
}

/// A node of iceoryx2 that goes by rules of its own.
fn stranger<S: Service>(domain: &Domain) -> Node<S> {
    NodeBuilder::new().config(domain.config()).create::<S>().unwrap()
}

/// Its service `x`, with a payload and a header of its choice.
fn frames<S, T, H>(node: &Node<S>) -> Builder<T, H, S>
where
    S: Service,
    T: Debug + IceoryxSend + ?Sized,
    H: Debug + ZeroCopySend,
{
    let service = node.service_builder(&ServiceName::new("x").unwrap());
    service.publish_subscribe::<T>().user_header::<H>()
}

fn a_second_publisher_is_refused_and_told_who_the_first_is<S: Service>() {
    let domain = Domain::new();
    let first = isochrone_ipc::Participant::<S>::join_variant("the-first", &domain).unwrap();
    let second = domain.join_variant::<S>("tester");
    let shape = layout(&["a:LREAL"]);
    let held = FramePublisher::open(&first, "plant/x", &shape).unwrap();
    let error = FramePublisher::open(&second, "plant/x", &shape).unwrap_err();
    let text = error.to_string();
    assert!(matches!(error, OpenError::SecondPublisher { .. }), "{text}");
    for part in ["\"plant/x\"", "\"the-first\"", &format!("pid {}", std::process::id())] {
        assert!(text.contains(part), "{part} in {text}");
    }
    FramePublisher::open(&second, "plant/y", &shape).unwrap();
    drop(held);
    FramePublisher::open(&second, "plant/x", &shape).unwrap();
}

/// What is said to each who opens the service `x` that a stranger makes so.
fn refusals<S: Service, P>(make: impl FnOnce(&Node<S>) -> P) -> [OpenError; 3] {
    let (domain, node) = joined::<S>();
    let other = stranger::<S>(&domain);
    let _service = make(&other);
    [
        FramePublisher::open(&node, "x", &layout(&["a:LREAL"])).map(drop).unwrap_err(),
        FrameSubscriber::open(&node, "x", 1, Depth::All).map(drop).unwrap_err(),
        FrameSubscriber::open_existing(&node, "x", Depth::All).map(drop).unwrap_err(),
    ]
}

#[track_caller]
fn assert_other_types(refusals: [OpenError; 3], sides: [&str; 2]) {
    for error in refusals {
        let text = error.to_string();
        assert!(matches!(error, OpenError::OtherTypes { .. }), "{text}");
        assert!(sides.iter().all(|side| text.contains(side)), "{text}");
    }
}

fn a_service_of_another_payload_type_is_refused_with_both_sides_named<S: Service>() {
    let sides = ["carries u64 (elements of 8 bytes)", "frames are [f64] (elements of 8 bytes)"];
    let make = |other: &Node<S>| frames::<S, u64, FrameHeader>(other).create().unwrap();
    assert_other_types(refusals(make), sides);
}

/// The user header that frames have.
const HEADER: &str = "user header isochrone.FrameHeader.v2 (72 bytes)";

fn a_service_of_another_header_is_refused_with_both_sides_named<S: Service>() {
    let sides = ["user header [u64; 6] (48 bytes)", HEADER];
    let make = |other: &Node<S>| frames::<S, [f64], [u64; 6]>(other).create().unwrap();
    assert_other_types(refusals(make), sides);
}

fn frames_of_the_first_version_are_refused_with_both_sides_named<S: Service>() {
    #[repr(C)]
    #[derive(Debug, ZeroCopySend)]
    #[type_name("isochrone.FrameHeader.v1")]
    struct FirstHeader([u64; 6]);
    let sides = ["isochrone.FrameHeader.v1 (48 bytes)", HEADER];
    let make = |other: &Node<S>| frames::<S, [f64], FirstHeader>(other).create().unwrap();
    assert_other_types(refusals(make), sides);
}

fn a_service_of_layouts_that_carries_something_else_is_refused<S: Service>() {
    let (domain, node) = joined::<S>();
    let other = stranger::<S>(&domain);
    let _service = other
        .service_builder(&ServiceName::new("isochrone/layout/x").unwrap())
        .publish_subscribe::<u64>()
        .create()
        .unwrap();
    let errors = [
        LayoutWatcher::open(&node, "x").map(drop).unwrap_err(),
        LayoutAnnouncer::open(&node, "x", "me", &layout(&["a:LREAL"])).map(drop).unwrap_err(),
    ];
    for error in errors.map(|error| error.to_string()) {
        for part in ["isochrone/layout/x", "carries u64", "layouts are [u8]"] {
            assert!(error.contains(part), "{part}: {error}");
        }
    }
}

fn a_frame_without_a_signal_is_refused<S: Service>() {
    let (_domain, node) = joined::<S>();
    let empty = FrameLayout::default();
    let errors = [
        FramePublisher::open(&node, "x", &empty).map(drop).unwrap_err(),
        LayoutAnnouncer::open(&node, "x", "me", &empty).map(drop).unwrap_err(),
    ];
    for error in errors.map(|error| error.to_string()) {
        assert!(error.contains("\"x\"") && error.contains("at least one"), "{error}");
    }
}

fn readers_may_come_first_whatever_channels_they_need<S: Service>() {
    let (_domain, node) = joined::<S>();
    let mut first = open_reader(&node, Depth::Newest);
    let mut second = FrameSubscriber::open(&node, "x", 3, Depth::Newest).unwrap();
    let shape = layout(&["a:LREAL", "b:LREAL", "c:INT"]);
    let mut writer = FramePublisher::open(&node, "x", &shape).unwrap();
    send(&mut writer, 1.0, 1);
    assert_eq!(first.newest(NOW_NS).unwrap().values(), [1.0, 0.0, 0.0]);
    assert_eq!(second.newest(NOW_NS).unwrap().values(), [1.0, 0.0, 0.0]);
}

fn an_observer_finds_no_service_where_there_is_none<S: Service>() {
    let (_domain, node) = joined::<S>();
    let found = FrameSubscriber::open_existing(&node, "x", Depth::All).unwrap();
    assert!(found.is_none());
    let found = FrameSubscriber::open_existing(&node, "x", Depth::All).unwrap();
    assert!(found.is_none(), "looking does not create it");
}

fn a_service_of_foreign_quality_is_taken_as_it_is<S: Service>() {
    let domain = Domain::new();
    let other = stranger::<S>(&domain);
    let _service = frames::<S, [f64], FrameHeader>(&other)
        .history_size(3)
        .subscriber_max_buffer_size(2)
        .subscriber_max_borrowed_samples(1)
        .max_publishers(1)
        .max_subscribers(2)
        .max_nodes(2)
        .create()
        .unwrap();
    let node = domain.join_variant::<S>("tester");
    let mut writer = open_writer(&node);
    send(&mut writer, 0.0, 0);
    let mut reader = open_reader(&node, Depth::All);
    writer.prepare();
    assert!(reader.newest(NOW_NS).is_none(), "the history was not asked for");
    for n in 1..100 {
        send(&mut writer, n as f64, n);
        send(&mut writer, n as f64 + 0.5, n);
        // In turns: there is never a second frame to hold.
        if n % 3 == 0 {
            assert_eq!(reader.peek_next(NOW_NS).unwrap().publish_ns, n);
            assert_eq!(reader.next(NOW_NS).unwrap().values(), [n as f64]);
            assert_eq!(reader.next(NOW_NS).unwrap().values(), [n as f64 + 0.5]);
        } else {
            assert!(n % 3 == 1 || reader.has_newer(NOW_NS, |_| true));
            assert_eq!(reader.newest(NOW_NS).unwrap().values(), [n as f64 + 0.5]);
        }
        if n % 5 == 0 {
            reader.maintain();
        }
    }
    let counters = reader.counters();
    assert_eq!((counters.received, counters.lost, counters.receive_errors), (198, 0, 0));
}

fn a_service_without_overflow_never_blocks_the_writer<S: Service>() {
    let (done, finished) = channel();
    let scenario = std::thread::spawn(move || {
        let domain = Domain::new();
        let other = stranger::<S>(&domain);
        let _service =
            frames::<S, [f64], FrameHeader>(&other).enable_safe_overflow(false).create().unwrap();
        let node = domain.join_variant::<S>("tester");
        let mut writer = open_writer(&node);
        let _reader = open_reader(&node, Depth::All);
        for n in 0..10 {
            send(&mut writer, 0.0, n);
        }
        writer.prepare();
        let missed = writer.counters().silent;
        assert_eq!(missed, 8, "two fit, the reader missed the others");
        done.send(()).unwrap();
    });
    // A writer that waits for its reader would do so for ever.
    let outcome = finished.recv_timeout(isochrone_testing::PATIENCE);
    assert_ne!(outcome, Err(RecvTimeoutError::Timeout), "the writer is blocked");
    scenario.join().unwrap();
}

fn whoever_creates_a_service_sets_its_quality<S: Service>() {
    let (domain, node) = joined::<S>();
    let _writer = open_writer(&node);
    let other = stranger::<S>(&domain);
    let service = frames::<S, [f64], FrameHeader>(&other).open().unwrap();
    let quality = service.static_config();
    assert!(quality.has_safe_overflow());
    assert_eq!(quality.history_size(), 0, "a command must not be stale");
    assert_eq!(quality.subscriber_max_buffer_size(), 256);
    assert_eq!(quality.subscriber_max_borrowed_samples(), 2);
    // One place more than ours take, for the peer that a repair shows.
    assert_eq!(quality.max_publishers(), 5);
    assert_eq!(quality.max_subscribers(), 17);
    assert_eq!(quality.max_nodes(), 40);
}

fn the_publisher_of_a_link_is_no_second_writer<S: Service>() {
    let (domain, node) = joined::<S>();
    let shape = layout(&["a:LREAL"]);
    let _reader = open_reader(&node, Depth::All);
    let link = stranger::<S>(&domain);
    let service = frames::<S, [f64], FrameHeader>(&link).open().unwrap();
    let _away = service.subscriber_builder().create().unwrap();
    let mirror = service.publisher_builder().create().unwrap();
    let writer = open_writer(&node);
    drop(writer);
    let more = (0..3).map(|_| service.publisher_builder().create().unwrap());
    let mirrors: Vec<_> = more.chain([mirror]).collect();
    let error = FramePublisher::open(&node, "x", &shape).unwrap_err().to_string();
    assert!(error.contains("no place for another publisher"), "{error}");
    assert!(error.contains("provided 4"), "{error}");
    drop(mirrors);
}

fn a_full_service_says_so<S: Service>() {
    let (domain, node) = joined::<S>();
    let shape = layout(&["a:LREAL"]);
    let open = || FrameSubscriber::open(&node, "x", shape.signals.len(), Depth::Newest);
    let crowd = isochrone_ipc::Participant::<S>::join_variant("the-crowd", &domain).unwrap();
    let join = || FrameSubscriber::open(&crowd, "x", shape.signals.len(), Depth::Newest);
    let readers: Vec<_> = (0..14).map(|_| join().unwrap()).collect();
    let own = [open().unwrap(), open().unwrap()];
    let error = open().unwrap_err().to_string();
    assert!(error.contains("service \"x\" has no place for another subscriber"), "{error}");
    assert!(error.contains("provided 16"), "{error}");
    let pid = format!("pid {}", std::process::id());
    for part in ["14 by node \"the-crowd\"", "2 by node \"", &pid, "end one"] {
        assert!(error.contains(part), "{part}: {error}");
    }
    drop(own);
    drop(readers);
    open().unwrap();
}

fn opening_fails_for_a_name_that_cannot_be<S: Service>() {
    let (_domain, node) = joined::<S>();
    let shape = layout(&["a:LREAL"]);
    let error = FramePublisher::open(&node, "", &shape).unwrap_err();
    assert!(error.to_string().starts_with("the service name is empty; give 1 to "), "{error}");
    let error = FrameSubscriber::open_existing(&node, "a\nb", Depth::All).unwrap_err();
    assert!(matches!(error, OpenError::ServiceName(_)));
}

fn publishers_that_open_at_once_end_as_one<S: Service>() {
    const THREADS: usize = 4;
    let domain = Domain::new();
    let shape = layout(&["a:LREAL"]);
    let node = domain.join_variant::<S>("tester");
    // Services that exist already, so that all reach the port at the same time.
    let names: Vec<String> = (0..3).map(|round| format!("x{round}")).collect();
    let open =
        |name| FrameSubscriber::open(&node, name, shape.signals.len(), Depth::Newest).unwrap();
    let _readers: Vec<_> = names.iter().map(|name| open(name)).collect();
    let together = std::sync::Barrier::new(THREADS);
    let open_all = || {
        let node = domain.join_variant::<S>("tester");
        let open = |name: &String| {
            together.wait();
            let port = FramePublisher::open(&node, name, &shape);
            together.wait();
            usize::from(port.is_ok())
        };
        names.iter().map(open).collect::<Vec<_>>()
    };
    let opened: Vec<Vec<usize>> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..THREADS).map(|_| scope.spawn(open_all)).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    for round in 0..names.len() {
        let writers: usize = opened.iter().map(|thread| thread[round]).sum();
        assert_eq!(writers, 1, "round {round}");
    }
}

#[test]
fn names_are_refused_with_the_rule_that_they_break() {
    let long = "x".repeat(239);
    let cases = [
        ("", "1 to 238 printable ASCII"),
        (long.as_str(), "at most 238"),
        (" ", "begins or ends with a blank"),
        ("plant/level ", "begins or ends with a blank"),
        (" plant/level", "begins or ends with a blank"),
        ("isochrone/layout/x", "where layouts are announced"),
        ("a\tb", "printable ASCII"),
        ("füllstand", "'ü'"),
        ("iox2://x", "keeps for itself"),
    ];
    for (name, rule) in cases {
        let error = check_service_name(name).unwrap_err().to_string();
        assert!(error.contains(rule), "{error}");
    }
    for name in ["a", "plant/analog", "with space", &long[..238]] {
        assert_eq!(check_service_name(name), Ok(()));
    }
}
