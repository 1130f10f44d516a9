//! Readers that sleep until a frame comes.

use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{
    Depth, FrameLayout, FramePublisher, FrameSubscriber, IsolatedDomain, Participant, SignalSpec,
    Stamp, ipc,
};
use isochrone_runtime::FrameWait;
use isochrone_testing::PATIENCE;

type Ipc = ipc::Service;

/// Fewer than a buffer holds, so that a test that gets no CPU loses none.
const FRAMES: u64 = 100;

/// Until when a test waits for what must come.
fn patience_ns() -> u64 {
    Monotonic.now_ns() + PATIENCE.as_nanos() as u64
}

fn layout() -> FrameLayout {
    FrameLayout { signals: vec![SignalSpec::new("x", "LREAL")], period_ns: None }
}

/// Sends frames with these pauses between them, and stays until the reader has them.
fn publish(
    domain: &IsolatedDomain,
    service: &str,
    pause: impl Fn(u64) -> Duration,
    are_taken: &Receiver<()>,
) {
    let participant = Participant::<Ipc>::join("writer", domain).unwrap();
    let mut publisher = FramePublisher::open(&participant, service, &layout()).unwrap();
    for cycle in 0..FRAMES {
        publisher.prepare();
        publisher.send(Stamp { cycle, ..Stamp::default() }, || Monotonic.now_ns());
        thread::sleep(pause(cycle));
    }
    // Fails where the reader has panicked.
    let _ = are_taken.recv();
}

/// Takes as many frames as one writer sends.
fn take_all(wait: &FrameWait, subscriber: &mut FrameSubscriber<Ipc>) {
    for cycle in 0..FRAMES {
        let frame = wait.next(subscriber, patience_ns()).expect("a frame");
        assert_eq!((frame.header().sequence, frame.header().cycle), (cycle, cycle));
    }
    assert_eq!(subscriber.counters().lost, 0);
}

#[test]
fn a_reader_that_sleeps_takes_every_frame_whatever_their_rhythm_and_after_each_restart() {
    let domain = IsolatedDomain::new("isotest").unwrap();
    let participant = Participant::<Ipc>::join("reader", &domain).unwrap();
    let mut subscriber = FrameSubscriber::open(&participant, "test/x", 1, Depth::All).unwrap();
    let wait = FrameWait::in_this_thread();
    let pauses: [fn(u64) -> Duration; 3] = [
        |_| Duration::from_millis(1),
        |cycle| Duration::from_micros(cycle * 7919 % 3000),
        |cycle| Duration::from_millis(if cycle % 10 == 9 { 10 } else { 0 }),
    ];
    for (restarts, pause) in (0..).zip(pauses) {
        thread::scope(|scope| {
            let (taken, are_taken) = channel();
            let domain = &domain;
            scope.spawn(move || publish(domain, "test/x", pause, &are_taken));
            take_all(&wait, &mut subscriber);
            drop(taken);
        });
        assert_eq!(subscriber.counters().restarts, restarts);
    }
}

#[test]
fn two_services_are_read_in_one_thread_by_the_earliest_of_their_looks() {
    let domain = IsolatedDomain::new("isotest").unwrap();
    let participant = Participant::<Ipc>::join("reader", &domain).unwrap();
    let services = ["test/a", "test/b"];
    let mut subscribers = services
        .map(|service| FrameSubscriber::open(&participant, service, 1, Depth::All).unwrap());
    let wait = FrameWait::in_this_thread();
    thread::scope(|scope| {
        let mut all_taken = Vec::new();
        for (service, pause_ms) in services.into_iter().zip([1, 3]) {
            let pause = move |_| Duration::from_millis(pause_ms);
            let domain = &domain;
            let (taken, are_taken) = channel();
            all_taken.push(taken);
            scope.spawn(move || publish(domain, service, pause, &are_taken));
        }
        let mut taken = [0, 0];
        let until_ns = patience_ns();
        while taken != [FRAMES; 2] {
            for (subscriber, taken) in subscribers.iter_mut().zip(&mut taken) {
                while let Some(frame) = subscriber.next(Monotonic.now_ns()) {
                    assert_eq!(frame.header().sequence, *taken);
                    *taken += 1;
                }
            }
            let now_ns = Monotonic.now_ns();
            assert!(now_ns < until_ns, "{taken:?}");
            let looks = subscribers.iter_mut().map(|subscriber| subscriber.next_look_ns(now_ns));
            wait.sleep_until_ns(looks.min().unwrap());
        }
        drop(all_taken);
    });
}

#[test]
fn a_wait_ends_at_its_time_where_nobody_writes_and_returns_what_lies_there_even_after_it() {
    let domain = IsolatedDomain::new("isotest").unwrap();
    let participant = Participant::<Ipc>::join("both", &domain).unwrap();
    let mut subscriber = FrameSubscriber::open(&participant, "test/x", 1, Depth::All).unwrap();
    let wait = FrameWait::in_this_thread();
    let until_ns = Monotonic.now_ns() + 20_000_000;
    assert!(wait.next(&mut subscriber, until_ns).is_none());
    assert!(Monotonic.now_ns() >= until_ns);
    let mut publisher = FramePublisher::open(&participant, "test/x", &layout()).unwrap();
    publisher.prepare();
    publisher.send(Stamp::default(), || Monotonic.now_ns());
    let frame = wait.next(&mut subscriber, until_ns).expect("the frame that lies there");
    assert_eq!(frame.header().sequence, 0);
}

#[test]
fn a_frame_that_was_looked_at_is_the_next_one() {
    let domain = IsolatedDomain::new("isotest").unwrap();
    let participant = Participant::<Ipc>::join("both", &domain).unwrap();
    let mut subscriber = FrameSubscriber::open(&participant, "test/x", 1, Depth::All).unwrap();
    let mut publisher = FramePublisher::open(&participant, "test/x", &layout()).unwrap();
    assert!(subscriber.peek_next(Monotonic.now_ns()).is_none());
    for cycle in 0..3 {
        publisher.prepare();
        publisher.send(Stamp { cycle, ..Stamp::default() }, || Monotonic.now_ns());
    }
    let now_ns = Monotonic.now_ns();
    assert_eq!(subscriber.peek_next(now_ns).map(|header| header.cycle), Some(0));
    assert_eq!(subscriber.peek_next(now_ns).map(|header| header.cycle), Some(0));
    let mut cycles = Vec::new();
    while let Some(frame) = subscriber.next(now_ns) {
        cycles.push(frame.header().cycle);
    }
    assert_eq!(cycles, [0, 1, 2]);
    assert_eq!(subscriber.counters().received, 3);
}
