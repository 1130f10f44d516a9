//! Frames of a publisher on the grid of the tasks.

use isochrone_cyclic::epoch_after_ns;
use isochrone_cyclic::{Clock, Monotonic};
use isochrone_ipc::{Depth, FrameSubscriber};
use isochrone_testing::plants::RELAY;
use isochrone_testing::{Domain, wait_until};

const PERIOD_NS: u64 = 2_000_000;

/// When so many frames of a service were due, after the grid that tasks without a phase have.
fn phases(domain: &Domain, service: &str, frames: usize) -> Vec<u64> {
    let participant = domain.join("reader");
    let mut subscriber = FrameSubscriber::open(&participant, service, 1, Depth::All).unwrap();
    let mut phases = Vec::new();
    wait_until("frames", || {
        subscriber.maintain();
        while let Some(frame) = subscriber.next(Monotonic.now_ns()) {
            let behind_ns = frame.header().release_ns - epoch_after_ns(0) % PERIOD_NS;
            phases.push(behind_ns % PERIOD_NS);
        }
        phases.len() >= frames
    });
    phases
}

#[test]
fn frames_at_a_rate_are_due_at_their_phase_on_the_grid_of_the_tasks_whenever_they_start() {
    let domain = Domain::new();
    let with_phase = RELAY.replace("\"2ms\"", "\"2ms\"\nphase = \"300us\"");
    let _node = domain.start_node("relay.toml", &with_phase, "");
    assert!(phases(&domain, "relay/out", 20).iter().all(|phase| *phase == 300_000));
    for (phase, due_ns) in [("--phase 300us", 300_000), ("--phase 1.9ms", 1_900_000), ("", 150_000)]
    {
        for _ in 0..3 {
            let _publisher = domain.start(&format!("publish plant/x --value 1 --rate 500 {phase}"));
            let phases = phases(&domain, "plant/x", 20);
            assert!(phases.iter().all(|phase| *phase == due_ns), "{phase}: {phases:?}");
        }
    }
}
