//! How readers learn what frames are.

use crate::variants::{NOW_NS, layout, remove_leftovers, send};
use iceoryx2::prelude::{NodeBuilder, ServiceName};
use iceoryx2::service::port_factory::PortFactory as _;
use isochrone_ipc::{
    Announcement, Depth, FrameLayout, FramePublisher, FrameSubscriber, LayoutAnnouncer,
    LayoutWatcher, Participant, SenderClock, Service, SignalSpec, layout_service_name,
};
use isochrone_testing::{Domain, wait_until};

for_both_variants! {
    a_reader_that_waits_learns_the_layout_when_the_writer_comes
    a_reader_that_comes_late_learns_the_layout_at_the_next_look
    a_writer_comes_back_with_another_layout_while_its_readers_wait
    a_layout_of_thousands_of_signals_arrives_whole
    sixty_four_readers_learn_the_layout
    a_message_that_is_no_layout_does_no_harm
    whoever_creates_a_service_of_layouts_sets_its_quality
}

/// Both in turns, as ordinary threads do, until something new was learned.
fn learn<S: Service>(
    node: &Participant<S>,
    announcer: &mut LayoutAnnouncer<S>,
    watcher: &mut LayoutWatcher<S>,
) -> Announcement {
    wait_until("something is announced", || {
        let is_new = watcher.look(node);
        if !is_new {
            announcer.tend(node);
        }
        is_new
    });
    watcher.newest().unwrap().clone()
}

fn a_reader_that_waits_learns_the_layout_when_the_writer_comes<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let mut watcher = LayoutWatcher::open(&node, "x").unwrap();
    assert!(!watcher.look(&node));
    let shape = layout(&["level.y:LREAL", "alarm:BOOL", "count:INT"]);
    // Without another word of the writer: it may be about to send its first frame.
    let _announcer = LayoutAnnouncer::open(&node, "x", "level", &shape).unwrap();
    assert!(watcher.look(&node));
    let learned = watcher.newest().unwrap();
    assert_eq!(*learned, Announcement::new("level", &shape));
    assert_eq!((learned.number, learned.clock()), (shape.number(), SenderClock::Shared));
    assert_eq!(watcher.find(shape.number()), Some(learned));
    assert_eq!(watcher.find(shape.number() ^ 1), None);
}

fn a_reader_that_comes_late_learns_the_layout_at_the_next_look<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let shape = layout(&["a:LREAL"]);
    let mut announcer = LayoutAnnouncer::open(&node, "x", "level", &shape).unwrap();
    announcer.tend(&node);
    let mut watcher = LayoutWatcher::open(&node, "x").unwrap();
    announcer.tend(&node);
    assert!(watcher.look(&node));
    assert_eq!(watcher.newest().unwrap().layout, shape);
}

fn a_writer_comes_back_with_another_layout_while_its_readers_wait<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let mut reader = FrameSubscriber::open(&node, "x", 2, Depth::Newest).unwrap();
    let mut watcher = LayoutWatcher::open(&node, "x").unwrap();
    for (signals, found) in [
        (["a:LREAL", "b:LREAL"].as_slice(), Some(1.0)),
        (&["b:LREAL", "a:LREAL", "c:INT"], Some(0.0)),
        (&["a:LREAL"], None),
        (&["b:BOOL"], None),
        (&["a:LREAL", "c:LREAL", "b:LREAL"], Some(2.0)),
    ] {
        let shape = layout(signals);
        let mut writer = FramePublisher::open(&node, "x", &shape).unwrap();
        let mut announcer = LayoutAnnouncer::open(&node, "x", "me", &shape).unwrap();
        learn(&node, &mut announcer, &mut watcher);
        writer.prepare();
        let values = writer.values_mut().unwrap();
        values.iter_mut().enumerate().for_each(|(channel, value)| *value = channel as f64);
        assert!(writer.send(Default::default(), || 1));
        let frame = reader.newest(NOW_NS).unwrap();
        let announced = watcher.find(frame.header().layout).expect("frames say which they are");
        let fits = |channel: &usize| announced.layout.check_channel(*channel, "LREAL").is_ok();
        let value = announced.layout.find("b").ok().filter(fits).map(|place| frame.values()[place]);
        assert_eq!(value, found, "{signals:?}");
    }
}

fn a_layout_of_thousands_of_signals_arrives_whole<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let signal = |i: usize| SignalSpec {
        unit: if i.is_multiple_of(3) { "m/s²".to_owned() } else { String::new() },
        ..SignalSpec::new(format!("station{}.level{i}", i * 7919 % 65_537), "LREAL")
    };
    let shape =
        FrameLayout { signals: (0..6_000).map(signal).collect(), period_ns: Some(u64::MAX) };
    let mut announcer = LayoutAnnouncer::open(&node, "x", "wide", &shape).unwrap();
    let mut watcher = LayoutWatcher::open(&node, "x").unwrap();
    assert_eq!(learn(&node, &mut announcer, &mut watcher).layout, shape);
}

fn sixty_four_readers_learn_the_layout<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let shape = layout(&["a:LREAL"]);
    let mut announcer = LayoutAnnouncer::open(&node, "x", "me", &shape).unwrap();
    let open = || LayoutWatcher::open(&node, "x");
    let mut watchers: Vec<_> = (0..64).map(|_| open().unwrap()).collect();
    announcer.tend(&node);
    for watcher in &mut watchers {
        assert_eq!(learn(&node, &mut announcer, watcher).layout, shape);
    }
    let error = open().unwrap_err().to_string();
    assert!(error.contains("no place for another subscriber"), "{error}");
}

fn a_message_that_is_no_layout_does_no_harm<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let mut watcher = LayoutWatcher::open(&node, "x").unwrap();
    let other = NodeBuilder::new().config(domain.config()).create::<S>().unwrap();
    let service = other
        .service_builder(&ServiceName::new(&layout_service_name("x").unwrap()).unwrap())
        .publish_subscribe::<[u8]>()
        .open()
        .unwrap();
    let port = service.publisher_builder().initial_max_slice_len(64).create().unwrap();
    for nonsense in [b"".as_slice(), b"{", b"\xff\xff", b"{\"layout\": \"0\", \"signals\": []}"] {
        let message = port.loan_slice_uninit(nonsense.len()).unwrap();
        message.write_from_slice(nonsense).send().unwrap();
        assert!(!watcher.look(&node));
    }
    let shape = layout(&["a:LREAL"]);
    let mut announcer = LayoutAnnouncer::open(&node, "x", "me", &shape).unwrap();
    assert_eq!(learn(&node, &mut announcer, &mut watcher).layout, shape);
}

fn whoever_creates_a_service_of_layouts_sets_its_quality<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let _watcher = LayoutWatcher::open(&node, "x").unwrap();
    let other = NodeBuilder::new().config(domain.config()).create::<S>().unwrap();
    let service = other
        .service_builder(&ServiceName::new("isochrone/layout/x").unwrap())
        .publish_subscribe::<[u8]>()
        .open()
        .unwrap();
    let quality = service.static_config();
    assert!(quality.has_safe_overflow());
    assert_eq!((quality.subscriber_max_buffer_size(), quality.history_size()), (1, 0));
    assert_eq!(quality.subscriber_max_borrowed_samples(), 1);
    assert_eq!((quality.max_publishers(), quality.max_subscribers()), (5, 65));
}

#[test]
fn nothing_of_a_layout_is_left_when_both_ends_have_gone() {
    let domain = Domain::new();
    let node = domain.join_variant::<isochrone_ipc::ipc::Service>("tester");
    let shape = layout(&["a:LREAL"]);
    let mut announcer = LayoutAnnouncer::open(&node, "x", "me", &shape).unwrap();
    let mut watcher = LayoutWatcher::open(&node, "x").unwrap();
    learn(&node, &mut announcer, &mut watcher);
    let mut writer = FramePublisher::open(&node, "x", &shape).unwrap();
    send(&mut writer, 1.0, 1);
    drop((announcer, watcher, writer, node));
    remove_leftovers(&domain);
    assert_eq!(domain.files(), Vec::<String>::new());
}
