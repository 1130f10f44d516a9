//! What a node tells a test that asked for its events.

use std::time::{Duration, Instant};

use isochrone_model::{Action, Entry};
use isochrone_runtime::{Batch, Events};
use isochrone_testing::PATIENCE;

/// Takes batches of a node that runs until something holds; where nothing happens, empty ones.
#[track_caller]
pub(crate) fn take_until(events: &Events, mut holds: impl FnMut(Batch) -> bool) {
    let since = Instant::now();
    while !holds(events.within(Duration::from_millis(20)).expect("the node runs")) {
        assert!(since.elapsed() < PATIENCE, "it does not come to that");
    }
}

/// The next entries that are told, which this takes as many of as are wanted.
#[track_caller]
pub(crate) fn applied(events: &Events, count: usize) -> Vec<Entry> {
    let mut entries = Vec::new();
    take_until(events, |batch| {
        entries.extend(batch.applied);
        entries.len() >= count
    });
    assert_eq!(entries.len(), count, "{entries:?}");
    entries
}

/// The entries of one action among those that are told, until there are so many.
#[track_caller]
pub(crate) fn applied_as(events: &Events, action: Action, count: usize) -> Vec<Entry> {
    let mut entries = Vec::new();
    take_until(events, |batch| {
        entries.extend(batch.applied.into_iter().filter(|entry| entry.action == action));
        entries.len() >= count
    });
    entries
}
