//! Two processes of one node: the second one takes over from the first, whatever becomes of that.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use isochrone_ipc::{Depth, FrameSubscriber};
use isochrone_testing::{Domain, Plant, Process, is_full_volume};

/// How far the ramp moves in a cycle of 10 ms.
const STEP: f64 = 1.0;

/// A ramp in a fast task, and one in a slow one.
fn ramps() -> Plant {
    Plant::new("level")
        .with("control = \"force\"")
        .task("fast", "10ms")
        .task("slow", "50ms")
        .on("fast")
        .ramp("ramp", "value = 1e6, setChangeRate = 100.0")
        .output("level/fast", &["ramp.delayedValue"])
        .on("slow")
        .ramp("late", "value = 1e6, setChangeRate = 20.0")
        .output("level/slow", &["late.delayedValue"])
}

fn domain() -> Domain {
    Domain::with(&[("level.toml", &ramps())])
}

const RUN: &str = "run level.toml --redundant";

/// The process that holds the node from its start.
fn holder(domain: &Domain) -> Process {
    domain.start_until(RUN, "waits for a standby")
}

/// A process that can take over.
fn standby(domain: &Domain) -> Process {
    domain.start_until(RUN, "can be taken over")
}

/// A frame as a reader got it.
#[derive(Debug, Clone, Copy)]
struct Got {
    sequence: u64,
    cycle: u64,
    term: u64,
    value: f64,
}

/// Reads all frames of a service, until it is asked for them.
struct Reader {
    stop: Arc<AtomicBool>,
    thread: JoinHandle<(Vec<Got>, [u64; 3])>,
}

impl Reader {
    fn of(domain: &Domain, service: &'static str) -> Self {
        let stop = Arc::<AtomicBool>::default();
        let (stopped, participant) = (Arc::clone(&stop), domain.join_variant("reader"));
        let thread = thread::spawn(move || {
            let mut frames = FrameSubscriber::<isochrone_ipc::ipc_threadsafe::Service>::open(
                &participant,
                service,
                1,
                Depth::All,
            )
            .unwrap();
            let mut got = Vec::new();
            while !stopped.load(Ordering::Relaxed) {
                frames.maintain();
                participant.tend();
                while let Some(frame) = frames.next(now_ns()) {
                    let (header, value) = (*frame.header(), frame.values()[0]);
                    let isochrone_ipc::FrameHeader { sequence, cycle, term, .. } = header;
                    got.push(Got { sequence, cycle, term, value });
                }
                thread::sleep(Duration::from_millis(1));
            }
            let counters = frames.counters();
            (got, [counters.restarts, counters.other_writers, counters.lost])
        });
        Self { stop, thread }
    }

    /// The frames, and how many restarts, frames of other writers and losses were counted.
    fn end(self) -> (Vec<Got>, [u64; 3]) {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().unwrap()
    }
}

fn now_ns() -> u64 {
    use isochrone_cyclic::Clock;
    isochrone_cyclic::Monotonic.now_ns()
}

/// Nothing goes back or repeats, and no output moves further than its rate allows for the time that passed.
#[track_caller]
fn assert_goes_on(got: &[Got], step: f64) {
    for pair in got.windows(2) {
        let [before, after] = [pair[0], pair[1]];
        assert!(after.cycle > before.cycle, "{before:?} {after:?}");
        assert!(after.sequence > before.sequence, "{before:?} {after:?}");
        assert!(after.term >= before.term, "{before:?} {after:?}");
        let passed = (after.cycle - before.cycle) as f64;
        let moved = after.value - before.value;
        assert!((0.0..=passed * step).contains(&moved), "{before:?} {after:?}");
    }
}

/// How many times the node changed hands.
fn takeovers(got: &[Got]) -> usize {
    got.windows(2).filter(|pair| pair[0].term != pair[1].term).count()
}

#[test]
fn a_holder_that_is_killed_at_any_moment_is_taken_over_without_a_bump() {
    let domain = domain();
    let mut holds = holder(&domain);
    let fast = Reader::of(&domain, "level/fast");
    let slow = Reader::of(&domain, "level/slow");
    let kills = if is_full_volume() { 500 } else { 12 };
    let mut seed = 11_u64;
    for _ in 0..kills {
        let mut stands_by = standby(&domain);
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        thread::sleep(Duration::from_millis((seed >> 33) % 40));
        holds.kill();
        stands_by.wait_for("is taken over by this process");
        holds = stands_by;
    }
    thread::sleep(Duration::from_millis(100));
    let (frames, [restarts, others, _]) = fast.end();
    assert_goes_on(&frames, STEP);
    assert!(takeovers(&frames) >= kills, "{}", takeovers(&frames));
    assert_eq!((restarts, others), (0, 0), "both processes are one writer");
    let (frames, [restarts, others, _]) = slow.end();
    assert_goes_on(&frames, STEP);
    assert_eq!((restarts, others), (0, 0));
}
