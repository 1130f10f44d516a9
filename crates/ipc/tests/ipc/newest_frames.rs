//! Readers that want the newest frame alone, and those that are told the layouts by another thread.

use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{
    Depth, FramePublisher, FrameSubscriber, LayoutAnnouncer, LayoutWatcher, Participant, Service,
    SignalError, SignalFrame, SignalReader, Stamp, ToldLayouts,
};
use isochrone_testing::{Domain, PATIENCE, wait_until};

use crate::variants::layout;

for_both_variants! {
    the_newest_frame_comes_without_those_before_it_and_once
    the_newest_frame_of_an_unknown_layout_waits_for_its_names
    newest_frames_whose_layout_nobody_announces_come_without_names_in_the_end
    a_reader_that_is_told_the_layouts_gives_names_and_follows_a_change
}

fn send<S: Service>(publisher: &mut FramePublisher<S>, values: &[f64]) {
    assert!(publisher.prepare());
    publisher.values_mut().unwrap().copy_from_slice(values);
    assert!(publisher.send(Stamp::default(), || Monotonic.now_ns()));
}

fn announce<S: Service>(node: &Participant<S>, signals: &[&str]) -> LayoutAnnouncer<S> {
    LayoutAnnouncer::open(node, "x", "writer", &layout(signals)).unwrap()
}

fn value<S: Service>(frame: Option<SignalFrame<'_, S>>) -> Option<f64> {
    Some(frame?.values().unwrap().next().unwrap().1)
}

fn the_newest_frame_comes_without_those_before_it_and_once<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let mut reader = SignalReader::open(&node, "x", &["a"]).unwrap().with_patience(PATIENCE);
    let mut publisher = FramePublisher::open(&node, "x", &layout(&["a:LREAL"])).unwrap();
    let mut announcer = announce(&node, &["a:LREAL"]);
    send(&mut publisher, &[1.0]);
    announcer.tend(&node);
    wait_until("the layout is known", || value(reader.newest_frame()) == Some(1.0));
    for value in [2.0, 3.0, 4.0] {
        send(&mut publisher, &[value]);
    }
    let frame = reader.newest_frame().unwrap();
    assert_eq!((frame.sequence(), frame.lost()), (3, 0), "what was left out is not lost");
    assert_eq!(value(Some(frame)), Some(4.0));
    assert!(reader.newest_frame().is_none());
    assert!(reader.next_frame().is_none());
    send(&mut publisher, &[5.0]);
    send(&mut publisher, &[6.0]);
    assert_eq!(value(reader.next_frame()), Some(5.0));
    assert_eq!(value(reader.newest_frame()), Some(6.0));
}

fn the_newest_frame_of_an_unknown_layout_waits_for_its_names<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let mut reader = SignalReader::open(&node, "x", &["a"]).unwrap().with_patience(PATIENCE);
    let mut publisher = FramePublisher::open(&node, "x", &layout(&["a:LREAL"])).unwrap();
    for value in [1.0, 2.0, 3.0] {
        send(&mut publisher, &[value]);
        assert!(reader.newest_frame().is_none());
        assert!(reader.is_waiting());
    }
    let mut announcer = announce(&node, &["a:LREAL"]);
    let mut newest = None;
    wait_until("the last of them came", || {
        announcer.tend(&node);
        newest = value(reader.newest_frame());
        newest.is_some()
    });
    assert_eq!(newest, Some(3.0));
    assert!(!reader.is_waiting());
}

fn newest_frames_whose_layout_nobody_announces_come_without_names_in_the_end<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let patience = Duration::from_millis(20);
    let mut reader = SignalReader::open(&node, "x", &["a"]).unwrap().with_patience(patience);
    let mut publisher = FramePublisher::open(&node, "x", &layout(&["a:LREAL"])).unwrap();
    wait_until("a frame came, although newer ones come all the time", || {
        send(&mut publisher, &[1.0]);
        let Some(frame) = reader.newest_frame() else { return false };
        let error = SignalError::Unnamed { service: "x".to_owned(), channels: 1 };
        assert_eq!(frame.values().map(drop), Err(error));
        true
    });
}

fn a_reader_that_is_told_the_layouts_gives_names_and_follows_a_change<S: Service>() {
    let domain = Domain::new();
    let node = domain.join_variant::<S>("tester");
    let subscriber = FrameSubscriber::open(&node, "x", 2, Depth::All).unwrap();
    let told = ToldLayouts::default();
    let mut watcher = LayoutWatcher::open(&node, "x").unwrap();
    let mut reader =
        SignalReader::told(subscriber, "x", &["b"], told.clone()).with_patience(PATIENCE);
    for (signals, values) in [(&["b:LREAL"][..], &[1.0][..]), (&["a:INT", "b:LREAL"], &[7.0, 2.0])]
    {
        let mut publisher = FramePublisher::open(&node, "x", &layout(signals)).unwrap();
        let mut announcer = announce(&node, signals);
        send(&mut publisher, values);
        assert!(reader.wait(Duration::from_millis(20)).is_none(), "nobody told the names");
        wait_until("the layout is heard", || {
            announcer.tend(&node);
            watcher.look(&node)
        });
        told.tell(&watcher);
        reader.maintain();
        let frame = reader.wait(PATIENCE).unwrap();
        assert_eq!(frame.values().unwrap().collect::<Vec<_>>(), [("b", values[values.len() - 1])]);
        assert_eq!(frame.obstacle(), None);
    }
    assert_eq!(reader.announced().unwrap().layout, layout(&["a:INT", "b:LREAL"]));
    let mut publisher = FramePublisher::open(&node, "x", &layout(&["c:LREAL"])).unwrap().plain();
    send(&mut publisher, &[3.0]);
    let frame = reader.wait(PATIENCE).unwrap();
    let error = SignalError::Unnamed { service: "x".to_owned(), channels: 1 };
    assert_eq!(frame.values().map(drop), Err(error));
}
