//! Readers that sleep until a frame comes.

use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{
    FrameLayout, FramePublisher, LayoutAnnouncer, Participant, SignalReader, SignalSpec, Stamp, ipc,
};
use isochrone_testing::{Domain, PATIENCE};

type Ipc = ipc::Service;

/// How long a writer pauses after a frame, by its number.
type Pause = fn(u64) -> Duration;

/// Fewer than a buffer holds, so that a test that gets no CPU loses none.
const FRAMES: u64 = 100;

fn layout(period: Option<Duration>) -> FrameLayout {
    let period_ns = period.map(|period| period.as_nanos() as u64);
    FrameLayout { signals: vec![SignalSpec::new("x", "LREAL")], period_ns }
}

fn open<'p>(participant: &'p Participant<Ipc>, service: &str) -> SignalReader<'p, Ipc> {
    SignalReader::open(participant, service, &["x"]).unwrap().with_patience(PATIENCE)
}

/// Sends frames with these pauses between them, and stays until the reader has them.
fn publish(
    domain: &Domain,
    service: &str,
    period: Option<Duration>,
    pause: impl Fn(u64) -> Duration,
    are_taken: &Receiver<()>,
) {
    let participant = domain.join("writer");
    let layout = layout(period);
    let mut publisher = FramePublisher::open(&participant, service, &layout).unwrap();
    let mut announcer = LayoutAnnouncer::open(&participant, service, "writer", &layout).unwrap();
    for cycle in 0..FRAMES {
        announcer.tend(&participant);
        participant.tend();
        publisher.prepare();
        publisher.send(Stamp { cycle, ..Stamp::default() }, || Monotonic.now_ns());
        thread::sleep(pause(cycle));
    }
    // Fails where the reader has panicked.
    let _ = are_taken.recv();
}

/// Takes as many frames as one writer sends.
fn take_all(reader: &mut SignalReader<'_, Ipc>) {
    for cycle in 0..FRAMES {
        let frame = reader.wait(PATIENCE).expect("a frame");
        assert_eq!((frame.header().sequence, frame.header().cycle), (cycle, cycle));
    }
    assert_eq!(reader.subscriber().counters().lost, 0);
}

#[test]
fn a_reader_that_sleeps_takes_every_frame_whatever_is_announced_and_after_each_restart() {
    let domain = Domain::new();
    let participant = domain.join("reader");
    let mut reader = open(&participant, "test/x");
    let ms = Duration::from_millis;
    let pauses: [(Option<Duration>, Pause); 4] = [
        (Some(ms(1)), |_| Duration::from_millis(1)),
        (None, |_| Duration::from_millis(1)),
        // Not what was announced.
        (Some(ms(1000)), |cycle| Duration::from_micros(cycle * 7919 % 3000)),
        (Some(ms(1)), |cycle| Duration::from_millis(if cycle % 10 == 9 { 10 } else { 0 })),
    ];
    for (restarts, (period, pause)) in (0..).zip(pauses) {
        thread::scope(|scope| {
            let (taken, are_taken) = channel();
            let domain = &domain;
            scope.spawn(move || publish(domain, "test/x", period, pause, &are_taken));
            take_all(&mut reader);
            drop(taken);
        });
        assert_eq!(reader.subscriber().counters().restarts, restarts);
    }
}

#[test]
fn two_services_are_read_in_one_thread_by_the_earliest_of_their_looks() {
    let domain = Domain::new();
    let participant = domain.join("reader");
    let services = ["test/a", "test/b"];
    let mut readers = services.map(|service| open(&participant, service));
    thread::scope(|scope| {
        let mut all_taken = Vec::new();
        for (service, pause_ms) in services.into_iter().zip([1, 3]) {
            let pause = Duration::from_millis(pause_ms);
            let domain = &domain;
            let (taken, are_taken) = channel();
            all_taken.push(taken);
            scope.spawn(move || publish(domain, service, Some(pause), |_| pause, &are_taken));
        }
        let mut taken = [0, 0];
        let began = Instant::now();
        while taken != [FRAMES; 2] {
            for (reader, taken) in readers.iter_mut().zip(&mut taken) {
                while let Some(frame) = reader.next_frame() {
                    assert_eq!(frame.sequence(), *taken);
                    *taken += 1;
                }
            }
            assert!(began.elapsed() < PATIENCE, "{taken:?}");
            let looks = readers.iter_mut().map(SignalReader::next_look_ns);
            Monotonic.sleep_until_ns(looks.min().unwrap());
        }
        drop(all_taken);
    });
}

#[test]
fn a_wait_ends_at_its_time_where_nobody_writes_and_returns_what_lies_there_even_after_it() {
    let domain = Domain::new();
    let participant = domain.join("both");
    let mut reader = open(&participant, "test/x");
    let began = Instant::now();
    assert!(reader.wait(Duration::from_millis(20)).is_none());
    assert!(began.elapsed() >= Duration::from_millis(20));
    let layout = layout(None);
    let mut publisher = FramePublisher::open(&participant, "test/x", &layout).unwrap();
    let _announcer = LayoutAnnouncer::open(&participant, "test/x", "both", &layout).unwrap();
    publisher.prepare();
    publisher.send(Stamp::default(), || Monotonic.now_ns());
    // Its layout is heard at the next look for announcements, within 10 ms.
    thread::sleep(Duration::from_millis(10));
    assert_eq!(reader.wait(Duration::ZERO).expect("the frame that lies there").sequence(), 0);
}
