//! Waiting for what a running node does.

use std::thread;
use std::time::Instant;

use isochrone_ipc::Service;
use isochrone_runtime::{POLL_INTERVAL, Running};
use isochrone_testing::PATIENCE;

/// Waits, in the intervals that a node is polled in, until something holds.
#[track_caller]
pub(crate) fn poll_until<S: Service>(
    node: &mut Running<S>,
    mut holds: impl FnMut(&mut Running<S>) -> bool,
) {
    let since = Instant::now();
    while !holds(node) {
        assert!(since.elapsed() < PATIENCE, "it does not come to that");
        thread::sleep(POLL_INTERVAL);
    }
}
